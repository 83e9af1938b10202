# `make fly` and `make test` set up what they need first: system packages through apt, a virtual
# environment .venv and a catkin workspace .ws in the checkout. Later calls do none of it again.

SHELL := /bin/bash
PYTHON := .venv/bin/python3

# The parts of a target run one after the other, apart from the user's own Python set-up.
.NOTPARALLEL:
unexport PYTHONPATH PYTHONHOME
export PYTHONNOUSERSITE := 1

.PHONY: help fly test unit unit38 web lint docs rostest first-hour ray conformance replay-vehicles fly-vehicles replay-airframe fuzz bench bench-compare bench-fleets bench-original debian12 debian13 packages flight-venv venv workspace clean distclean

help:  ## List the targets
	@sed -nE 's/^([a-z0-9-]+):.*## (.*)/  make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 22

# The page in the browser is an extra. Without a display it takes the place of RViz, if it can be
# installed; web:=true and web:=false decide otherwise.
#
# make itself ends with 2 on any failure and names the sequencer's own exit status in its message.
fly: workspace  ## Fly the mission: make fly ARGS="config:=tutorial rate:=2"
	@$(if $(filter web:=true,$(ARGS)),scripts/make_venv .venv requirements-web.txt,\
	    $(if $(DISPLAY)$(filter web:=false,$(ARGS)),:,scripts/make_venv .venv requirements-web.txt || \
	    echo "quad: flying without a page: NiceGUI cannot be installed"))
	@scripts/ros_env scripts/fly $(ARGS)

test: workspace unit unit38 web lint docs rostest first-hour  ## Run every test and static check
	@echo "quad: all tests passed"

# Without ROS the tests of its nodes are left out.
unit: venv $(if $(wildcard /usr/bin/catkin_make /opt/ros/noetic),workspace)  ## The unit tests
	@scripts/make_venv .venv requirements-test.txt requirements-web.txt
	$(PYTHON) -m pytest -n auto --dist loadfile

unit38:  ## A part of the unit tests under Python 3.8, where there is one
	@scripts/unit_tests_38

web: venv  ## The tests of the web page in a real browser: make web TEST=goal
	@scripts/install_packages --browser
	@scripts/make_venv .venv requirements-test.txt requirements-web.txt requirements-web-test.txt requirements-docs.txt
	QUAD_CHROMIUM=$$(scripts/chromium) $(PYTHON) -m pytest --timeout 90 test/web $(if $(TEST),-k $(TEST))

lint: venv  ## ruff, mypy, the structure of the sources, and their sizes
	@scripts/make_venv .venv requirements-test.txt requirements-web.txt requirements-lint.txt
	$(PYTHON) -m ruff format --check
	$(PYTHON) -m ruff check
	$(PYTHON) -m mypy
	$(PYTHON) -m pytest -q test/project/test_structure.py test/project/test_imports.py
	scripts/sizes

# The PATH has ruff, which formats the signatures. The variable silences an advertisement.
docs: venv  ## The documentation as a site, in site/; warnings are errors
	@scripts/make_venv .venv requirements-lint.txt requirements-docs.txt
	@PATH="$(CURDIR)/.venv/bin:$$PATH" NO_MKDOCS_2_WARNING=1 $(PYTHON) -m mkdocs build --quiet --strict
	@echo "quad: open site/index.html"

rostest: venv workspace  ## The tests with a roscore: make rostest TEST=environment
	@$(if $(if $(TEST),$(filter web_browser,$(TEST)),all),scripts/install_packages --browser)
	@scripts/make_venv .venv requirements-web.txt requirements-web-test.txt requirements-mavlink.txt requirements-crazyflie.txt
	@scripts/ros_env scripts/rostests $(TEST)

first-hour: venv workspace  ## What a user does first: an own scene, map, robot, goals and report
	@test/first_hour.sh

# Not in `make test`: Ray is an extra, 70 MB. The cluster is on this machine.
ray:  ## The tests with a Ray cluster, in an environment of their own
	@scripts/install_packages --venv
	@scripts/make_venv .venv-ray requirements.txt requirements-report.txt requirements-tune.txt requirements-test.txt
	@.venv-ray/bin/python3 -m pip install --quiet '.[ray]'
	PYTHONPATH=src .venv-ray/bin/python3 -m pytest test/ray

# make itself ends with 2 on any failure and names the command's own exit status in its message.
conformance: venv  ## Compare with the original's recordings: make conformance DIR=folder
	@$(PYTHON) test/conformance/run.py $(DIR)

replay-vehicles: venv  ## Replay recorded MAVLink logs to the bridge, and to the stand-in vehicle: make replay-vehicles DIR=folder
	@scripts/make_venv .venv requirements-mavlink.txt
	@PYTHONPATH=src:test $(PYTHON) test/vehicles/replay.py $(DIR)
	@PYTHONPATH=src:test $(PYTHON) test/vehicles/stand_in_check.py $(DIR)

fly-vehicles: venv  ## The tutorial's mission with stand-in vehicles and the bridge: make fly-vehicles ARGS="3 ardupilot"
	@PYTHONPATH=src:test $(PYTHON) test/vehicles/missions.py $(ARGS)

replay-airframe: venv  ## Compare the airframe with recorded flights: make replay-airframe DIR=folder
	@PYTHONPATH=src:test $(PYTHON) test/vehicles/airframe_check.py $(DIR)

fuzz: venv  ## Feed what reads files or messages with made-up bytes: make fuzz TARGET=scene SECONDS=60
ifeq ($(TARGET),vehicle)
	@scripts/make_venv .venv requirements-mavlink.txt
	PYTHONPATH=src:test $(PYTHON) test/fuzz/vehicle.py $(SECONDS) $(addprefix --messages=,$(MESSAGES))
else
	@scripts/make_venv .venv requirements-fuzz.txt
	PYTHONPATH=src $(PYTHON) test/fuzz/run.py $(TARGET) $(SECONDS)
endif

bench: NAME := bench-$(shell date +%Y%m%d-%H%M%S)
bench: venv  ## How long parts, scans and flights take; writes a file: make bench NAME=before
	@scripts/make_venv .venv requirements-test.txt
	@rm -f $(NAME).json
	PYTHONPATH=src $(PYTHON) -m quad_nav.scenario.warm_up
	PYTHONPATH=src $(PYTHON) bench/navigation.py --json $(NAME).json
	PYTHONPATH=src $(PYTHON) bench/flight.py --json $(NAME).json
	PYTHONPATH=src $(PYTHON) bench/flight.py --json $(NAME).json --config default
	@echo "quad: the figures are in $(NAME).json"

# make itself ends with 2 on any failure and names the command's own exit status in its message.
bench-compare: venv  ## What got slower between two runs: make bench-compare A=before.json B=after.json
	@PYTHONPATH=src $(PYTHON) bench/figures.py $(ARGS) $(A) $(B)

bench-fleets: venv  ## Whether fleets get through without touching: make bench-fleets ARGS="swap 8in12"
	PYTHONPATH=src $(PYTHON) bench/encounters.py $(ARGS)

bench-original: workspace  ## What a navigator costs under ROS beside C++ move_base: make bench-original ARGS="--config default"
	@scripts/ros_env $(PYTHON) bench/original.py $(ARGS)

debian12:  ## Fly on a bare Debian 12 in a chroot; needs root, 3 GB and minutes
	@scripts/debian bookworm $(TESTS)

debian13:  ## The same on Debian 13, then make unit: make debian13 TESTS=unit
	@scripts/debian trixie $(TESTS)

packages:  ## Install the system packages
	@scripts/install_packages $(if $(and $(DISPLAY),$(filter fly,$(MAKECMDGOALS))),--rviz)

# What a flight needs.
flight-venv:
	@scripts/install_packages --venv
	@scripts/make_venv .venv requirements.txt
	@scripts/make_command .venv

venv: flight-venv  ## Make the virtual environment, with the command .venv/bin/quad; needs no ROS
	@scripts/make_venv .venv requirements-report.txt requirements-tune.txt

workspace: packages flight-venv  ## Build the catkin workspace
	@scripts/build_workspace

clean:  ## Remove what was built, but not the virtual environments
	rm -rf .ws build dist site .pytest_cache .mypy_cache .ruff_cache src/*.egg-info
	find src test nodes -name __pycache__ -prune -exec rm -rf {} +

distclean: clean  ## Remove the virtual environments too
	rm -rf .venv .venv38 .venv-ray
