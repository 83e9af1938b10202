"""Odometry frames that drift and turn in the map: poses by hand, and flights that do not notice."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from recorded_flight import flown, setup

from quad_nav.errors import InputError
from quad_nav.files.shipped import shipped
from quad_nav.geometry import Pose2D, Pose3D, covariance_36, quaternion_from_yaw
from quad_nav.loop.navigator_group import LoopRobot
from quad_nav.offline.flight import FlightObserver
from quad_nav.offline.run import fly
from quad_nav.peers.peer import Intention, Peer
from quad_nav.recording import messages
from quad_nav.recording.bag_file import read_messages
from quad_nav.recording.bag_trace import read_trace
from quad_nav.recording.recorder import Recorder
from quad_nav.scenario.scenario import read_configurations
from quad_nav.sim.odometry import FIXED_FRAMES, Odometry, OdometryErrors, OdomFrames, pose_in
from quad_nav.sim.scene_file import load_scene
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import SimulationParams

DRIFT = OdometryErrors(per_m=0.05, per_rad=0.05, speed=0.02, turn=0.005, slip=0.05)
QUARTER_TURN = math.pi / 2


def configuration(folder: Path, global_frame: str, local_frame: str) -> str:
    """Copy the default configuration with other global frames of the costmaps."""
    folder.mkdir()
    for path in sorted(shipped("config", "default").glob("*.yaml")):
        frame = global_frame if path.name.startswith("global") else local_frame
        text = path.read_text(encoding="utf-8")
        text = text.replace("global_frame: map", f"global_frame: {frame}")
        (folder / path.name).write_text(text, encoding="utf-8")
    return str(folder)


# -- frames ------------------------------------------------------------------------------


def measured(robots=1, yaw_rad=0.0, length_m=1.0, turn_rad=0.0, seconds=4.0, seed=4, **errors):
    """Return the odometry after a straight way, with a constant turn, in steps of 1/40 s."""
    poses = np.zeros((robots, 3))
    poses[:, 2] = yaw_rad
    odometry = Odometry(OdometryErrors(**errors), poses, 0.0, seed)
    for step in range(1, round(40 * seconds) + 1):
        share = step / (40 * seconds)
        moved = np.array([math.cos(yaw_rad), math.sin(yaw_rad), turn_rad])
        odometry.update(poses + share * np.array([length_m, length_m, 1.0]) * moved, step / 40)
    return odometry


def rows(odometry, pose):
    """Return the poses float64[n, 3] that odometry measured of robots at a pose in the map."""
    frames = (odometry.frames.map_from_odom(n) for n in range(len(odometry.frames.rows)))
    return np.array([dataclasses.astuple(pose.relative_to(frame)) for frame in frames])


def test_after_a_metre_the_way_has_its_standard_deviation_in_each_direction():
    found = rows(measured(robots=4000, per_m=0.05), Pose2D(1.0, 0.0))
    assert found.mean(axis=0) == pytest.approx([1.0, 0.0, 0.0], abs=0.003)
    assert found[:, :2].std(axis=0) == pytest.approx(0.05, rel=0.05)
    assert np.all(found[:, 2] == 0.0)


def test_the_error_of_a_way_grows_with_its_root():
    found = rows(measured(robots=4000, length_m=4.0, per_m=0.05), Pose2D(4.0, 0.0))
    assert found[:, :2].std(axis=0) == pytest.approx(0.1, rel=0.05)


def test_after_a_turn_of_a_radian_the_yaw_has_its_standard_deviation():
    odometry = measured(robots=4000, length_m=0.0, turn_rad=1.0, per_rad=0.05)
    assert rows(odometry, Pose2D(0.0, 0.0, 1.0))[:, 2].std() == pytest.approx(0.05, rel=0.05)


def test_the_covariance_is_that_of_the_errors():
    """An error of yaw moves what is flown after it to the side."""
    odometry = measured(robots=4000, turn_rad=1.0, per_m=0.05, per_rad=0.05)
    found = rows(odometry, Pose2D(1.0, 0.0, 1.0))
    assert np.cov(found.T) == pytest.approx(odometry.covariances[0], abs=2e-4)
    message = covariance_36(odometry.covariances[0]).reshape(6, 6)
    assert message[5, 5] == pytest.approx(0.05**2)
    assert message[1, 5] == odometry.covariances[0][1, 2] != 0.0
    assert not message[2:5].any()


def test_at_rest_a_frame_moves_and_turns_at_the_given_speeds():
    moved = measured(length_m=0.0, seconds=10.0, speed=0.2).frames.map_from_odom(0)
    assert math.hypot(moved.x_m, moved.y_m) == pytest.approx(2.0)
    turned = measured(robots=2, length_m=0.0, seconds=10.0, turn=0.1).frames.rows
    assert sorted(turned[:, 2]) == pytest.approx([-1.0, 1.0])


def test_a_slip_loses_the_way_of_half_a_second_and_no_turn():
    """8 pieces of half a second of 0.125 m each, of which some are lost."""
    odometry = measured(robots=400, turn_rad=0.5, slip=0.25)
    found = rows(odometry, Pose2D(1.0, 0.0, 0.5))
    assert found[:, 2] == pytest.approx(0.5)
    ways = np.hypot(found[:, 0], found[:, 1])
    assert ways.mean() == pytest.approx(0.75, abs=0.03)
    assert ways.max() <= 1.0 + 1e-9


def test_frames_differ_by_robot_and_seed():
    first = measured(robots=2, speed=0.04, turn=0.02).frames.rows
    assert np.abs(first[0] - first[1]).max() > 0.01
    assert np.array_equal(measured(robots=2, speed=0.04, turn=0.02).frames.rows, first)
    other = measured(robots=2, speed=0.04, turn=0.02, seed=5).frames.rows
    assert np.abs(other - first).max() > 0.01


def test_only_a_robot_s_own_odometry_frame_moves():
    frames = measured(robots=2, speed=0.04).frames
    moved = frames.map_from_odom(1)
    assert frames.map_from_frame("odom1", 1) == frames.map_from_frame("/odom1", 1) == moved
    assert frames.map_from_frame("map", 1) == Pose2D(0.0, 0.0) != moved
    assert FIXED_FRAMES.map_from_odom(1) == Pose2D(0.0, 0.0)


def test_a_pose_in_a_frame_that_was_moved_and_turned():
    """The robot is 3 m along x of a frame at (1, 2) that is turned by a quarter to the left."""
    robot = Pose3D(1.0, 5.0, 0.7, quaternion_from_yaw(QUARTER_TURN))
    found = pose_in(Pose2D(1.0, 2.0, QUARTER_TURN), robot)
    assert (found.x_m, found.y_m, found.z_m) == pytest.approx((3.0, 0.0, 0.7))
    assert found.yaw_rad == pytest.approx(0.0)
    assert pose_in(Pose2D(0.0, 0.0), robot) is robot


def test_a_peer_and_its_path_in_such_a_frame():
    intention = Intention(-7.0, np.array([[1.0, 5.0], [1.0, 6.0]]))
    peer = Peer("quad1", 1.0, 5.0, 0.0, 0.3, 12.0, intention)
    found = peer.relative_to(Pose2D(1.0, 2.0, QUARTER_TURN))
    assert (found.x_m, found.y_m) == pytest.approx((3.0, 0.0))
    assert (found.vx_mps, found.vy_mps) == pytest.approx((0.3, 0.0))
    assert (found.name, found.stamp_s, found.intention.priority) == ("quad1", 12.0, -7.0)
    assert found.intention.path == pytest.approx(np.array([[3.0, 0.0], [4.0, 0.0]]))


def test_the_simulation_starts_and_restarts_without_drift():
    simulation = Simulation(
        load_scene(shipped("scenes", "arena.yaml")),
        2,
        SimulationParams(odom_drift=OdometryErrors(speed=0.2, turn=0.1)),
        start_step=240,
    )
    assert simulation.map_from_frame("odom0", 0) == Pose2D(0.0, 0.0)
    simulation.advance(480)
    drifted = simulation.map_from_frame("odom0", 0)
    assert abs(drifted.yaw_rad) == pytest.approx(0.2, abs=1e-6)  # after 2 s
    simulation.reset()
    assert simulation.map_from_frame("odom0", 0) == Pose2D(0.0, 0.0)
    simulation.close()


def test_a_goal_in_the_map_becomes_one_in_the_costmap_s_frame(tmp_path):
    """Only then is the goal known in the frame that the robot plans in, ten seconds after start."""
    config = configuration(tmp_path / "config", "odom$(arg i)", "map")
    map_from_odom = Pose2D(-1.2, 1.6, 0.5)
    robot = LoopRobot(read_configurations(config, 1)[0], 0)
    robot.frames = OdomFrames(np.array([dataclasses.astuple(map_from_odom)]))
    robot.waiting_goal = Pose2D(3.0, 4.0, 0.5)
    robot.is_due(10.0)
    goal = robot.navigator.goal
    assert map_from_odom.transform(goal.x_m, goal.y_m) == pytest.approx((3.0, 4.0))
    assert goal.yaw_rad == pytest.approx(0.5 - map_from_odom.yaw_rad)
    assert goal.distance_to(Pose2D(3.0, 4.0)) > 1.0


@pytest.mark.parametrize("error", [-0.1, 1.1, math.nan, math.inf])
def test_errors_out_of_range_are_refused(error):
    with pytest.raises(InputError, match="odom_drift/slip: .*expected 0 to 1"):
        OdometryErrors(slip=error)


# -- flights -----------------------------------------------------------------------------


def test_without_drift_the_frame_of_a_costmap_changes_no_bit(tmp_path):
    flights = [
        flown(setup(tmp_path, config=configuration(tmp_path / name, *frames)))
        for name, frames in (("map", ("map", "map")), ("odom", ("odom$(arg i)",) * 2))
    ]
    assert flights[0].summary.robots == flights[1].summary.robots
    for one, other in zip(*(flight.trace.robots for flight in flights)):
        for field in ("times_s", "positions_m", "quaternions", "velocities", "commands"):
            assert np.array_equal(getattr(one, field), getattr(other, field)), field


def test_goals_are_reached_with_both_costmaps_in_a_frame_that_drifts(tmp_path):
    config = configuration(tmp_path / "config", *2 * ("odom$(arg i)",))
    drift = SimulationParams(odom_drift=DRIFT)
    summary = flown(setup(tmp_path, config=config, simulation=drift, time_limit_s=60.0)).summary
    assert summary.success, summary


def test_a_flight_that_drifts_is_the_same_in_two_processes(tmp_path):
    """Intentions cross from process to process in the map."""
    config = configuration(tmp_path / "config", *2 * ("odom$(arg i)",))
    flight = setup(
        tmp_path, config=config, simulation=SimulationParams(odom_drift=DRIFT), time_limit_s=10.0
    )
    assert fly(flight, processes=2).robots == fly(flight).robots


def test_goals_off_a_costmap_that_drifts_are_not_refused(tmp_path):
    """The costmap moves in the map, so its bounds in the map are not fixed."""
    config = configuration(tmp_path / "config", "odom$(arg i)", "map")
    small = (("global_costmap/width", 2), ("global_costmap/height", 2))
    with pytest.raises(InputError, match="is off the global costmap"):
        setup(tmp_path, config=config, parameters=small)
    setup(
        tmp_path,
        config=config,
        parameters=small,
        simulation=SimulationParams(odom_drift=DRIFT),
    )


# -- recordings --------------------------------------------------------------------------


class States(FlightObserver):
    """True poses of robot 1 in the map."""

    def __init__(self):
        self.poses = []

    def on_start(self, flight):
        self.on_move(flight)

    def on_move(self, flight):
        self.poses.append(flight.states[1].map_from_base)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drift")
    config = configuration(folder / "config", *2 * ("odom$(arg i)",))
    drift = SimulationParams(odom_drift=DRIFT)
    states, recorder = States(), Recorder(folder / "flight.bag")
    flight = flown(setup(folder, config=config, simulation=drift), [states, recorder])
    return folder / "flight.bag", states, flight


def test_recorded_odometry_and_transforms_make_the_true_pose(recorded):
    path, states, _ = recorded
    transforms = [m.content.transforms[3] for m in read_messages(path, lambda t, _: t == "/tf")]
    odometry = [m.content for m in read_messages(path, lambda t, _: t == "/odom1")]
    assert len(transforms) == len(odometry) == len(states.poses)
    for transform, message, true in zip(transforms, odometry, states.poses):
        assert (transform.header.frame_id, transform.child_frame_id) == ("map", "odom1")
        moved = transform.transform
        map_from_odom = messages.pose_from(moved.translation, moved.rotation)
        pose = message.pose.pose
        found = map_from_odom.compose(messages.pose_from(pose.position, pose.orientation))
        assert found.translation == pytest.approx(true.translation, abs=1e-9)
        assert found.yaw_rad == pytest.approx(true.yaw_rad, abs=1e-9)
    assert math.hypot(map_from_odom.x_m, map_from_odom.y_m) > 0.05


def test_a_trace_has_plans_in_the_map(recorded):
    """A plan ends at its goal; the trace of the recording is that of the flight."""
    path, _, flight = recorded
    for seen, read in zip(flight.trace.robots, read_trace(path).robots):
        assert np.allclose(read.positions_m, seen.positions_m, atol=1e-9)
        assert len(read.plans) == len(seen.plans) > 1
        for (_, one), (_, other) in zip(read.plans, seen.plans):
            assert np.allclose(one[:, :2], other[:, :2], atol=1e-9)
        goal = seen.goals[-1].pose
        assert np.hypot(*(seen.plans[-1][1][-1, :2] - (goal.x_m, goal.y_m))) < 0.2
