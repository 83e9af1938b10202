"""Recordings: the flight stays as it is, and the file holds what happened, to the bit."""

from __future__ import annotations

import math

import numpy as np
import pytest
from recorded_flight import flown, setup

from quad_nav.costmap.cost_grid import occupancy
from quad_nav.geometry import Pose2D
from quad_nav.mission.goal import Goal
from quad_nav.offline.flight import FlightObserver
from quad_nav.offline.run import fly
from quad_nav.recording import messages
from quad_nav.recording.bag_file import read_messages
from quad_nav.recording.messages import path_bytes, plan_bytes
from quad_nav.recording.recorder import Recorder
from quad_nav.topics.flight_info import FLIGHT_TOPIC, flight_info_from_message


class Notes(FlightObserver):
    """Keeps what is handed over, to be compared with what was written."""

    def __init__(self):
        self.scans, self.states, self.windows = [], [], []

    def on_start(self, flight):
        self._flight = flight
        self.on_move(flight)

    def on_scan(self, robot, scan, map_from_lidar):
        self.scans.append((robot, scan))

    def on_move(self, flight):
        self.states.append((flight.now_s, list(flight.states)))

    def on_tick(self, robot, tick, located, wall_s):
        for name in tick.windows:
            navigator = self._flight.offline_robots[robot].navigator
            costs = {"global": navigator.global_costmap, "local": navigator.local_costmap}[name]
            self.windows.append((robot, name, tick.now_s, occupancy(costs.costs)))


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flight")
    path, notes = folder / "flight.bag", Notes()
    flight_setup = setup(folder)
    return path, notes, flown(flight_setup, [notes, Recorder(path, "short")]), flown(flight_setup)


def read(path, *topics):
    return list(read_messages(path, lambda topic, kind: topic in topics))


def test_recording_changes_no_bit_of_the_flight(recorded):
    _, _, with_recorder, without = recorded
    assert with_recorder.summary.success
    assert with_recorder.summary.robots == without.summary.robots
    for one, other in zip(with_recorder.trace.robots, without.trace.robots):
        for field in ("times_s", "positions_m", "quaternions", "velocities", "commands"):
            assert np.array_equal(getattr(one, field), getattr(other, field)), field
        assert one.goals == other.goals


def test_the_same_flight_makes_the_same_file(recorded, tmp_path):
    path = recorded[0]
    again = tmp_path / "again.bag"
    fly(setup(tmp_path), [Recorder(again, "short")])
    assert again.read_bytes() == path.read_bytes()


def test_odometry_and_transforms_are_the_simulation_s_to_the_bit(recorded):
    path, notes, *_ = recorded
    found = read(path, "/odom1")
    assert len(found) == len(notes.states)
    for message, (now_s, states) in zip(found, notes.states):
        odometry, state = message.content, states[1]
        assert messages.stamp_ns(odometry.header.stamp) == message.stamp_ns
        assert message.stamp_ns == round(now_s * 1e9) + 10**9
        pose = odometry.pose.pose
        assert messages.pose_from(pose.position, pose.orientation) == state.map_from_base
        linear = odometry.twist.twist.linear
        assert (linear.x, linear.y, linear.z) == state.linear_mps
        assert (odometry.header.frame_id, odometry.child_frame_id) == ("odom1", "base_link1")
    last = read(path, "/tf")[-1].content.transforms
    links = [(one.header.frame_id, one.child_frame_id) for one in last]
    chains = (("map", f"odom{i}", f"base_link{i}", f"Lidar{i}") for i in (0, 1))
    assert links == [link for chain in chains for link in zip(chain, chain[1:])]
    moved = last[4].transform
    assert messages.pose_from(moved.translation, moved.rotation) == state.map_from_base


def test_scans_are_the_lidar_s_to_the_bit(recorded):
    path, notes, *_ = recorded
    scans = [scan for robot, scan in notes.scans if robot == 0]
    found = read(path, "/scan0")
    assert len(found) == len(scans)
    for message, scan in zip(found, scans):
        assert message.content.ranges.tobytes() == scan.ranges_m.tobytes()
        assert message.stamp_ns == round(scan.stamp_s * 1e9) + 10**9
        assert message.content.header.frame_id == "Lidar0"


@pytest.mark.parametrize("name", ["global", "local"])
def test_costmaps_are_what_the_navigator_has_at_their_rate(recorded, name):
    """A full grid is all of it, an update the window that changed."""
    path, notes, *_ = recorded
    grids = {
        round(now_s * 1e9) + 10**9: grid
        for robot, which, now_s, grid in notes.windows
        if robot == 0 and which == name
    }
    topic = f"/move_base0/{name}_costmap/costmap"
    found = read(path, topic, f"{topic}_updates")
    assert found[0].topic == topic
    for message in found:
        content, part = message.content, grids[message.stamp_ns]
        if message.topic == topic:
            assert (content.info.height, content.info.width) == part.shape
        else:
            rows = slice(content.y, content.y + content.height)
            part = part[rows, content.x : content.x + content.width]
        assert content.data.tobytes() == part.tobytes()
    stamps = [message.stamp_ns for message in found[1:]]
    if name == "global":
        assert len(stamps) > 1 and np.diff(stamps).min() == 10**9  # publish_frequency 1.0


def test_goals_are_sent_accepted_and_ended_as_by_the_action_server(recorded):
    path = recorded[0]
    sent = read(path, "/move_base_simple/goal0")
    taken = read(path, "/move_base0/current_goal")
    assert [(one.content.pose.position.x, one.content.pose.position.y) for one in sent] == [
        (2.1, 1.9),
        (2.6, 2.3),
    ]
    assert [one.content for one in taken] == [one.content for one in sent]
    results = [one.content.status for one in read(path, "/move_base0/result")]
    assert [one.status for one in results[:1]] == [2]  # PREEMPTED: the next goal came before
    names = [one.content.status.goal_id.id for one in read(path, "/move_base0/feedback")]
    assert len(set(names)) == 2


def test_the_flight_is_described_and_shown(recorded):
    path, _, flight, _ = recorded
    first, last = [flight_info_from_message(one.content) for one in read(path, FLIGHT_TOPIC)]
    assert first == last
    assert (last.title, last.seed, last.config_name) == ("short", 0, "default")
    assert last.read_scene("it") == flight.trace.scene
    assert last.robots[0].goals == (Goal(2.1, 1.9), Goal(2.6, 2.3, 0.5))
    assert last.robots[1].parameters == flight.trace.robots[1].parameters
    (scene,) = read(path, "/simulation/scene")
    assert len(scene.content.markers) == 4 + len(flight.trace.scene.obstacles)
    (quadcopters,) = read(path, "/simulation/quadcopters")
    frames = {one.header.frame_id for one in quadcopters.content.markers}
    assert frames == {"base_link0", "base_link1"}
    goals = read(path, "/goals")[0].content.markers
    assert goals[0].action == 3  # DELETEALL
    assert [one.text for one in goals if one.text] == ["1", "2", "1"]


def test_chunks_are_compressed_as_ros_reads_them(recorded):
    """Independent blocks, a checksum of the content, no size: flags 0x64 of an LZ4 frame."""
    data = recorded[0].read_bytes()
    magic = b"\x04\x22\x4d\x18"
    flags = {data[at + 4] for at in range(len(data)) if data.startswith(magic, at)}
    assert flags == {0x64}


@pytest.mark.parametrize(
    "kind, digest",
    [
        ("tf2_msgs/TFMessage", "94810edda583a504dfda3829e70d7eec"),
        ("map_msgs/OccupancyGridUpdate", "b295be292b335c34718bd939deebe1c9"),
        ("move_base_msgs/RecoveryStatus", "a2488e0805e1529a31044786ee1a2623"),
        ("move_base_msgs/MoveBaseActionGoal", "660d6895a1b9a16dce51fbdd9a64a56b"),
        ("move_base_msgs/MoveBaseActionFeedback", "7d1870ff6e0decea702b943b5af0b42e"),
        ("move_base_msgs/MoveBaseActionResult", "1eb06eeff08fa7ea874431638cb52332"),
    ],
)
def test_added_definitions_have_the_sums_that_ros_knows_them_by(kind, digest):
    assert messages.definition(kind)[1] == digest


def test_paths_have_the_bytes_of_their_messages():
    stamp = 3_000_000_007
    for rows in ([], [[1.5, -2.0, 0.0], [4.0, 0.1, 0.0]]):
        poses = [messages.planar_pose(Pose2D(*row)) for row in rows]
        stamped = [messages.pose_stamped(pose, "odom0", stamp) for pose in poses]
        path = messages.message("nav_msgs/Path", messages.header("odom0", stamp), stamped)
        plan = np.array(rows).reshape(-1, 3)
        assert plan_bytes(plan, "odom0", stamp) == messages.encode(path)
        parts = map(messages.encode, stamped)
        assert path_bytes(parts, "odom0", stamp) == messages.encode(path)
    path = messages.decode(plan_bytes(np.array([[1.0, 2.0, -3.1]]), "map", 1), "nav_msgs/Path")
    turn = path.poses[0].pose.orientation
    assert (turn.z, turn.w) == pytest.approx((math.sin(-1.55), math.cos(-1.55)), abs=1e-15)
