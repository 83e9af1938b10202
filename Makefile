# `make fly` and `make test` set up what they need first: system packages through apt, a virtual
# environment .venv and a catkin workspace .ws in the checkout. Later calls do none of it again.

SHELL := /bin/bash
PYTHON := .venv/bin/python3

# The parts of a target run one after the other, apart from the user's own Python set-up.
.NOTPARALLEL:
unexport PYTHONPATH PYTHONHOME
export PYTHONNOUSERSITE := 1

.PHONY: help fly test unit unit38 lint docs rostest first-hour ray conformance fuzz bench bench-fleets packages venv workspace clean distclean

help:  ## List the targets
	@sed -nE 's/^([a-z0-9-]+):.*## (.*)/  make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 20

# make itself ends with 2 on any failure and names the sequencer's own exit status in its message.
fly: workspace  ## Fly the mission: make fly ARGS="config:=tutorial rate:=2"
	@scripts/ros_env scripts/fly $(ARGS)

test: unit unit38 lint docs rostest first-hour  ## Run every test and static check
	@echo "quad: all tests passed"

unit: venv  ## The unit tests
	@scripts/make_venv .venv requirements-test.txt
	$(PYTHON) -m pytest -n auto --dist loadfile

unit38: packages  ## The unit tests under Python 3.8, where there is one
	@scripts/unit_tests_38

lint: venv  ## ruff, mypy and the structure of the sources
	@scripts/make_venv .venv requirements-test.txt requirements-lint.txt
	$(PYTHON) -m ruff format --check
	$(PYTHON) -m ruff check
	$(PYTHON) -m mypy
	$(PYTHON) -m pytest -q test/unit/test_structure.py test/unit/test_imports.py

# The PATH has ruff, which formats the signatures. The variable silences an advertisement.
docs: venv  ## The documentation as a site, in site/; warnings are errors
	@scripts/make_venv .venv requirements-lint.txt requirements-docs.txt
	@PATH="$(CURDIR)/.venv/bin:$$PATH" NO_MKDOCS_2_WARNING=1 $(PYTHON) -m mkdocs build --quiet --strict
	@echo "quad: open site/index.html"

rostest: workspace  ## The tests with a roscore: make rostest TEST=environment
	@scripts/ros_env scripts/rostests $(TEST)

first-hour: workspace  ## What a user does first: an own scene, map, robot, goals and report
	@test/first_hour.sh

# Not in `make test`: Ray is an extra, 70 MB. The cluster is on this machine.
ray: packages  ## The tests with a Ray cluster, in an environment of their own
	@scripts/make_venv .venv-ray requirements.txt requirements-test.txt
	@.venv-ray/bin/python3 -m pip install --quiet '.[ray]'
	PYTHONPATH=src .venv-ray/bin/python3 -m pytest test/ray

# make itself ends with 2 on any failure and names the command's own exit status in its message.
conformance: venv  ## Compare with the original's recordings: make conformance DIR=folder
	@$(PYTHON) test/conformance/run.py $(DIR)

fuzz: venv  ## Feed what reads files with made-up bytes: make fuzz TARGET=scene SECONDS=60
	@scripts/make_venv .venv requirements-fuzz.txt
	PYTHONPATH=src $(PYTHON) test/fuzz/run.py $(TARGET) $(SECONDS)

bench: venv  ## How long the navigator's parts take, beside the original, scans and flights
	PYTHONPATH=src $(PYTHON) bench/navigation.py
	PYTHONPATH=src $(PYTHON) bench/lidar.py
	PYTHONPATH=src $(PYTHON) bench/flight.py
	@scripts/make_venv .venv requirements-test.txt
	PYTHONPATH=src $(PYTHON) bench/rl.py

bench-fleets: venv  ## Whether fleets get through without touching: make bench-fleets ARGS="swap 8in12"
	PYTHONPATH=src $(PYTHON) bench/encounters.py $(ARGS)

packages:  ## Install the system packages
	@scripts/install_packages $(if $(and $(DISPLAY),$(filter fly,$(MAKECMDGOALS))),--rviz)

venv: packages  ## Make the virtual environment, with the command .venv/bin/quad
	@scripts/make_venv .venv requirements.txt
	@scripts/make_command .venv

workspace: venv  ## Build the catkin workspace
	@scripts/build_workspace

clean:  ## Remove what was built, but not the virtual environments
	rm -rf .ws build dist site .pytest_cache .mypy_cache .ruff_cache src/*.egg-info
	find src test nodes -name __pycache__ -prune -exec rm -rf {} +

distclean: clean  ## Remove the virtual environments too
	rm -rf .venv .venv38 .venv-ray
