"""One quadcopter's goals, one after the other: the state machine without ROS or clock.

A goal is reached when the quadcopter is within the tolerance of it, as its
odometry says; the navigator's own opinion only tells when to try again.

    send -> flying -> reached ------------------> next goal, or done
              |
              +-> aborted, out of time, reported reached elsewhere
              |       -> send again while retries last -> skipped -> next
              +-> cancelled by a person -> skipped -> next
              +-> forgotten by the navigator (restarted) or finished with
                  somebody else's goal -> send again, not counted
"""

from __future__ import annotations

import dataclasses
import enum
import math
from dataclasses import dataclass
from typing import List, Optional, Sequence, Union

from quad_nav.geometry import Pose2D
from quad_nav.mission.goal_sequence import Goal, GoalSequence

# A navigator without a goal for this long has lost ours: it was restarted, or was not ready yet.
FORGOTTEN_AFTER_S = 5.0


class Verdict(enum.Enum):
    """What the navigator says about the goal that it had."""

    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    CANCELLED = "cancelled"
    REPLACED = "replaced by somebody else's goal"


@dataclass(frozen=True)
class NavigatorReport:
    verdict: Verdict
    text: str = ""


@dataclass(frozen=True)
class SendGoal:
    """Send ``pose`` to the navigator. ``why`` is empty the first time."""

    index: int
    lap: int
    pose: Pose2D
    attempt: int
    why: str = ""


@dataclass(frozen=True)
class GoalEnded:
    """The goal is reached, or skipped for ``reason``; ``time_s`` since it was first sent."""

    index: int
    lap: int
    goal: Goal
    reached: bool
    time_s: float
    attempts: int
    reason: str = ""


@dataclass(frozen=True)
class SequenceDone:
    """There is no further goal."""


Action = Union[SendGoal, GoalEnded, SequenceDone]


@dataclass(frozen=True)
class Flight:
    """The goal that is being flown."""

    goal: Goal
    pose: Pose2D  # as sent, with the yaw that was chosen
    first_sent_s: float
    sent_s: float  # at the start of this attempt
    attempt: int = 1
    replaced: bool = False  # the navigator flies somebody else's goal


@dataclass(frozen=True)
class Stage:
    """How far a sequence has been flown: the goal in flight or next, and in which round."""

    index: int = 0
    lap: int = 1
    flight: Optional[Flight] = None


BEGINNING = Stage()


class Sequencer:
    """Which goal next. ``tick`` takes the situation and returns what to do, in order.

    ``stage`` is where another sequencer has left off. The goal that it had in flight is
    sent again, not counted, unless it has been reached meanwhile.
    """

    def __init__(self, sequence: GoalSequence, stage: Stage = BEGINNING):
        self._sequence = sequence
        self._index, self._lap, self._flight = stage.index, stage.lap, stage.flight
        self._is_taken_over = stage.flight is not None
        self._busy_s = 0.0  # when the navigator was last not known to be idle
        self._done = False
        self._drop_other_flight()

    @property
    def sequence(self) -> GoalSequence:
        return self._sequence

    @property
    def index(self) -> int:
        """Of the goal that is flown or is next; the number of goals when done."""
        return self._index

    @property
    def lap(self) -> int:
        """1 in the first round."""
        return self._lap

    @property
    def flight(self) -> Optional[Flight]:
        return self._flight

    @property
    def stage(self) -> Stage:
        """For another sequencer, to go on from."""
        return Stage(self._index, self._lap, self._flight)

    @property
    def done(self) -> bool:
        return self._done

    def replace_sequence(self, sequence: GoalSequence) -> None:
        """Follow an edited goal file from the next tick on.

        The goals at the places already flown in this lap stay as they are;
        the rest follows the new list. The goal in flight goes on if the new
        list has the same one in its place.
        """
        self._sequence = sequence
        self._done = False
        self._drop_other_flight()

    def _drop_other_flight(self) -> None:
        goals = self._sequence.goals
        current = goals[self._index] if self._index < len(goals) else None
        if self._flight is not None and self._flight.goal != current:
            self._flight = None

    def tick(
        self,
        now_s: float,
        pose: Pose2D,
        reports: Sequence[NavigatorReport] = (),
        navigator_idle: bool = False,
    ) -> List[Action]:
        """What to do now.

        ``pose`` is the quadcopter's in ``map``; ``reports`` came since the
        last tick, about the goal that was sent last; ``navigator_idle`` says
        that the navigator is up and has no goal.
        """
        if self._done:
            return []
        if self._flight is None:
            return self._next(now_s, pose)
        settings = self._sequence.settings
        if not navigator_idle:
            self._busy_s = now_s
        if any(report.verdict is Verdict.REPLACED for report in reports):
            self._flight = dataclasses.replace(self._flight, replaced=True)
        flight = self._flight
        if pose.distance_to(flight.pose) <= settings.goal_tolerance_m:
            return self._end(flight, now_s, pose, "")
        if any(report.verdict is Verdict.CANCELLED for report in reports):
            return self._end(flight, now_s, pose, "cancelled by another node")
        lost = self._why_lost(flight, now_s, reports)
        if lost:
            # The time-out is for an attempt: one that is only repeated keeps its start.
            return [self._send(now_s, dataclasses.replace(flight, replaced=False), lost)]
        failure = self._why_failed(flight, now_s, pose, reports)
        if failure and flight.attempt <= settings.retries:
            return [
                self._send(
                    now_s,
                    dataclasses.replace(flight, sent_s=now_s, attempt=flight.attempt + 1),
                    failure,
                )
            ]
        return self._end(flight, now_s, pose, failure) if failure else []

    def _why_lost(self, flight: Flight, now_s: float, reports: Sequence[NavigatorReport]) -> str:
        """Why the navigator is without our goal through no fault of the goal's."""
        if self._is_taken_over:
            return "the sequencer or its clock began anew"
        ended = any(report.verdict in (Verdict.SUCCEEDED, Verdict.ABORTED) for report in reports)
        if flight.replaced and ended:
            return "the navigator is through with another node's goal"
        if now_s - self._busy_s >= FORGOTTEN_AFTER_S:
            return f"the navigator has had no goal for {FORGOTTEN_AFTER_S:.0f} s"
        return ""

    def _why_failed(
        self, flight: Flight, now_s: float, pose: Pose2D, reports: Sequence[NavigatorReport]
    ) -> str:
        settings = self._sequence.settings
        for report in reports:
            if report.verdict is Verdict.ABORTED:
                return f"aborted: {report.text}" if report.text else "aborted"
            if report.verdict is Verdict.SUCCEEDED:
                return (
                    f"the navigator stopped {pose.distance_to(flight.pose):.2f} m from it "
                    f"(goal_tolerance {settings.goal_tolerance_m:.2f} m)"
                )
        if now_s - flight.sent_s >= settings.goal_timeout_s:
            return f"not reached in {settings.goal_timeout_s:g} s"
        return ""

    def _next(self, now_s: float, pose: Pose2D) -> List[Action]:
        """Fly the goal at the present index, or see that there is none."""
        goals = self._sequence.goals
        if self._index >= len(goals):
            if not self._sequence.settings.loop:
                self._done = True
                return [SequenceDone()]
            self._index, self._lap = 0, self._lap + 1
        goal = goals[self._index]
        return [self._send(now_s, Flight(goal, _with_yaw(goal, pose), now_s, now_s), "")]

    def _send(self, now_s: float, flight: Flight, why: str) -> SendGoal:
        self._flight, self._busy_s, self._is_taken_over = flight, now_s, False
        return SendGoal(self._index, self._lap, flight.pose, flight.attempt, why)

    def _end(self, flight: Flight, now_s: float, pose: Pose2D, reason: str) -> List[Action]:
        """Reached without a reason, skipped with one; then the next goal."""
        ended = GoalEnded(
            self._index,
            self._lap,
            flight.goal,
            not reason,
            now_s - flight.first_sent_s,
            flight.attempt,
            reason,
        )
        self._flight = None
        self._index += 1
        return [ended, *self._next(now_s, pose)]


def _with_yaw(goal: Goal, start: Pose2D) -> Pose2D:
    """The goal's pose; without a yaw it looks along the straight way from ``start``.

    That is about how the quadcopter comes in, so it need not turn on the spot.
    """
    if goal.yaw_rad is not None:
        return goal.pose
    dx_m, dy_m = goal.x_m - start.x_m, goal.y_m - start.y_m
    yaw_rad = math.atan2(dy_m, dx_m) if math.hypot(dx_m, dy_m) > 1e-3 else start.yaw_rad
    return Pose2D(goal.x_m, goal.y_m, yaw_rad)
