"""Recordings: the index, and what a page shows of any time of a flight."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hand_made_recording import LAST_S, SCENE, write_flight, x_at

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.recording import messages
from quad_nav.recording.bag_file import read_messages
from quad_nav.recording.record_file import TopicWriter, create, stamp_at
from quad_nav.sim.flight import BodyState
from quad_nav.sim.motion import Motion
from quad_nav.sim.obstacles import Box
from quad_nav.sim.robot_state import RobotStates
from quad_nav.sim.scene import BODY_RADIUS_M, MovingObstacle
from quad_nav.topics.estimates import TRUTH_TOPIC
from quad_web.replay.recorded_flight import RecordedFlight
from quad_web.replay.recording_index import RecordingIndex
from quad_web.view.state import LAYERS


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write_flight(tmp_path_factory.mktemp("replay") / "flight.bag")


@pytest.fixture
def flight(path):
    flight = RecordedFlight(path)
    yield flight
    flight.close()


def items_at(flight: RecordedFlight, time_s: float, layers=LAYERS, robots=(0, 1)) -> dict:
    """Return the layers of both robots at a time, by key."""
    parts = flight.parts(time_s, dict.fromkeys(layers, robots))
    made = {key: make() for key, (_, make) in parts.items()}
    present = {item.key: item for item in flight.present_items(time_s)}
    return {**present, **{key: item for key, item in made.items() if item is not None}}


def costs_of(*cells) -> np.ndarray:
    costs = np.zeros((3, 4), np.int8)
    for second in cells:
        costs[second // 4 % 3, second % 4] = 100
    return costs


STREET = replace(
    SCENE,
    moving=(
        MovingObstacle(
            Box("cart", 1.0, 6.0, 1.0, 1.0, 2.0),
            Motion((0.0, 20.0), ((1.0, 6.0, 0.0), (5.0, 6.0, 0.0))),
        ),
    ),
)


@pytest.mark.parametrize(
    "cart_y_m, expected, nearest_m",
    [(None, (3.1, 6.0, 0.0), 2.0), (2.0, (10.0, 2.0, 0.0), 1.5)],
    ids=["computed from the scene", "recorded"],
)
def test_moving_obstacles_are_where_they_were(tmp_path, cart_y_m, expected, nearest_m):
    """At 10.5 s the cart, at 0.2 m/s, is 2.1 m on; its last message is of 10 s.

    Robot 1 is at (8, 2): 2 m from two walls, and 1.5 m from the cart that was recorded.
    """
    flight = RecordedFlight(write_flight(tmp_path / "flight.bag", STREET, cart_y_m))
    before, poses = items_at(flight, 2.0), items_at(flight, 10.5)["obstacles"].arrays["poses"]
    assert poses.tolist() == [pytest.approx(expected)]
    assert before["obstacles"].arrays["poses"][0, 0] < poses[0, 0]
    assert "obstacles" not in items_at(flight, 10.5)  # it stands
    clearance_m = flight.sample(10.5).arrays["values"][1, 1]
    assert clearance_m == pytest.approx(nearest_m - BODY_RADIUS_M)
    flight.close()


def test_the_index_reads_any_message_and_no_other(path):
    wanted = ("/scan0", "/move_base0/local_costmap/costmap_updates")
    index = RecordingIndex(path, lambda topic, kind: topic in wanted)
    assert set(index.kinds) == set(wanted)
    for topic in wanted:
        in_order = list(read_messages(path, lambda name, _, wanted=topic: name == wanted))
        times = index.times_ns(topic)
        assert times.tolist() == [one.stamp_ns for one in in_order]
        for number in (len(times) - 1, 0, 7, 8, 3):
            found, expected = index.read(topic, number), in_order[number]
            assert (found.stamp_ns, found.kind) == (expected.stamp_ns, expected.kind)
            assert messages.encode(found.content) == messages.encode(expected.content)
    index.close()


def test_damaged_and_truncated_files_get_the_messages_of_the_report(tmp_path):
    good = write_flight(tmp_path / "flight.bag").read_bytes()
    for name, content in {"empty": b"", "half": good[: len(good) // 2], "text": b"#!x\n"}.items():
        path = tmp_path / f"{name}.bag"
        path.write_bytes(content)
        texts = []
        for read in (
            lambda path: list(read_messages(path, lambda topic, kind: True)),
            lambda path: RecordingIndex(path, lambda topic, kind: True),
            RecordedFlight,
        ):
            with pytest.raises(InputError) as error:
                read(path)
            texts.append(str(error.value))
        assert len(set(texts)) == 1 and texts[0].startswith(str(path))


def test_poses_lie_between_the_samples(flight):
    assert (flight.start_s, flight.end_s) == (0.0, LAST_S)
    pose = items_at(flight, 7.05)["poses"].arrays["pose"]
    np.testing.assert_allclose(pose[0], [x_at(7.05), 2, 1, 0, 0, 0, 0.3, 0, 0], atol=1e-6)
    np.testing.assert_allclose(pose[1], [8, 2, 1, 0, 0, 0, 0, 0, 0], atol=1e-6)


def test_goals_have_their_state_at_the_time(flight):
    def states(time_s):
        goals = items_at(flight, time_s)["goals"].data["goals"]
        return [(goal["robot"], goal["x"], goal["state"]) for goal in goals]

    assert states(0.5) == [(0, 4.0, "pending"), (0, 7.0, "pending"), (1, 8.0, "pending")]
    assert states(5.0)[:2] == [(0, 4.0, "active"), (0, 7.0, "pending")]
    assert states(12.0)[:2] == [(0, 4.0, "reached"), (0, 7.0, "active")]


def test_rows_and_samples_are_those_of_the_time(flight):
    items = items_at(flight, 6.0)
    first, second = items["status"].data["rows"]
    assert (first["state"], first["goal"], first["goals"]) == ("flying", 1, 2)
    assert first["goal_distance"] == pytest.approx(4.0 - x_at(6.0))
    gap_m = 8.0 - x_at(6.0) - 2 * BODY_RADIUS_M
    assert first["gap_m"] == second["gap_m"] == pytest.approx(gap_m, abs=1e-5)
    gap, clearance, speed, cycle = items["samples"].arrays["values"][0]
    # The wall at y = 0 is 2 m away.
    assert (gap, clearance) == pytest.approx((gap_m, 2.0 - BODY_RADIUS_M), abs=1e-5)
    assert speed == pytest.approx(0.3) and math.isnan(cycle)
    late = items_at(flight, 18.0)["status"].data["rows"][1]
    assert late["state"] == "lost" and late["age_s"] == pytest.approx(3.0)


@pytest.mark.parametrize(
    "time_s, cells",
    [
        (0.0, ()),
        (3.5, (1, 2, 3)),
        (9.95, range(1, 10)),
        (10.0, ()),  # a full grid
        (13.0, (11, 12, 13)),
        (2.0, (1, 2)),
        (20.0, ()),
    ],
)
def test_a_costmap_is_the_last_full_grid_and_the_updates_since(flight, time_s, cells):
    for order in ((time_s,), (19.0, 4.0, time_s), (time_s, time_s)):
        for at_s in order:
            item = items_at(flight, at_s, ["local_costmap"])["local_costmap/0"]
        np.testing.assert_array_equal(item.arrays["costs"], costs_of(*cells))
    # The grid's corner is at (-1, -2) in odom0, which is at (0, 1) in map.
    assert (item.data["x"], item.data["y"], item.data["resolution_m"]) == (-1.0, -1.0, 0.5)


def test_a_costmap_without_time_goes_on_where_it_stopped(flight):
    parts = flight.parts(9.5, {"local_costmap": (0,)}, lambda: False)
    make = parts["local_costmap/0"][1]
    made = [make() for _ in range(9)]
    assert made[:8] == [None] * 8  # one update at a time
    np.testing.assert_array_equal(made[8].arrays["costs"], costs_of(*range(1, 10)))


def test_a_scan_is_shown_where_it_was_taken_and_until_it_is_old(flight):
    points = items_at(flight, 7.3, ["scan"])["scan/0"].arrays["points"]  # of 7.0 s
    x_m = x_at(7.0)
    np.testing.assert_allclose(points[:, :2], [[x_m + 1, 2], [x_m - 9.0, 2]], atol=1e-5)
    assert "scan/1" not in items_at(flight, 7.3, ["scan"])


def test_a_trail_ends_at_the_robot(flight):
    trail = items_at(flight, 10.0, ["trail"])["trail/0"].arrays["points"]
    assert trail[0].tolist() == [1.0, 2.0]
    assert x_at(10.0) - 0.13 <= trail[-1, 0] <= x_at(10.0) + 1e-6
    assert np.diff(trail[:, 0]).min() >= 0.1 - 1e-6


def write_localized(path, with_truth: bool):
    """Write 2 s of a robot at (1 m + 1 m/s * time, 2 m), which believes itself 0.3 m north."""
    topics = TopicWriter(create(path))

    def write(topic, stamp, content):
        topics.write(topic, stamp, content, "/node")

    for time_s in (0.0, 1.0, 2.0):
        stamp = stamp_at(time_s)
        frame = messages.transform(Pose3D(0.0, 0.3, 0.0), "map", "odom0", stamp)
        write("/tf", stamp, messages.message("tf2_msgs/TFMessage", [frame]))
        pose, frames = Pose3D(1.0 + time_s, 2.0, 1.0), ("odom0", "base_link0")
        write("/odom0", stamp, messages.odometry(pose, (1.0, 0.0, 0.0), (0.0,) * 3, frames, stamp))
        row = np.array([[*pose.translation, *pose.quaternion, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
        if with_truth:
            write(TRUTH_TOPIC, stamp, messages.true_states(RobotStates(BodyState(row)), stamp))
    estimate = Pose2D(2.0, 2.3), np.diag([0.01, 0.03, 0.0004])
    write("/slam_pose0", stamp_at(1.0), messages.pose_estimate(*estimate, stamp_at(1.0)))
    topics.close()
    return RecordedFlight(path)


@pytest.mark.parametrize("with_truth", [True, False])
def test_the_believed_pose_and_its_covariance_are_shown(tmp_path, with_truth):
    """Without the truth on its topic, the robot is shown where it believes itself."""
    flight = write_localized(tmp_path / "flight.bag", with_truth)
    try:
        before, then = (items_at(flight, time_s, ["localization"], (0,)) for time_s in (0.5, 1.5))
    finally:
        flight.close()
    assert np.isnan(before["localization/0"].arrays["pose"][3:]).all()
    shown = then["localization/0"].arrays["pose"]
    assert shown == pytest.approx([2.0, 2.3, 0.0, 0.01, 0.0, 0.03, 0.0004])
    y_m = float(then["poses"].arrays["pose"][0, 1])
    assert y_m == pytest.approx(2.0 if with_truth else 2.3)
    row = then["status"].data["rows"][0]["localization"]
    assert row["deviation_m"] == pytest.approx(0.2)
    assert row.get("error_m") == (pytest.approx(0.3) if with_truth else None)
