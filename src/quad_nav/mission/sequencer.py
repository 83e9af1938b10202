"""State machine that flies one robot's goals in order, without ROS and without a clock.

A goal is reached when the robot's odometry is within the tolerance of it, and, if it has a yaw,
within the tolerance of that. What the navigator reports only decides when to send the goal again.

    send -> flying -> reached -> dwell (wait_s) -> next goal, or done
              |
              +-> aborted, timed out, reported as reached elsewhere
              |       -> send again while retries remain -> skipped -> next
              +-> cancelled by another node -> skipped -> next
              +-> lost by the navigator (restart), or replaced by another node's goal
                  that has ended -> send again, not counted as an attempt
"""

from __future__ import annotations

import dataclasses
import enum
import math
from dataclasses import dataclass
from typing import List, Optional, Sequence

from quad_nav.geometry import Pose2D
from quad_nav.mission.actions import Action, GoalEnded, SendGoal, SequenceDone
from quad_nav.mission.goal import Goal
from quad_nav.mission.goal_file import GoalSequence
from quad_nav.mission.progress import START, ActiveGoal, Dwell, SequenceProgress

GOAL_LOST_AFTER_S = 5.0
"""A navigator that is idle for so long has lost the goal: it restarted, or was not ready."""
SETTLE_S = 1.0
"""A robot may still turn, and odometry lag, for so long after the navigator's success."""


class Verdict(enum.Enum):
    """Result that the navigator reports for a goal."""

    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    CANCELLED = "cancelled"
    REPLACED = "replaced by another node's goal"
    OTHER_ENDED = "another node's goal has ended"


_ENDED = (Verdict.SUCCEEDED, Verdict.ABORTED, Verdict.OTHER_ENDED)


@dataclass(frozen=True)
class NavigatorReport:
    """Result that the navigator reports for the goal that was sent last, with its text."""

    verdict: Verdict
    text: str = ""


class Sequencer:
    """Decides which goal to send next, and when to send, retry or skip it.

    ``progress`` is the snapshot of an earlier sequencer to resume from. Its active goal is sent
    again for ``resume_reason`` without counting an attempt, unless the robot has reached it
    meanwhile.
    """

    def __init__(
        self,
        sequence: GoalSequence,
        progress: SequenceProgress = START,
        resume_reason: str = "the sequencer or the clock restarted",
    ) -> None:
        self._sequence = sequence
        self._done = False
        self._resume(progress, resume_reason)
        self._adopt_goals()

    def _resume(self, progress: SequenceProgress, reason: str) -> None:
        self._index, self._lap, self._active = progress.index, progress.lap, progress.active_goal
        self._dwell, self._held_s = progress.dwell, progress.held_s
        self._is_resumed = progress.active_goal is not None
        self._resume_reason = reason
        self._busy_s = 0.0  # the last time at which the navigator was not known to be idle
        self._stopped_s: Optional[float] = None  # since when it reports the goal as reached

    @property
    def sequence(self) -> GoalSequence:
        """The goals and their settings."""
        return self._sequence

    @property
    def index(self) -> int:
        """Index of the active or next goal; the number of goals when done."""
        return self._index

    @property
    def lap(self) -> int:
        """Round through the goals, 1 for the first."""
        return self._lap

    @property
    def active_goal(self) -> Optional[ActiveGoal]:
        """The goal that the robot flies to; None before the first, after the last, in a dwell."""
        return self._active

    @property
    def dwell(self) -> Optional[Dwell]:
        """The stay at the goal that was reached last; None if it has ended or there is none."""
        return self._dwell

    @property
    def progress(self) -> SequenceProgress:
        """Snapshot that another sequencer can resume from."""
        return SequenceProgress(self._index, self._lap, self._active, self._dwell, self._held_s)

    @property
    def held_s(self) -> Optional[float]:
        """Time at which the mission was stopped; None if it is not stopped."""
        return self._held_s

    @property
    def done(self) -> bool:
        """True when all goals have ended."""
        return self._done

    @property
    def has_goals_left(self) -> bool:
        """False when nothing is left but to say that all goals have ended."""
        is_between = self._active is None and self._dwell is None
        is_behind_last = self._index >= len(self._sequence.goals)
        return not is_between or not is_behind_last or self._sequence.settings.loop

    def due_s(self, navigator_idle: bool) -> float:
        """Return the time before which ``tick`` returns no action.

        That holds while the robot is not within the tolerance of its goal, the navigator reports
        nothing and stays idle or busy as it is, and nothing else changes the sequencer.
        """
        if self._done:
            return math.inf
        if self._dwell is not None:
            return self._dwell.until_s
        if self._active is None or self._is_resumed or self._stopped_s is not None:
            return -math.inf
        timeout_s = self._active.sent_s + self._sequence.settings.goal_timeout_s
        return min(timeout_s, self._busy_s + GOAL_LOST_AFTER_S) if navigator_idle else timeout_s

    def note_busy(self, now_s: float) -> None:
        """Know that the navigator has had a goal until now, without a tick."""
        self._busy_s = now_s

    def hold(self, now_s: float) -> None:
        """Stop the mission: no goal is sent and no time counts until ``release``."""
        if self._held_s is None:
            self._held_s = now_s

    def release(self, now_s: float) -> None:
        """Resume a stopped mission as if no time had passed; its active goal is sent again."""
        if self._held_s is None:
            return
        progress = self.progress.shifted(now_s - self._held_s)
        self._resume(
            dataclasses.replace(progress, held_s=None), "the mission was stopped and resumed"
        )

    def replace_sequence(self, sequence: GoalSequence) -> None:
        """Follow an edited goal file from the next tick on.

        Goals before the present index stay ended. The active goal stays active if the new list
        has the same pose at its index; its other settings apply from now on. So does the
        ``wait_s`` of the goal at which the robot stays.
        """
        self._sequence = sequence
        self._done = False
        self._adopt_goals()

    def _adopt_goals(self) -> None:
        """Take the settings of the active goal and of the dwell's from the sequence."""
        goals = dict(enumerate(self._sequence.goals))
        if self._active is not None:
            goal = goals.get(self._index)
            if goal is None or not goal.is_same_pose(self._active.goal):
                self._active = None
            else:
                self._active = dataclasses.replace(self._active, goal=goal)
        if self._dwell is not None:
            goal = goals.get(self._index - 1)
            if goal is not None and goal.is_same_pose(self._dwell.goal):
                self._dwell = dataclasses.replace(self._dwell, goal=goal)

    def tick(
        self,
        now_s: float,
        pose: Pose2D,
        reports: Sequence[NavigatorReport] = (),
        navigator_idle: bool = False,
    ) -> List[Action]:
        """Return the actions that are due now, in order.

        Args:
            now_s: Present time.
            pose: The robot's pose in ``map``.
            reports: What the navigator has reported on the last sent goal since the last tick.
            navigator_idle: True if the navigator runs and has no goal.
        """
        if self._done or (self._held_s is not None and self.has_goals_left):
            return []
        if self._dwell is not None:
            if now_s < self._dwell.until_s:
                return []
            self._dwell = None
        if self._active is None:
            return self._start_next(now_s, pose)
        if not navigator_idle:
            self._busy_s = now_s
        if self._is_resumed:
            reports = ()  # on the goal that was sent before, such as that a stop has cancelled it
        if any(report.verdict is Verdict.REPLACED for report in reports):
            self._active = dataclasses.replace(self._active, replaced=True)
        return self._check_active(self._active, now_s, pose, reports)

    def _check_active(
        self, active: ActiveGoal, now_s: float, pose: Pose2D, reports: Sequence[NavigatorReport]
    ) -> List[Action]:
        settings = self._sequence.settings
        if self._is_at(active.goal, pose) and self._has_yaw(active.goal, pose):
            return self._end(active, now_s, pose, "")
        if any(report.verdict is Verdict.CANCELLED for report in reports):
            return self._end(active, now_s, pose, "cancelled by another node")
        lost = self._loss_reason(active, now_s, reports)
        if lost:
            # The attempt is repeated, so its time-out keeps running from its start.
            return [self._send(now_s, dataclasses.replace(active, replaced=False), lost)]
        failure = self._failure_reason(active, now_s, pose, reports)
        if failure and active.attempt <= settings.retries:
            retry = dataclasses.replace(active, sent_s=now_s, attempt=active.attempt + 1)
            return [self._send(now_s, retry, failure)]
        return self._end(active, now_s, pose, failure) if failure else []

    def _is_at(self, goal: Goal, pose: Pose2D) -> bool:
        return pose.distance_to(goal.pose) <= self._sequence.tolerance_m(goal)

    def _has_yaw(self, goal: Goal, pose: Pose2D) -> bool:
        """Return whether a pose has a goal's yaw; any yaw will do for a goal without one."""
        error_rad = goal.yaw_error_rad(pose)
        return error_rad is None or abs(error_rad) <= self._sequence.yaw_tolerance_rad(goal)

    def _loss_reason(
        self, active: ActiveGoal, now_s: float, reports: Sequence[NavigatorReport]
    ) -> str:
        """Return why the navigator has not got the goal any more, "" if it has."""
        if self._is_resumed:
            return self._resume_reason
        if active.replaced and any(report.verdict in _ENDED for report in reports):
            return "the navigator has finished another node's goal"
        if now_s - self._busy_s >= GOAL_LOST_AFTER_S:
            return f"the navigator has had no goal for {GOAL_LOST_AFTER_S:.0f} s"
        return ""

    def _failure_reason(
        self, active: ActiveGoal, now_s: float, pose: Pose2D, reports: Sequence[NavigatorReport]
    ) -> str:
        """Return why the attempt has failed, "" if it has not."""
        settings = self._sequence.settings
        for report in reports:
            if report.verdict is Verdict.ABORTED:
                return f"aborted: {report.text}" if report.text else "aborted"
            if report.verdict is Verdict.SUCCEEDED and self._stopped_s is None:
                self._stopped_s = now_s
        if self._stopped_s is not None:
            is_settling = active.goal.yaw_rad is not None and self._is_at(active.goal, pose)
            if not is_settling or now_s - self._stopped_s >= SETTLE_S:
                return f"the navigator stopped {self._offset_text(active.goal, pose)}"
        if now_s - active.sent_s >= settings.goal_timeout_s:
            timeout = f"not reached in {settings.goal_timeout_s:g} s"
            if active.goal.yaw_rad is None or not self._is_at(active.goal, pose):
                return timeout
            return f"{timeout}, {self._offset_text(active.goal, pose)}"
        return ""

    def _offset_text(self, goal: Goal, pose: Pose2D) -> str:
        """Return the distance from a goal, or the error of the yaw at a goal with one."""
        error_rad = goal.yaw_error_rad(pose)
        if error_rad is not None and self._is_at(goal, pose):
            return (
                f"at it with a yaw error of {error_rad:.2f} rad "
                f"(yaw_tolerance {self._sequence.yaw_tolerance_rad(goal):.2f} rad)"
            )
        name = "goal_tolerance" if goal.tolerance_m is None else "tolerance"
        return (
            f"{pose.distance_to(goal.pose):.2f} m from it "
            f"({name} {self._sequence.tolerance_m(goal):.2f} m)"
        )

    def _start_next(self, now_s: float, pose: Pose2D) -> List[Action]:
        """Send the goal at the present index, or end the sequence or lap."""
        goals = self._sequence.goals
        if self._index >= len(goals):
            if not self._sequence.settings.loop:
                self._done = True
                return [SequenceDone()]
            self._index, self._lap = 0, self._lap + 1
        goal = goals[self._index]
        return [self._send(now_s, ActiveGoal(goal, _with_yaw(goal, pose), now_s, now_s), "")]

    def _send(self, now_s: float, active: ActiveGoal, resend_reason: str) -> SendGoal:
        self._active, self._busy_s, self._is_resumed = active, now_s, False
        self._stopped_s = None
        return SendGoal(self._index, self._lap, active.pose, active.attempt, resend_reason)

    def _end(self, active: ActiveGoal, now_s: float, pose: Pose2D, reason: str) -> List[Action]:
        """End the goal, reached without a reason or skipped with one, and start the next."""
        ended = GoalEnded(
            self._index,
            self._lap,
            active.goal,
            not reason,
            now_s - active.first_sent_s,
            active.attempt,
            reason,
            active.goal.yaw_error_rad(pose),
        )
        self._active = None
        self._index += 1
        if not reason and active.goal.wait_s > 0.0:
            self._dwell = Dwell(active.goal, now_s)
            return [ended]
        return [ended, *self._start_next(now_s, pose)]


def _with_yaw(goal: Goal, start: Pose2D) -> Pose2D:
    """Return the goal's pose; without a yaw it faces along the straight line from ``start``.

    The robot arrives at about this yaw, so it need not turn at the goal.
    """
    if goal.yaw_rad is not None:
        return goal.pose
    dx_m, dy_m = goal.x_m - start.x_m, goal.y_m - start.y_m
    yaw_rad = math.atan2(dy_m, dx_m) if math.hypot(dx_m, dy_m) > 1e-3 else start.yaw_rad
    return Pose2D(goal.x_m, goal.y_m, yaw_rad)
