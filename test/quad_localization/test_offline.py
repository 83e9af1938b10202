"""Offline flights of robots that find their places by their LIDARs."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from click.testing import CliRunner

from quad_localization.offline import MAKERS, LocalizationErrors, SlamLocalization
from quad_nav import config
from quad_nav.cli.__main__ import main
from quad_nav.cli.fly import LOCALIZATIONS
from quad_nav.config.robot_tree import RobotSource, robot_tree
from quad_nav.files.shipped import shipped
from quad_nav.geometry import Pose2D, quaternion_from_yaw
from quad_nav.loop import offline_setup
from quad_nav.loop.flight_loop import FlightLoop
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.scenario.rules import LOCALIZATIONS as RULE_NAMES
from quad_nav.scenario.rules import SIMULATOR
from quad_nav.sim.flight import BodyState
from quad_nav.sim.localization import believed_states
from quad_nav.sim.odometry import OdomFrames
from quad_nav.sim.robot_state import RobotStates


class Turned:
    """A localization that believes the odometry frame to be turned by a quarter."""

    def map_from_odom(self, _robot):
        return Pose2D(1.0, 0.0, math.pi / 2)


def test_what_a_robot_believes_follows_from_its_odometry():
    """By odometry the robot is at (2, 0) and looks along x, by the frame at (1, 2) and along y."""
    row = np.zeros((1, 13))
    row[0, :3], row[0, 3:7] = (5.0, 4.0, 1.0), quaternion_from_yaw(0.0)
    row[0, 7:10] = 0.3, 0.0, 0.0
    states = RobotStates(BodyState(row), OdomFrames(np.array([[3.0, 4.0, 0.0]])))
    found = believed_states(states, Turned())[0]
    assert found.map_from_base.translation == pytest.approx((1.0, 2.0, 1.0))
    assert found.map_from_base.yaw_rad == pytest.approx(math.pi / 2)
    assert (found.twist.vx_mps, found.twist.vy_mps) == pytest.approx((0.3, 0.0))
    assert found.map_velocities[:2] == pytest.approx((0.0, 0.3))
    assert believed_states(states, None) is states


def test_the_tutorial_s_mission_without_a_map(tmp_path):
    """Odometry that errs by 5 % of a metre; what is believed stays within 0.1 m of the truth."""
    options = ["--localization", "slam", "--odom-drift", "per_m=0.05,per_rad=0.05", "--seed", "5"]
    path = tmp_path / "flight.json"
    result = CliRunner().invoke(main, ["fly", *options, "--quiet", "--json", str(path)])
    assert result.exit_code == 0, result.output
    summary = json.loads(path.read_text())
    assert [goal["reached"] for one in summary["robots"] for goal in one["goals"]] == 6 * [True]
    assert summary["contacts"] == []
    assert summary["localization"]["position_error_m"]["p95"] < 0.1
    assert summary["localization"]["yaw_error_rad"]["p95"] < 0.03


def test_the_command_offers_what_is_here():
    assert LOCALIZATIONS == (SIMULATOR, *MAKERS)
    assert set(LOCALIZATIONS) < set(RULE_NAMES)


def test_robots_that_have_not_seen_anything_are_lost():
    assert SlamLocalization(None, 2).is_lost(1)
    assert LocalizationErrors().figures()["position_error_m"] == {"median": 0.0, "p95": 0.0}


def test_amcl_on_the_map_of_the_scene(tmp_path):
    options = ["--localization", "amcl", "--odom-drift", "per_m=0.05,per_rad=0.05", "--seed", "5"]
    path = tmp_path / "flight.json"
    result = CliRunner().invoke(main, ["fly", *options, "--quiet", "--json", str(path)])
    assert result.exit_code == 0, result.output
    summary = json.loads(path.read_text())
    assert summary["contacts"] == []
    assert summary["localization"]["position_error_m"]["p95"] < 0.15


def test_after_a_reset_the_map_is_made_anew():
    """The robots are at their starts again, and their odometry begins anew."""
    setup = read_setup(
        FlightOptions(None, shipped("goals"), localization=SlamLocalization, robots=2)
    )
    loop = FlightLoop(offline_setup(setup), [(0, 1)])
    loop.start()
    before = loop.group.localization
    assert not before.is_lost(1)
    loop.reset()
    assert loop.group.localization is not before
    assert loop.group.localization.is_lost(1), "no scan yet"
    loop.close()


def test_the_configuration_changes_the_default_where_poses_err():
    default, localized = (
        config.load(robot_tree(RobotSource(one, 3))) for one in ("default", "localized")
    )
    assert localized.remarks == ()
    assert localized.peers.margin_m == pytest.approx(0.1)
    assert localized.global_costmap == default.global_costmap
    assert localized.local_costmap == default.local_costmap
    assert localized.local_planner == default.local_planner
    report = CliRunner().invoke(main, ["check", "localized"])
    assert report.exit_code == 0, report.output


@pytest.mark.parametrize("name", MAKERS)
def test_a_person_tells_a_robot_where_it_is(name):
    """The pose that was given is in force with the next scan; only amcl searches the whole map."""
    options = FlightOptions(None, shipped("goals"), localization=MAKERS[name], robots=1)
    loop = FlightLoop(offline_setup(read_setup(options)), [(0,)])
    localization = loop.group.localization
    assert localization.estimate(0) is None
    loop.start()
    truth, (believed, covariance) = loop.states[0].map_from_base, localization.estimate(0)
    assert believed.distance_to(truth.to_2d()) < 0.1
    assert np.all(np.linalg.eigvalsh(covariance) > 0.0)
    wrong = Pose2D(believed.x_m + 0.5, believed.y_m, believed.yaw_rad)
    localization.set_pose(0, wrong, np.diag([1e-6, 1e-6, 1e-6]))
    loop.advance(loop.setup.steps_per_scan)
    loop.advance(loop.setup.steps_per_scan)
    moved, covariance = localization.estimate(0)
    particles = localization.particles(0)
    if name == "amcl":
        assert moved.distance_to(wrong) < 0.05
        assert np.hypot(*(particles[:, :2] - (wrong.x_m, wrong.y_m)).T).max() < 0.1
    assert localization.set_uniform(0) == (name == "amcl")
    if name == "amcl":
        assert np.ptp(localization.particles(0)[:, 0]) > 5.0
    else:
        assert particles is None
    loop.close()
