"""A simulator's parameters: defaults, the tutorial's LIDAR, and every fault at once."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from quad_nav.errors import InputError
from quad_nav.scenario.simulator_setup import read_setup

ARENA = str(Path(__file__).parents[3] / "scenes" / "arena.yaml")


def faults_of(**parameters) -> list:
    with pytest.raises(InputError) as caught:
        read_setup({"scene": ARENA, **parameters}, "simulator")
    return caught.value.problems


def test_defaults():
    setup = read_setup({"scene": ARENA}, "simulator")
    assert (setup.robots, setup.rate, setup.gui, setup.start_paused) == (2, 1.0, False, True)
    assert setup.steps_per_scan == 12
    lidar = setup.params.lidar
    assert lidar.beam_count == 512
    assert lidar.scan_range_rad == pytest.approx(2 * math.pi)
    assert setup.params.lidar_caster == "kernel"


def test_the_tutorials_half_turn_is_one_argument_away():
    setup = read_setup({"scene": ARENA, "scan_range": math.pi, "lidar": "bullet"}, "simulator")
    assert setup.params.lidar_caster == "bullet"
    assert setup.params.lidar.beam_count == 512
    assert setup.params.lidar.step_size_rad == pytest.approx(0.006135923, abs=1e-9)


def test_every_fault_is_listed():
    assert faults_of(scene="", robot=3, rate=0, gui="yes", lidar_rate=7, jitter=float("nan")) == [
        "simulator: robot: is not a parameter of the simulator; expected robots",
        "simulator: scene: is ''; expected a scene file such as scenes/arena.yaml, or random",
        "simulator: rate: is 0; expected a number above 0",
        "simulator: gui: is 'yes'; expected true or false",
        "simulator: lidar_rate: is 7; expected scans per second that divide 240, such as 10 or 20",
        "simulator: jitter: is nan; expected a number, 0 or more",
    ]


@pytest.mark.parametrize(
    "parameters, problem",
    [
        (
            {"robots": 9},
            "simulator: robots: 9, expected 1 to 8, the start poses of scene arena; a further line"
            " in its `starts` adds a robot",
        ),
        ({"robots": True}, "simulator: robots: is True; expected a whole number, 1 to 100"),
        ({"lidar": "gazebo"}, "simulator: lidar: is 'gazebo'; expected kernel or bullet"),
        (
            {"scan_range": 3.0, "step_size": 4.0},
            "simulator: step_size: 4.0, expected an angle that divides scan_range, 3.0, into 2 or"
            " more",
        ),
        (
            {"scan_range": 7.0, "step_size": 0.1},
            "simulator: scan_range: 7.0, expected an angle in (0, 2 pi]",
        ),
    ],
)
def test_single_faults(parameters, problem):
    assert faults_of(**parameters) == [problem]
