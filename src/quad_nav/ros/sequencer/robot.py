"""Fly one quadcopter's goals: connect its sequencer to its topics and to the flight record."""

from __future__ import annotations

import threading
import time
from typing import Iterable, List, Optional, Sequence

import rospy
from move_base_msgs.msg import RecoveryStatus
from std_msgs.msg import String

from quad_nav.errors import InputError
from quad_nav.geometry import Pose3D
from quad_nav.mission.flight_log import Leg
from quad_nav.mission.robot_goals import RobotGoals
from quad_nav.mission.sequencer import (
    START,
    Action,
    NavigatorReport,
    SendGoal,
    SequenceDone,
    SequenceProgress,
    Sequencer,
)
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.transforms import Transforms
from quad_nav.ros.sequencer.flight_record import FlightRecord
from quad_nav.ros.sequencer.odometry import LocatedPose, OdometryIntake
from quad_nav.ros.sequencer.robot_link import Inbox, PathPublisher, RobotLink
from quad_nav.topics.flight_info import EVENTS_TOPIC, event, to_text

FILE_POLL_S = 0.5  # wall time, because users edit files while the simulation is paused
MAX_NAME = 80  # characters of a recovery behaviour's name in the log


class MissionRobot:
    """Fly one quadcopter's goals, in a thread of its own.

    Attributes:
        name: Name of the robot.
        sequencer: State of its goals.
        link: Its topics.
        odometry: Its odometry.
        pose: Last pose in `map`.
        lock: Held during a step; whoever restarts the mission holds it.
        is_done: Whether all goals have ended and are in the log.
        clock_went_back: Whether a step has seen this; steps do nothing until `begin`.
    """

    def __init__(self, index: int, goals: RobotGoals, transforms: Transforms) -> None:
        """Connect to the topics of robot `index`."""
        self.name = goals.name
        self.sequencer = Sequencer(goals.sequence)
        self.link = RobotLink(index)
        self.odometry = OdometryIntake(self.name, self.link.odometry.resolved_name, transforms)
        self.pose: Optional[Pose3D] = None
        self.lock = threading.Lock()
        self.is_done = self.clock_went_back = False
        self._now_s = 0.0
        self._reports: List[NavigatorReport] = []  # for the next tick
        self._file = goals.file
        self._next_poll_s = 0.0
        self._index = index
        self._warnings = ThrottledWarnings()
        self._events = rospy.Publisher(EVENTS_TOPIC, String, queue_size=100)
        self._path = PathPublisher(f"/path{index}")

    def begin(self, now_s: float, progress: SequenceProgress = START) -> None:
        """Begin with the first goal, or resume the progress of another sequencer."""
        self.sequencer = Sequencer(self.sequencer.sequence, progress)
        self.pose, self._reports, self._now_s = None, [], now_s
        self.is_done = self.clock_went_back = False
        self.odometry.begin(now_s)
        self.link.clear()
        self._path.clear()

    def step(self, record: FlightRecord) -> bool:
        """Process the messages of the robot and act on them.

        Args:
            record: Record of the mission.

        Returns:
            Whether the goals or their states have changed.
        """
        now_s = rospy.get_time()
        if now_s < self._now_s:
            self.clock_went_back = True
        if self.clock_went_back:
            return False
        self._now_s, inbox = now_s, self.link.pop()
        located = self.odometry.take(inbox.odometry, now_s)
        self._log_recoveries(inbox.recoveries)
        record.add_flight(self.name, located, inbox.reports, len(inbox.recoveries))
        for one in located:
            self.pose = one.pose
            self._path.add(one.stamp_s, one.pose)
        self._serve_subscribers(inbox)
        self._reports += inbox.reports
        if self.pose is None or (self.odometry.is_jumping and not located):
            return False
        actions = self._tick(now_s, self.pose, located)
        legs = record.add_actions(self.name, self.sequencer, actions, now_s)
        for action, leg in zip(actions, legs):
            self._do(action, leg, now_s)
        self.is_done = self.sequencer.done
        return bool(actions)

    def _tick(self, now_s: float, pose: Pose3D, located: Sequence[LocatedPose]) -> List[Action]:
        """Pass the new poses to the sequencer until it acts.

        All of them, because a robot that turns has the goal's yaw only for a short time.
        """
        reports, self._reports = self._reports, []  # on the goal that an action ends
        idle = self.link.navigator_is_idle(now_s)
        for one in located[:-1]:
            actions = self.sequencer.tick(now_s, one.planar, (), idle)
            if actions:
                return actions
        return self.sequencer.tick(now_s, pose.to_2d(), reports, idle)

    def _log_recoveries(self, recoveries: Iterable[RecoveryStatus]) -> None:
        for recovery in recoveries:
            self._warnings.warn(
                f"{self.name}: recovery {recovery.current_recovery_number + 1} of"
                f" {recovery.total_number_of_recoveries}:"
                f" {recovery.recovery_behavior_name[:MAX_NAME]}"
            )

    def _serve_subscribers(self, inbox: Inbox) -> None:
        for subscriber in inbox.subscribers:
            if self.link.send_to(subscriber):
                rospy.loginfo(
                    "%s: %s sent to a new subscriber",
                    self.name,
                    self._goal(self.sequencer.index, self.sequencer.lap),
                )

    def poll_file(self) -> bool:
        """Follow the goal file if it has been edited; return whether it has.

        This takes the lock only to replace the goals: reading a file may take long.
        """
        if time.monotonic() < self._next_poll_s:
            return False
        self._next_poll_s = time.monotonic() + FILE_POLL_S
        try:
            sequence = self._file.poll()
        except InputError as error:
            rospy.logerr(
                "%s: edited goal file is not valid, keeping the previous goals:\n  %s",
                self.name,
                "\n  ".join(error.problems),
            )
            return False
        if sequence is None:
            return False
        with self.lock:
            self.sequencer.replace_sequence(sequence)
            self.is_done = False
        rospy.loginfo(
            "%s: goal file reloaded: %d goals, %d of them flown",
            self.name,
            len(sequence.goals),
            min(self.sequencer.index, len(sequence.goals)),
        )
        return True

    def _do(self, action: Action, leg: Optional[Leg], now_s: float) -> None:
        self._events.publish(to_text(event(self._index, now_s, action)))
        if isinstance(action, SendGoal):
            self.link.send(action.pose)
            self._log_sent(action)
        elif isinstance(action, SequenceDone):
            self.link.clear()
            rospy.loginfo("%s: all goals flown", self.name)
        elif leg is not None:
            self._log_ended(leg)

    def _log_sent(self, action: SendGoal) -> None:
        goal = self._goal(action.index, action.lap)
        if not action.resend_reason:
            away_m = self.pose.to_2d().distance_to(action.pose) if self.pose else 0.0
            rospy.loginfo(
                "%s: %s sent: (%.2f, %.2f) m, %.2f m away",
                self.name,
                goal,
                action.pose.x_m,
                action.pose.y_m,
                away_m,
            )
            return
        rospy.logwarn(
            "%s: %s sent again (attempt %d of %d): %s",
            self.name,
            goal,
            action.attempt,
            self.sequencer.sequence.settings.retries + 1,
            action.resend_reason,
        )

    def _log_ended(self, leg: Leg) -> None:
        goal = self._goal(leg.index, leg.lap)
        if leg.reached:
            rospy.loginfo(
                "%s: %s reached in %.1f s, path %.2f m (straight %.2f m)",
                self.name,
                goal,
                leg.time_s,
                leg.path_length_m,
                leg.straight_length_m,
            )
            if leg.yaw_error_rad is not None:
                rospy.loginfo("%s: %s yaw error %.2f rad", self.name, goal, leg.yaw_error_rad)
            if leg.goal.wait_s > 0.0:
                rospy.loginfo("%s: %s staying for %g s", self.name, goal, leg.goal.wait_s)
        else:
            rospy.logwarn(
                "%s: %s SKIPPED after %.1f s: %s", self.name, goal, leg.time_s, leg.reason
            )

    def _goal(self, index: int, lap: int) -> str:
        sequence = self.sequencer.sequence
        round_ = f"lap {lap}, " if sequence.settings.loop else ""
        return f"{round_}goal {index + 1} of {len(sequence.goals)}"
