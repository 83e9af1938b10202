"""The action of a navigator: goals, cancels and statuses, as ours and as those of C++ move_base."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

rospy = pytest.importorskip("rospy")

from actionlib_msgs.msg import GoalID, GoalStatus  # noqa: E402
from geometry_msgs.msg import Pose, PoseStamped  # noqa: E402
from move_base_msgs.msg import MoveBaseActionGoal  # noqa: E402
from ros.fake_ros import FakePublisher, FakeRos, deliver  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402
from upstream import UPSTREAM  # noqa: E402

from quad_nav import config  # noqa: E402
from quad_nav.geometry import Pose2D, Twist2D  # noqa: E402
from quad_nav.ros.common import conversions  # noqa: E402
from quad_nav.ros.navigator.nodes import Fleet  # noqa: E402
from quad_nav.topics.publishing import own_node  # noqa: E402

ROOT = Path(__file__).resolve().parents[3]
ACTIVE, PREEMPTED, ABORTED = GoalStatus.ACTIVE, GoalStatus.PREEMPTED, GoalStatus.ABORTED
PERIOD_S = 0.2


class Action:
    """A navigator without sensors whose clock and poses are the test's, and what it publishes."""

    def __init__(self, ros, tree):
        self._ros, self.now_s, self.sent = ros, 1.0, []
        loaded = config.load_files(ROOT / "config" / "default", {"i": "0"})
        loaded.update(robot=0, robots=1, controller_frequency=1.0 / PERIOD_S, **tree)
        for costmap in ("global_costmap", "local_costmap"):
            del loaded[costmap]["observation_sources"]
        self.robot = Fleet({0: config.load(loaded)}, lambda _: own_node).robots[0]
        self.wakes = 0
        self.robot.on_request(lambda: setattr(self, "wakes", self.wakes + 1))
        self.locate()
        self.step()

    def locate(self):
        stamp = rospy.Time.from_sec(self.now_s)
        pairs = (("map", "odom0", Pose2D(1.0, 0.0)), ("odom0", "base_link0", Pose2D(4.0, 5.0)))
        deliver("/tf", TFMessage([self._transform(*pair, stamp) for pair in pairs]))

    def _transform(self, parent, child, pose, stamp):
        return conversions.transform_message(pose.to_3d(), parent, child, stamp)

    def step(self):
        self.robot.step(self.now_s)

    def wait(self, seconds, locates=True):
        """Let time pass in control periods; odometry and transforms come at each."""
        for _ in range(round(seconds / PERIOD_S)):
            self.now_s += PERIOD_S
            self._ros.set_time(self.now_s)
            deliver("/odom", conversions.odometry_message(*_still(self.now_s)))
            if locates:
                self.locate()
            self.step()

    def goal(self, name, x_m=7.0, frame="map", stamp_s=None, quaternion=(0.0, 0.0, 0.0, 1.0)):
        goal = MoveBaseActionGoal(goal_id=GoalID(id=name))
        pose = Pose()
        pose.position.x, pose.position.y = x_m, 5.0
        for axis, part in zip("xyzw", quaternion):
            setattr(pose.orientation, axis, part)
        goal.goal.target_pose = PoseStamped(pose=pose)
        goal.goal.target_pose.header.frame_id = frame
        stamp = rospy.Time.from_sec(self.now_s if stamp_s is None else stamp_s)
        goal.goal.target_pose.header.stamp = stamp
        deliver("/move_base/goal", goal)
        self.step()

    def cancel(self, name=""):
        deliver("/move_base/cancel", GoalID(id=name))
        self.step()

    def statuses(self):
        listed = FakePublisher.all["/move_base/status"].last.status_list
        return {one.goal_id.id: one.status for one in listed}

    def of(self, topic):
        return [message for name, message in self.sent if name.endswith(topic)]


def _still(now_s):
    frames = ("odom0", "base_link0")
    stamp = rospy.Time.from_sec(now_s)
    return Pose2D(4.0, 5.0).to_3d(), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), frames, stamp


@pytest.fixture
def start(monkeypatch):
    with FakeRos("/move_base0") as ros:

        def started(tree):
            action = Action(ros, tree)
            publish = FakePublisher.publish

            def noted(self, *args, **kwds):
                publish(self, *args, **kwds)
                action.sent.append((self.resolved_name, self.last))

            monkeypatch.setattr(FakePublisher, "publish", noted)
            return action

        yield started


def test_a_goal_of_an_idle_robot_is_taken_at_once_and_the_next_one_preempts_it(start):
    action = start({})
    action.goal("a")
    assert action.wakes == 1 and action.statuses()["a"] == ACTIVE
    action.goal("b")
    action.wait(PERIOD_S)
    assert [one.status.status for one in action.of("/move_base/result")] == [PREEMPTED]


def test_the_last_goal_is_listed_until_five_seconds_after_the_next_one_has_replaced_it(start):
    action = start({})
    action.goal("a")
    action.wait(1.0)
    action.cancel()
    action.wait(20.0)
    assert action.statuses() == {"a": PREEMPTED}
    action.goal("b")
    action.wait(4.8)
    assert action.statuses() == {"a": PREEMPTED, "b": ACTIVE}
    action.wait(0.6)
    assert action.statuses() == {"b": ACTIVE}


def test_a_cancel_of_everything_lists_ended_goals_for_five_seconds_again(start):
    action = start({})
    for name in ("a", "b"):
        action.goal(name)
        action.wait(1.0)
    action.wait(3.0)
    action.cancel()
    action.wait(4.0)
    assert set(action.statuses()) == {"a", "b"}
    action.wait(2.0)
    assert set(action.statuses()) == {"b"}


def test_a_cancel_of_a_goal_that_has_not_come_stays_listed(start):
    action = start({})
    action.cancel("nobody")
    action.wait(20.0)
    assert action.statuses() == {"nobody": GoalStatus.RECALLING}
    action.goal("nobody")
    assert [one.status.status for one in action.of("/move_base/result")] == [GoalStatus.RECALLED]


def test_feedback_has_the_stamp_of_the_transform(start):
    action = start({})
    action.goal("a")
    action.wait(1.0)
    located_s = action.now_s
    action.wait(PERIOD_S, locates=False)
    feedback = action.of("/move_base/feedback")[-1].feedback.base_position
    assert feedback.header.stamp.to_sec() == pytest.approx(located_s)
    assert (feedback.pose.position.x, feedback.header.frame_id) == (5.0, "map")


@pytest.mark.parametrize("frame", ["", "nope", "/map"])
def test_upstream_tries_a_goal_in_another_frame_in_every_cycle(start, frame):
    action = start(UPSTREAM)
    action.goal("a", frame=frame)
    action.wait(6.0)  # longer than the planner's patience
    tried = action.of("/current_goal")
    assert len(tried) == 2 + 30
    assert {one.header.frame_id for one in tried} == {frame}
    assert action.statuses()["a"] == ACTIVE and action.of("/move_base/recovery_status") == []


def test_upstream_transforms_a_goal_when_the_transform_of_its_stamp_has_come(start):
    action = start(UPSTREAM)
    action.goal("a", frame="odom0", stamp_s=action.now_s + 0.3)
    action.wait(2.0)
    frames = [one.header.frame_id for one in action.of("/current_goal")]
    assert frames == ["odom0", "odom0", "odom0", "map"]
    at = action.of("/current_goal")[-1].pose
    assert (at.position.x, at.orientation.w) == (8.0, 1.0)
    assert action.robot.navigator.goal == Pose2D(8.0, 5.0)


def test_by_default_a_goal_is_transformed_or_aborted_at_once(start):
    action = start({})
    action.goal("a", frame="odom0", stamp_s=action.now_s + 0.3)
    [current] = action.of("/current_goal")
    assert (current.header.frame_id, current.pose.position.x) == ("map", 8.0)
    action.goal("b", frame="nope")
    action.wait(PERIOD_S)
    assert action.statuses() == {"a": PREEMPTED, "b": ABORTED}


@pytest.mark.parametrize("tree, ended", [({}, ABORTED), (UPSTREAM, ACTIVE)])
def test_upstream_searches_a_plan_to_a_position_that_is_not_a_number(start, tree, ended):
    action = start(tree)
    action.goal("a", x_m=math.nan)
    action.wait(1.0)
    assert action.statuses()["a"] == ended


@pytest.mark.parametrize("tree, stops", [({}, True), (UPSTREAM, False)])
def test_upstream_leaves_the_last_command_in_force_after_a_bad_quaternion(start, tree, stops):
    action = start(tree)
    action.goal("a")
    action.wait(1.0)
    assert action.robot.navigator.filters.last != Twist2D()
    before = len(action.of("/cmd_vel"))
    action.goal("b", quaternion=(0.0, 0.0, 0.0, 0.0))
    action.wait(PERIOD_S)
    assert action.statuses() == {"a": PREEMPTED, "b": ABORTED}
    commands = action.of("/cmd_vel")[before:]
    assert [one.linear.x for one in commands] == ([0.0] if stops else [])


def test_upstream_publishes_the_quaternion_of_the_rotation_matrix(start):
    action = start(UPSTREAM)
    turned = (0.0, 0.0, math.sin(math.radians(-75.0)), math.cos(math.radians(-75.0)))
    for name, given, expected in (
        ("negative", (0.0, 0.0, 0.0, -1.0), (0.0, 1.0)),
        ("by -150 degrees", turned, (-turned[2], -turned[3])),
    ):
        action.goal(name, quaternion=given)
        action.wait(PERIOD_S)
        turn = action.of("/current_goal")[-1].pose.orientation
        assert (turn.z, turn.w) == pytest.approx(expected)
