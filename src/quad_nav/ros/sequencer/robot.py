"""Fly one quadcopter's goals: connect its sequencer to its topics and to the flight record."""

from __future__ import annotations

import threading
import time
from typing import Iterable, List, Optional

import numpy as np
import rospy
from move_base_msgs.msg import RecoveryStatus
from numpy.typing import NDArray
from quad.msg import MissionEvent

from quad_nav.config import Configuration
from quad_nav.errors import InputError, assert_never
from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.mission.actions import Action, GoalEnded, SendGoal, SequenceDone
from quad_nav.mission.flight_log import Leg
from quad_nav.mission.progress import START, SequenceProgress
from quad_nav.mission.robot_goals import RobotGoals
from quad_nav.mission.sequencer import NavigatorReport, Sequencer
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.nav_messages import planar_pose
from quad_nav.ros.common.own_messages import stamped
from quad_nav.ros.sequencer.flight_record import FlightRecord
from quad_nav.ros.sequencer.odometry import OdometryIntake
from quad_nav.ros.sequencer.robot_link import Inbox, PathPublisher
from quad_nav.ros.sequencer.state_feed import StateFeed
from quad_nav.scenario.goal_checks import file_warnings
from quad_nav.topics.mission_events import EVENTS_TOPIC, mission_event

FILE_POLL_S = 0.5  # wall time, because users edit files while the simulation is paused
STEPS_PER_S = 100.0  # of all robots together, without anything that a step should not wait with
MIN_PERIOD_S, MAX_PERIOD_S = 0.1, 0.5
_ROUNDING_M = 1e-6
MAX_NAME = 80  # characters of a recovery behaviour's name in the log


class MissionRobot:
    """Fly one quadcopter's goals, in a thread of its own.

    Attributes:
        name: Name of the robot.
        sequencer: State of its goals.
        link: Its topics.
        odometry: Its odometry.
        pose: Last pose in `map`.
        now_s: Time on the clock at the last step.
        lock: Held during a step; whoever restarts the mission holds it.
        is_done: Whether all goals have ended and are in the log.
        clock_went_back: Whether a step has seen this; steps do nothing until `begin`.
        is_stopped: Whether the mission is stopped on request; steps send no goals.
    """

    def __init__(
        self,
        index: int,
        goals: RobotGoals,
        feed: StateFeed,
        configuration: Optional[Configuration],
    ) -> None:
        """Connect the goals of robot `index` to its topics.

        Args:
            index: Number of the robot.
            goals: Its goals.
            feed: Poses of all robots.
            configuration: That of its navigator, None if unknown.
        """
        self.name = goals.name
        self.sequencer = Sequencer(goals.sequence)
        self.link = feed.links[index]
        self.odometry = OdometryIntake(self.name, self.link.odometry_topic, feed.transforms)
        self._period_s = min(max(MIN_PERIOD_S, len(feed.links) / STEPS_PER_S), MAX_PERIOD_S)
        self.pose: Optional[Pose3D] = None
        self.lock = threading.Lock()
        self.is_done = self.clock_went_back = self.is_stopped = False
        self.now_s = 0.0
        self._is_recorded = True  # whether the journal says whether the mission is stopped
        self._reports: List[NavigatorReport] = []  # for the next tick
        self._file, self._configuration = goals.file, configuration
        self._next_poll_s = 0.0
        self._index = index
        self._warnings = ThrottledWarnings()
        self._events = rospy.Publisher(EVENTS_TOPIC, MissionEvent, queue_size=100)
        self._path = PathPublisher(f"/path{index}")

    def begin(self, now_s: float, progress: SequenceProgress = START) -> None:
        """Begin with the first goal, or resume the progress of another sequencer."""
        self.sequencer = Sequencer(self.sequencer.sequence, progress)
        self._is_recorded = progress.held_s is None and not self.is_stopped
        (self.sequencer.hold if self.is_stopped else self.sequencer.release)(now_s)
        self.pose, self._reports, self.now_s = None, [], now_s
        self.is_done = self.clock_went_back = False
        self.odometry.begin(now_s)
        self.link.clear()
        self._path.clear()

    def hold(self, now_s: float) -> None:
        """Stop the mission: forget the goal that was sent last; `is_stopped` has been set."""
        if self.sequencer.held_s is None:
            self.sequencer.hold(max(now_s, self.now_s))  # the clock may have gone back
            self._is_recorded = False
            self.link.clear()
            self.link.received.set()

    def release(self, now_s: float) -> None:
        """Resume a stopped mission: send the goal again, as if no time had passed."""
        if self.is_stopped:
            self.hold(now_s)  # in case the stop has not got as far
            self.is_stopped = False
            self.sequencer.release(max(now_s, self.now_s))
            self._is_recorded = False
            self.link.received.set()

    def step(self, record: FlightRecord) -> bool:
        """Process the messages of the robot and act on them.

        Args:
            record: Record of the mission.

        Returns:
            Whether the goals or their states have changed.
        """
        now_s = rospy.get_time()
        if now_s < self.now_s:
            self.clock_went_back = True
        if self.clock_went_back:
            return False
        self.now_s, inbox = now_s, self.link.pop()
        if self.is_stopped:
            self.hold(now_s)  # in case the stop has found the step before in progress
            for goal_id in inbox.unfinished:  # the stop's cancel may have overtaken a goal
                self.link.cancels.publish(goal_id)
        if not self._is_recorded:
            record.add_progress(self.name, self.sequencer, now_s)
            self._is_recorded = True
        track = self.odometry.take(inbox.states, inbox.odometry, now_s)
        self._log_recoveries(inbox.recoveries)
        record.add_flight(self.name, track, inbox.reports, len(inbox.recoveries))
        if len(track.stamps_s):
            x_m, y_m, z_m, yaw_rad = track.poses[-1].tolist()
            self.pose = planar_pose(Pose2D(x_m, y_m, yaw_rad), z_m)
            self._path.add(track)
        self._serve_subscribers(inbox)
        self._reports += inbox.reports
        if self.pose is None or (self.odometry.is_jumping and not len(track.stamps_s)):
            return False
        actions = self._tick(now_s, self.pose.to_2d(), track.planar)
        self._set_wake(now_s)
        legs = record.add_actions(self.name, self.sequencer, actions, now_s)
        for action, leg in zip(actions, legs):
            self._do(action, leg, now_s)
        self.is_done = self.sequencer.done
        return bool(actions)

    def _tick(self, now_s: float, pose: Pose2D, poses: NDArray[np.float64]) -> List[Action]:
        """Pass new poses float64[n, 3] to the sequencer until it acts.

        All at the goal, because a robot that turns has the goal's yaw only for a short time. The
        others end no goal.
        """
        reports, self._reports = self._reports, []  # on the goal that an action ends
        idle = self.link.navigator_is_idle(now_s)
        active = self.sequencer.active_goal
        if active is not None and len(poses):
            offsets_m = poses[:, :2] - (active.goal.x_m, active.goal.y_m)
            near_m = self.sequencer.sequence.tolerance_m(active.goal) + _ROUNDING_M
            poses = poses[np.hypot(offsets_m[:, 0], offsets_m[:, 1]) <= near_m]
        for row in poses.tolist():
            actions = self.sequencer.tick(now_s, Pose2D(*row), (), idle)
            if actions:
                return actions
        return self.sequencer.tick(now_s, pose, reports, idle)

    def _set_wake(self, now_s: float) -> None:
        """Let states wake the thread at the goal, and when the next step is due."""
        active, dwell = self.sequencer.active_goal, self.sequencer.dwell
        at_s = now_s + self._period_s
        if dwell is not None:
            at_s = min(at_s, dwell.until_s)
        if active is None:
            self.link.wake[:] = (0.0, 0.0, -1.0, at_s)
        else:
            near_m = self.sequencer.sequence.tolerance_m(active.goal) + _ROUNDING_M
            self.link.wake[:] = (active.goal.x_m, active.goal.y_m, near_m, at_s)

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
                goal = self._goal(self.sequencer.index, self.sequencer.lap)
                rospy.loginfo(f"{goal} sent to a new subscriber")

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
                "%s: edited goal file is not valid, keeping the previous goals:\n%s",
                self.name,
                error,
            )
            return False
        if sequence is None:
            return False
        with self.lock:
            self.sequencer.replace_sequence(sequence)
            self.is_done = False
        goals = RobotGoals(self.name, self._file, sequence)
        for warning in file_warnings([goals], [self._configuration]):
            rospy.logwarn("%s", warning)
        count = len(sequence.goals)
        flown = min(self.sequencer.index, count)
        rospy.loginfo(f"{self.name}: goal file reloaded: {count} goals, {flown} of them flown")
        return True

    def _do(self, action: Action, leg: Optional[Leg], now_s: float) -> None:
        if isinstance(action, SendGoal) and self.is_stopped:
            return  # stopped during this step; the resumption sends the goal
        event = mission_event(self._index, now_s, action)
        self._events.publish(stamped(MissionEvent, event.fields, now_s))
        if isinstance(action, SendGoal):
            self.link.send(action.pose)
            self._log_sent(action)
        elif isinstance(action, GoalEnded):
            if leg is not None:
                self._log_ended(leg)
        elif isinstance(action, SequenceDone):
            self.link.clear()
            rospy.loginfo("%s: all goals flown", self.name)
        else:
            assert_never(action)

    def _log_sent(self, action: SendGoal) -> None:
        goal = self._goal(action.index, action.lap)
        if not action.resend_reason:
            away_m = self.pose.to_2d().distance_to(action.pose) if self.pose else 0.0
            place = f"({action.pose.x_m:.2f}, {action.pose.y_m:.2f}) m, {away_m:.2f} m away"
            rospy.loginfo(f"{goal} sent: {place}")
            return
        attempts = self.sequencer.sequence.settings.retries + 1
        again = f"{goal} sent again (attempt {action.attempt} of {attempts})"
        rospy.logwarn("%s: %s", again, action.resend_reason)

    def _log_ended(self, leg: Leg) -> None:
        goal = self._goal(leg.index, leg.lap)
        if leg.reached:
            rospy.loginfo(
                f"{goal} reached in {leg.time_s:.1f} s, path {leg.path_length_m:.2f} m"
                f" (straight {leg.straight_length_m:.2f} m)"
            )
            if leg.yaw_error_rad is not None:
                rospy.loginfo(f"{goal} yaw error {leg.yaw_error_rad:.2f} rad")
            if leg.goal.wait_s > 0.0:
                rospy.loginfo(f"{goal} staying for {leg.goal.wait_s:g} s")
        else:
            rospy.logwarn("%s SKIPPED after %.1f s: %s", goal, leg.time_s, leg.reason)

    def _goal(self, index: int, lap: int) -> str:
        sequence = self.sequencer.sequence
        round_ = f"lap {lap}, " if sequence.settings.loop else ""
        return f"{self.name}: {round_}goal {index + 1} of {len(sequence.goals)}"
