"""The shipped encounters: every robot reaches its goals, without contacts.

``bench/encounters.py`` flies them with many seeds.
"""

from __future__ import annotations

import pytest

from quad_nav.files.shipped import shipped
from quad_nav.mission.robot_goals import goal_paths
from quad_nav.offline.run import fly
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.simulation_params import SimulationParams

SCENES = sorted(path.stem for path in shipped("scenes", "encounters").glob("*.yaml"))
LOOPS = {"corridor_to_and_fro": "corridor"}
MARGIN_M = 0.15  # between hulls: twice 0.05 m, and 0.12 m by which footprints are wider


def setup_of(goals: str, seed: int = 0, time_limit_s: float = 150.0):
    beams = LidarParams(step_size_rad=LidarParams().scan_range_rad / 256)
    return read_setup(
        FlightOptions(
            shipped("scenes", f"encounters/{LOOPS.get(goals, goals)}.yaml"),
            shipped("goals", f"encounters/{goals}"),
            seed=seed,
            time_limit_s=time_limit_s,
            scans_per_s=10.0,
            simulation=SimulationParams(beams, jitter_m=0.3),
        )
    )


def test_every_scene_has_goals_and_every_goal_a_scene():
    folders = {path.name for path in shipped("goals", "encounters").iterdir()}
    assert folders == {*SCENES, *LOOPS}
    for name in folders:
        setup = setup_of(name)
        assert len(setup.robots) == len(setup.scene.starts) >= 2
        assert not goal_paths(shipped("goals", f"encounters/{name}"), len(setup.robots))[1]
        assert all(robot.sequence.settings.loop == (name in LOOPS) for robot in setup.robots)


@pytest.mark.slow
@pytest.mark.parametrize("name, seed", [(name, 50 + k) for k, name in enumerate(SCENES)])
def test_every_robot_reaches_its_goals_without_contacts(name, seed):
    summary = fly(setup_of(name, seed))
    assert summary.success, [(robot.robot, robot.legs) for robot in summary.robots]
    assert summary.min_separation_m is not None and summary.min_separation_m > MARGIN_M


def test_in_a_corridor_both_robots_take_turns():
    """Each direction takes 8 m / 0.3 m/s = 27 s, and only one can fly it at a time."""
    summary = fly(setup_of("corridor_to_and_fro", time_limit_s=110.0))
    assert not summary.contacts
    for robot in summary.robots:
        assert robot.reached >= 2
        assert max(leg.time_s for leg in robot.legs if leg.reached) < 75.0
