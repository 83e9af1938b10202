"""The sequencer hears all robots in one message, and takes every pose of a robot in one step."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

rospy = pytest.importorskip("rospy")

from ros.fake_ros import FakeRos, deliver, subscribed  # noqa: E402

from quad_nav.geometry import Pose3D, quaternion_from_yaw  # noqa: E402
from quad_nav.ros.common import conversions  # noqa: E402
from quad_nav.ros.common.packed_messages import (  # noqa: E402
    STATES_TOPIC,
    States,
    pose_row,
    states_message,
)
from quad_nav.ros.common.transforms import TransformUnavailable  # noqa: E402
from quad_nav.ros.sequencer.mission import MissionRunner  # noqa: E402
from quad_nav.ros.sequencer.odometry import OdometryIntake, Track  # noqa: E402
from quad_nav.ros.sequencer.state_feed import StateFeed  # noqa: E402
from quad_nav.ros.sequencer.truth import TruthTopic  # noqa: E402
from quad_nav.scenario.mission_setup import read_setup  # noqa: E402
from quad_nav.topics.estimates import TRUTH_TOPIC  # noqa: E402


@pytest.fixture
def ros():
    with FakeRos("/sequencer") as fake:
        yield fake


def at(x_m, y_m=0.0, yaw_rad=0.0):
    return pose_row(Pose3D(x_m, y_m, 1.0, quaternion_from_yaw(yaw_rad)))


def states(poses, frame="map"):
    """States of robots 0, 1, ... at the present time."""
    count = len(poses)
    return states_message(
        States(rospy.get_time(), frame, np.arange(count), np.array(poses), np.zeros((count, 6)))
    )


def intake(ros):
    found = OdometryIntake("quad0", "/odom0", lambda: pytest.fail("tf is not needed"))
    found.begin(1.0)
    return found


def test_states_wake_robots_at_their_goals_and_those_that_are_due(ros):
    feed = StateFeed(4)
    assert not [name for name in subscribed() if name.startswith(("/odom", "/tf"))]
    feed.links[0].wake[:] = (5.0, 0.0, 0.3, 100.0)
    feed.links[1].wake[:] = (5.0, 0.0, 0.3, 100.0)
    feed.links[2].wake[:] = (0.0, 0.0, -1.0, 2.5)
    feed.links[3].wake[:] = (0.0, 0.0, -1.0, 2.6)
    ros.set_time(2.5)
    deliver(STATES_TOPIC, states([at(4.75), at(4.65), at(0.0), at(0.0)]))
    assert [link.received.is_set() for link in feed.links] == [True, False, True, False]
    for link, x_m in zip(feed.links, (4.75, 4.65, 0.0, 0.0)):
        ((stamp_s, pose),) = link.pop().states
        assert (stamp_s, pose[0]) == (2.5, x_m)
        assert link.pose_frame == "map"


def test_states_in_another_frame_are_not_used(ros):
    feed = StateFeed(1)
    deliver(STATES_TOPIC, states([at(1.0)], frame="odom0"))
    assert not feed.links[0].pop().states
    assert feed.links[0].pose_frame is None


def test_poses_of_states(ros):
    odometry = intake(ros)
    timed = [(0.9, at(9.0)), (1.0, at(0.0)), (1.025, at(0.02, 0.01, 0.5))]
    track = odometry.take(timed, (), 1.1)
    assert track.stamps_s.tolist() == [1.0, 1.025]  # the first is from before the start
    assert track.poses == pytest.approx(np.array([[0, 0, 1, 0], [0.02, 0.01, 1, 0.5]]))
    assert not track.relocated.any()
    assert len(odometry.take((), (), 1.2).stamps_s) == 0
    odometry.take((), (), 4.2)
    assert odometry.is_silent
    assert any("no valid message on /odom0 for 3 s" in line for line in ros.log.lines)


def test_a_jump_in_the_states_is_dropped_until_it_lasts(ros):
    odometry = intake(ros)
    track = odometry.take([(1.0, at(0.0)), (1.025, at(50.0)), (1.05, at(0.01))], (), 1.1)
    assert track.stamps_s.tolist() == [1.0, 1.05]
    assert any("/quad/states: message dropped: position (50.00" in line for line in ros.log.lines)
    timed = [(1.1 + 0.1 * k, at(7.0)) for k in range(12)]
    track = odometry.take(timed, (), 2.3)
    assert track.stamps_s.tolist() == pytest.approx([2.1, 2.2])
    assert track.relocated.tolist() == [True, False]


def test_an_unknown_frame_is_a_warning_once_it_has_lasted_for_a_second(ros):
    def unknown():
        raise TransformUnavailable("no tf")

    odometry = OdometryIntake("quad0", "/odom0", unknown)
    odometry.begin(1.0)
    message = conversions.odometry_message(
        Pose3D(0.0, 0.0, 1.0), (0, 0, 0), (0, 0, 0), ("odom0", "base_link0"), rospy.Time(1)
    )
    ros.set_time(2.1)
    assert len(odometry.take((), [message], 1.9).stamps_s) == 0
    assert not ros.log.lines
    assert len(odometry.take((), [message], 2.1).stamps_s) == 0
    (line,) = ros.log.lines
    assert "quad0: pose in map unknown, odometry in 'odom0' dropped: no tf" in line


def test_a_robot_goes_on_when_its_poses_come_from_another_topic(ros):
    odometry = intake(ros)
    odometry.take([(1.0, at(3.0))], (), 1.0)
    message = conversions.odometry_message(
        Pose3D(3.01, 0.0, 1.0), (0, 0, 0), (0, 0, 0), ("map", "base_link0"), rospy.Time(1, 10**8)
    )
    track = odometry.take((), [message], 1.1)
    assert track.poses[:, 0].tolist() == [3.01]
    assert not odometry.is_jumping and not track.relocated.any()
    assert odometry.take([(1.2, at(3.02))], (), 1.2).poses[:, 0].tolist() == [3.02]


def test_errors_are_those_at_the_stamps_of_the_truth(ros):
    """Robot 1 believes to be 0.3 m east and 0.4 m north of where it is, and turned by 0.2 rad."""
    truth = TruthTopic()
    assert truth.facts == {}
    for stamp_s in (1.0, 1.025, 1.05):
        ros.set_time(stamp_s)
        deliver(TRUTH_TOPIC, states([at(9.0), at(stamp_s, 2.0, 3.1)]))
    believed = np.array([(1.3, 2.4, 1.0, 3.3 - 2.0 * math.pi), (1.325, 2.4, 1.0, 2.9)])
    stamps_s = np.array([1.0, 1.025, 1.075])
    poses = np.vstack([believed, (50.0, 50.0, 1.0, 0.0)])  # of the last stamp there is no truth
    truth.compare(1, Track(stamps_s, poses, np.zeros(3, bool)))
    truth.compare(2, Track(stamps_s, poses, np.zeros(3, bool)))
    figures = truth.facts["localization"]
    assert figures["position_error_m"] == {"median": 0.5, "p95": 0.5}
    assert figures["yaw_error_rad"] == {"median": 0.2, "p95": 0.2}
    truth.forget()
    assert truth.facts == {}


def test_a_truth_that_is_not_valid_is_dropped(ros):
    truth = TruthTopic()
    deliver(TRUTH_TOPIC, states([at(1.0)], frame="odom0"))
    assert any("/quad/truth: message dropped: frame 'odom0'" in line for line in ros.log.lines)
    deliver(TRUTH_TOPIC, states([at(math.nan)]))
    truth.compare(0, Track(np.array([rospy.get_time()]), np.zeros((1, 4)), np.zeros(1, bool)))
    assert truth.facts == {}


def test_a_goal_with_a_yaw_is_reached_between_two_steps(ros, tmp_path):
    for k in range(2):
        goals = {"goals": [[2.0, float(k), 1.5], [9.0, float(k)]], "yaw_tolerance": 0.05}
        (tmp_path / f"quad{k}_goals.json").write_text(json.dumps(goals))
    setup = read_setup(
        {"goals": str(tmp_path), "robots": 2, "journal": str(tmp_path / "journal")},
        "sequencer",
        tmp_path / "result.json",
        tmp_path,
    )
    mission = MissionRunner(setup)
    mission._begin(1.0)
    for step in range(60):  # both turn by 3 rad at the goal; robot 1 not quite in the right place
        ros.set_time(1.0 + 0.025 * step)
        yaw_rad = 0.05 * step
        deliver(STATES_TOPIC, states([at(2.0, 0.0, yaw_rad), at(2.0, 2.0, yaw_rad)]))
        if step == 0:
            for thread in mission._threads:
                thread._step()
    for thread in mission._threads:
        thread._step()
    first, second = mission.robots
    assert [first.sequencer.index, second.sequencer.index] == [1, 0]
    (leg,) = mission._record.log.robots["quad0"].legs
    assert leg.reached and abs(leg.yaw_error_rad) <= 0.05
    assert first.link.wake[:2].tolist() == [9.0, 0.0]
    assert math.isclose(first.pose.to_2d().yaw_rad, 2.95)
