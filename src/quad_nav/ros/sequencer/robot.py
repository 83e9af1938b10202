"""Run one quadcopter of a mission: connect its sequencer to its topics, log and journal."""

from __future__ import annotations

import math
import threading
import time
from typing import Callable, Optional, Sequence

import rospy
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from quad_nav.errors import InputError
from quad_nav.geometry import Pose3D
from quad_nav.mission.flight_log import FlightLog, Leg
from quad_nav.mission.robot_goals import RobotGoals
from quad_nav.mission.sequencer import (
    START,
    Action,
    SendGoal,
    SequenceDone,
    SequenceProgress,
    Sequencer,
    Verdict,
)
from quad_nav.ros.common.conversions import pose_from_message
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.ros.sequencer.robot_link import Inbox, PathPublisher, RobotLink
from quad_nav.topics.flight_info import EVENTS_TOPIC, event, to_text

FILE_POLL_S = 0.5  # wall time, because users edit files while the simulation is paused
ODOMETRY_SILENT_S = 3.0
WARN_AGAIN_S = 5.0
# Accepted lead of odometry over our clock; a larger one dates from before a clock jump.
AHEAD_S = 1.0
# A step of odometry that no flight makes: the simulation was reset.
JUMP_M, JUMP_MPS = 1.0, 5.0
# A smaller step is a fault of the odometry, which may end soon.
STEP_M, JUMP_RECOVERY_S = 0.25, 1.0


# Writes a robot and the leg that has ended, if any, to the journal.
WriteJournal = Callable[["MissionRobot", Optional[Leg]], None]


class MissionRobot:
    """Fly one quadcopter's goals.

    Attributes:
        name: Name of the robot.
        sequencer: State of its goals.
        link: Its topics.
        pose: Last pose in `map`.
        is_silent: Whether odometry has timed out.
        silent_s: Time since the last odometry.
    """

    def __init__(
        self, index: int, goals: RobotGoals, transforms: Transforms, received: threading.Event
    ) -> None:
        """Connect to the topics of robot `index`; odometry sets the event."""
        self.name = goals.name
        self.sequencer = Sequencer(goals.sequence)
        self.link = RobotLink(index, received)
        self.pose: Optional[Pose3D] = None
        self.is_silent, self.silent_s = False, 0.0
        self._odometry: Optional[Odometry] = None
        self._start_s = 0.0
        self._odometry_s = self._valid_again_s = 0.0
        self._file = goals.file
        self._next_poll_s = 0.0
        self._transforms = transforms
        self._index = index
        self._events = rospy.Publisher(EVENTS_TOPIC, String, queue_size=100)
        self._path = PathPublisher(f"/path{index}")

    def begin(self, now_s: float, progress: SequenceProgress = START) -> None:
        """Begin with the first goal, or resume the progress of another sequencer."""
        self.sequencer = Sequencer(self.sequencer.sequence, progress)
        self.pose, self.is_silent, self._start_s, self._odometry_s = None, False, now_s, now_s
        self._odometry, self._valid_again_s = None, 0.0
        self.link.clear()
        self._path.clear()

    def was_reset(self, inbox: Inbox) -> bool:
        """Return whether odometry shows that the simulation was reset."""
        usable = [o for o in inbox.odometry if o.header.stamp.to_sec() >= self._start_s]
        before = [self._odometry, *usable] if self._odometry is not None else usable
        return any(_is_jump(a, b) for a, b in zip(before, before[1:]))

    def step(self, inbox: Inbox, now_s: float, log: FlightLog, write_journal: WriteJournal) -> bool:
        """Process the messages of a robot and act on them.

        Args:
            inbox: Messages since the last step.
            now_s: Present time on the clock.
            log: Log of the mission.
            write_journal: Called before an action is carried out.

        Returns:
            Whether the goals or their states have changed.
        """
        changed = self._poll_file()
        self._move(inbox.odometry, now_s, log)
        self._log_reports(inbox, log)
        self._serve_subscribers(inbox)
        self._watch_silence(now_s)
        if self.pose is None or self._valid_again_s > now_s:
            return changed
        actions = self.sequencer.tick(
            now_s, self.pose.to_2d(), inbox.reports, self.link.navigator_is_idle(now_s)
        )
        legs = [log.robots[self.name].add_action(action) for action in actions]
        if actions:
            write_journal(self, next((leg for leg in legs if leg is not None), None))
        for action, leg in zip(actions, legs):
            self._do(action, leg, now_s)
        return changed or bool(actions)

    def _log_reports(self, inbox: Inbox, log: FlightLog) -> None:
        for recovery in inbox.recoveries:
            log.robots[self.name].recoveries += 1
            rospy.logwarn(
                "%s: recovery %d of %d: %s",
                self.name,
                recovery.current_recovery_number + 1,
                recovery.total_number_of_recoveries,
                recovery.recovery_behavior_name,
            )
        log.robots[self.name].aborts += sum(
            report.verdict is Verdict.ABORTED for report in inbox.reports
        )

    def _serve_subscribers(self, inbox: Inbox) -> None:
        for subscriber in inbox.subscribers:
            if self.link.send_to(subscriber):
                rospy.loginfo(
                    "%s: %s sent to a new subscriber",
                    self.name,
                    self._goal(self.sequencer.index, self.sequencer.lap),
                )

    def map_from(self, frame: str, stamp_s: Optional[float] = None) -> Pose3D:
        """Return the pose of a frame in `map` at a time if tf knows it, else the latest.

        Raises:
            TransformUnavailable: If tf does not know it.
        """
        if frame == "map":
            return Pose3D(0.0, 0.0, 0.0)
        if stamp_s is None:
            return self._transforms.lookup("map", frame)
        return self._transforms.lookup_near("map", frame, stamp_s)

    def _move(self, messages: Sequence[Odometry], now_s: float, log: FlightLog) -> None:
        usable = [
            one for one in messages if self._start_s <= one.header.stamp.to_sec() <= now_s + AHEAD_S
        ]
        if not usable:
            return
        before, self._odometry = self._odometry, usable[-1]
        try:
            map_from_odom = [
                self.map_from(one.header.frame_id, one.header.stamp.to_sec()) for one in usable
            ]
        except TransformUnavailable as error:
            rospy.logwarn_throttle(
                WARN_AGAIN_S, f"{self.name}: pose in map unknown, odometry dropped: {error}"
            )
            return
        self._odometry_s = now_s
        if any(_is_jump(a, b, STEP_M) for a, b in zip([before, *usable], usable) if a is not None):
            rospy.logwarn(
                "%s: odometry jumped; no goal counts as reached for %g s",
                self.name,
                JUMP_RECOVERY_S,
            )
            self._valid_again_s = now_s + JUMP_RECOVERY_S
        for odometry, from_odom in zip(usable, map_from_odom):
            stamp_s = odometry.header.stamp.to_sec()
            self.pose = from_odom.compose(pose_from_message(odometry.pose.pose))
            log.add_pose(self.name, stamp_s, self.pose.to_2d())
            self._path.add(stamp_s, self.pose)

    def _watch_silence(self, now_s: float) -> None:
        self.silent_s = now_s - self._odometry_s
        was_silent, self.is_silent = self.is_silent, self.silent_s > ODOMETRY_SILENT_S
        if self.is_silent and not was_silent:
            rospy.logwarn(
                "%s: no message on %s for %.0f s; waiting for odometry",
                self.name,
                self.link.odometry.resolved_name,
                ODOMETRY_SILENT_S,
            )

    def _poll_file(self) -> bool:
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
        self.sequencer.replace_sequence(sequence)
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
        else:
            rospy.logwarn(
                "%s: %s SKIPPED after %.1f s: %s", self.name, goal, leg.time_s, leg.reason
            )

    def _goal(self, index: int, lap: int) -> str:
        sequence = self.sequencer.sequence
        round_ = f"lap {lap}, " if sequence.settings.loop else ""
        return f"{round_}goal {index + 1} of {len(sequence.goals)}"


def _is_jump(before: Odometry, after: Odometry, least_m: float = JUMP_M) -> bool:
    a, b = before.pose.pose.position, after.pose.pose.position
    distance_m = math.hypot(b.x - a.x, b.y - a.y)
    time_s = (after.header.stamp - before.header.stamp).to_sec()
    return distance_m > max(least_m, JUMP_MPS * time_s)
