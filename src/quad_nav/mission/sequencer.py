"""State machine that flies one robot's goals in order, without ROS and without a clock.

A goal is reached when the robot's odometry is within the tolerance of it. What the navigator
reports only decides when to send the goal again.

    send -> flying -> reached ------------------> next goal, or done
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
from typing import List, Optional, Sequence, Union

from quad_nav.geometry import Pose2D
from quad_nav.mission.goal_file import Goal, GoalSequence

GOAL_LOST_AFTER_S = 5.0
"""A navigator that is idle for so long has lost the goal: it restarted, or was not ready."""


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


@dataclass(frozen=True)
class SendGoal:
    """Action: send ``pose`` to the navigator.

    ``resend_reason`` says why the goal is sent again; it is empty the first time.
    """

    index: int
    lap: int
    pose: Pose2D
    attempt: int
    resend_reason: str = ""


@dataclass(frozen=True)
class GoalEnded:
    """Action: a goal is reached, or skipped for ``reason``; ``time_s`` since it was first sent."""

    index: int
    lap: int
    goal: Goal
    reached: bool
    time_s: float
    attempts: int
    reason: str = ""


@dataclass(frozen=True)
class SequenceDone:
    """Action: all goals have ended."""


Action = Union[SendGoal, GoalEnded, SequenceDone]


@dataclass(frozen=True)
class ActiveGoal:
    """Goal that the robot flies to.

    Attributes:
        goal: The goal as in the goal file.
        pose: The pose that was sent, with the yaw that was chosen.
        first_sent_s: Time of the first attempt.
        sent_s: Start of the present attempt.
        attempt: 1 for the first one.
        replaced: The navigator flies another node's goal instead.
    """

    goal: Goal
    pose: Pose2D
    first_sent_s: float
    sent_s: float
    attempt: int = 1
    replaced: bool = False


@dataclass(frozen=True)
class SequenceProgress:
    """Snapshot of a sequencer: index of the active or next goal, lap, and the active goal."""

    index: int = 0
    lap: int = 1
    active_goal: Optional[ActiveGoal] = None


START = SequenceProgress()


class Sequencer:
    """Decides which goal to send next, and when to send, retry or skip it.

    ``progress`` is the snapshot of an earlier sequencer to resume from. Its active goal is sent
    again without counting an attempt, unless the robot has reached it meanwhile.
    """

    def __init__(self, sequence: GoalSequence, progress: SequenceProgress = START) -> None:
        self._sequence = sequence
        self._index, self._lap, self._active = progress.index, progress.lap, progress.active_goal
        self._is_resumed = progress.active_goal is not None
        self._busy_s = 0.0  # the last time at which the navigator was not known to be idle
        self._done = False
        self._drop_replaced_goal()

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
        """The goal that the robot flies to; None before the first and after the last."""
        return self._active

    @property
    def progress(self) -> SequenceProgress:
        """Snapshot that another sequencer can resume from."""
        return SequenceProgress(self._index, self._lap, self._active)

    @property
    def done(self) -> bool:
        """True when all goals have ended."""
        return self._done

    def replace_sequence(self, sequence: GoalSequence) -> None:
        """Follow an edited goal file from the next tick on.

        Goals before the present index stay ended. The active goal stays active if the new list
        has the same goal at its index.
        """
        self._sequence = sequence
        self._done = False
        self._drop_replaced_goal()

    def _drop_replaced_goal(self) -> None:
        goals = self._sequence.goals
        current = goals[self._index] if self._index < len(goals) else None
        if self._active is not None and self._active.goal != current:
            self._active = None

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
        if self._done:
            return []
        if self._active is None:
            return self._start_next(now_s, pose)
        if not navigator_idle:
            self._busy_s = now_s
        if any(report.verdict is Verdict.REPLACED for report in reports):
            self._active = dataclasses.replace(self._active, replaced=True)
        return self._check_active(self._active, now_s, pose, reports)

    def _check_active(
        self, active: ActiveGoal, now_s: float, pose: Pose2D, reports: Sequence[NavigatorReport]
    ) -> List[Action]:
        settings = self._sequence.settings
        if pose.distance_to(active.pose) <= settings.goal_tolerance_m:
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

    def _loss_reason(
        self, active: ActiveGoal, now_s: float, reports: Sequence[NavigatorReport]
    ) -> str:
        """Return why the navigator has not got the goal any more, "" if it has."""
        if self._is_resumed:
            return "the sequencer or the clock restarted"
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
            if report.verdict is Verdict.SUCCEEDED:
                return (
                    f"the navigator stopped {pose.distance_to(active.pose):.2f} m from it "
                    f"(goal_tolerance {settings.goal_tolerance_m:.2f} m)"
                )
        if now_s - active.sent_s >= settings.goal_timeout_s:
            return f"not reached in {settings.goal_timeout_s:g} s"
        return ""

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
        )
        self._active = None
        self._index += 1
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
