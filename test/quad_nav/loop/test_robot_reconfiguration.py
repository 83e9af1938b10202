"""A robot whose parameters change in flight: each of its parts follows, in each shell."""

from __future__ import annotations

import numpy as np
import pytest

import quad_nav
from quad_nav.config import updated
from quad_nav.costmap.scan_intake import SensorPose
from quad_nav.errors import InputError
from quad_nav.geometry import Pose3D, Scan
from quad_nav.loop.inspection import Inspection
from quad_nav.offline import flight as offline

GOALS = [[[1.0, 4.5]], [[8.5, 1.5]]]
EVERY = {
    "reject_implausible_scans": False,
    "sensor_timeout": 0.2,
}


def setup_of(config="default", robots=2):
    simulation = quad_nav.lidar_simulation(beams=128)
    return quad_nav.prepare(goals=GOALS[:robots], config=config, simulation=simulation)


def assert_follows(robot):
    """Every part of a robot has the values of ``EVERY``."""
    assert robot.navigator.params.sensor_timeout_s == 0.2
    for intake in robot.intakes:
        assert intake.expected_period_s == 0.2
        assert not intake.is_late(0.0, 100.0)  # it takes implausible scans
    for costmap in (robot.navigator.global_costmap, robot.navigator.local_costmap):
        for buffer in costmap.layers["obstacle_layer"].buffers.values():
            assert buffer.params.expected_update_period_s == 0.2


def test_no_part_follows_a_refused_change():
    with quad_nav.Flight(setup_of()) as flight:
        with pytest.raises(InputError, match="sensor_timeout"):
            flight.reconfigure(0, {**EVERY, "sensor_timeout": "soon"})
        robot = flight._loop.offline_robots[0]
        assert robot.navigator.params.sensor_timeout_s == 0.5
        assert robot.intakes[0].is_late(0.0, 100.0)


def test_a_robot_without_a_navigator_cannot_be_reconfigured():
    with quad_nav.Flight(setup_of(), navigators=False) as flight:
        with pytest.raises(ValueError, match="robot 0 has no navigator"):
            flight.reconfigure(0, EVERY)


@pytest.mark.parametrize("processes", [1, 2])
def test_every_part_follows_in_each_process(processes):
    """Without scans the robots stop after 0.2 s instead of 0.5 s."""
    flight = offline.Flight(setup_of(), processes=processes)
    try:
        for robot in (0, 1):
            configuration = flight.robots[robot].configuration
            for path, value in EVERY.items():
                namespace, _, name = path.rpartition("/")
                configuration = updated(configuration, namespace, {name: value})
            flight.reconfigure(robot, configuration)
        for robot in flight.offline_robots.values():
            assert_follows(robot)
        while flight.now_s < 4.0:
            flight.advance()
        views = flight.loop.inspect(Inspection())
        assert [view.stopped_reason for view in views] == ["", ""]
        for robot in (0, 1):
            flight.loop.enable_lidar(robot, False)
        while flight.now_s < 4.4:
            flight.advance()
        reasons = [view.stopped_reason for view in flight.loop.inspect(Inspection())]
        assert all(reason.startswith("stopping: no data from") for reason in reasons)
    finally:
        flight.end()


def test_the_validator_follows_a_longer_time_out():
    """The tutorial's own limit is 21 s."""
    with quad_nav.Flight(setup_of("tutorial", robots=1)) as flight:
        intake = flight._loop.offline_robots[0].intakes[0]
        scan = Scan(0.0, -np.pi, np.pi / 64, 0.02, 60.0, np.full(128, 3.0, np.float32))
        lidar = Pose3D(1.0, 1.0, 0.3)
        poses = [SensorPose(lidar, lidar)] * len(intake.sinks)
        assert "expected less than 1.00 s" in intake.add_scan(scan, poses, 1.5, 1.5)
        flight.reconfigure(0, {"sensor_timeout": 2.0})
        assert intake.add_scan(scan, poses, 1.5, 1.5) == ""


@pytest.mark.parametrize(
    "name", ["dwa_local_planner/DWAPlannerROS", "global_planner/GlobalPlanner"]
)
def test_a_planner_changes_on_the_way(name):
    """The robot stops for a moment, and the other planner takes it to its goal."""
    key = "base_local_planner" if "local" in name else "base_global_planner"
    with quad_nav.Flight(setup_of(robots=1)) as flight:
        while flight.now_s < 5.0:
            flight.step()
        assert flight.state(0).twist.vx_mps > 0.1
        changed = flight.reconfigure(0, {key: name})
        assert getattr(changed.navigator, key) == name
        while not flight.has_ended(0) and flight.now_s < 60.0:
            flight.step()
        assert np.hypot(*(flight.positions_m[0, :2] - GOALS[0][-1])) < 0.5
        assert not flight.contacts
