"""Sequencers of an offline flight's robots, and which of them have something to do.

A sequencer looks at every odometry, but nearly always there is nothing to do: the robot is on its
way. ``GoalWatch`` finds the others for all robots at once.
"""

from __future__ import annotations

import math
from typing import List, Sequence

import numpy as np
from numpy.typing import NDArray

from quad_nav.config import Configuration
from quad_nav.geometry import Pose2D
from quad_nav.mission.actions import Action, SendGoal
from quad_nav.mission.flight_log import FlightLog
from quad_nav.mission.robot_goals import RobotGoals
from quad_nav.mission.sequencer import NavigatorReport, Sequencer, Verdict
from quad_nav.navigator.tick import State, Tick

_SLACK_M, _SLACK_S = 1e-6, 1e-6
"""The sequencer itself decides to the last digit."""


class FlightRobot:
    """One robot's sequencer, its log, and the last known state of its navigator.

    A person may send goals beside the sequencer, see ``replace_goal`` and ``cancel_goal``: it
    learns of them what the reports of a navigator under ROS say.

    Attributes:
        name: Name of the robot.
        configuration: Its configuration; it may change in flight.
        sequencer: Its sequencer.
        goal_waits: The navigator has not taken the last goal that was sent.
        flies_other_goal: The last goal that was sent is a person's, and has not ended.
    """

    def __init__(self, goals: RobotGoals, configuration: Configuration, log: FlightLog) -> None:
        self.name = goals.name
        self.configuration = configuration
        self.sequencer = Sequencer(goals.sequence)
        self._log = log.robots[self.name]
        self.goal_waits = False
        self.flies_other_goal = False
        self._is_idle = True
        self._reports: List[NavigatorReport] = []

    @property
    def due_s(self) -> float:
        """Time before which the sequencer has nothing to do while the robot is not at its goal."""
        if self._reports:
            return -math.inf
        return self.sequencer.due_s(self._has_no_goal)

    @property
    def _has_no_goal(self) -> bool:
        return self._is_idle and not self.goal_waits

    def tick_sequencer(self, now_s: float, pose: Pose2D) -> List[Action]:
        """Pass the odometry to the sequencer and return its actions."""
        actions = self.sequencer.tick(now_s, pose, self._reports, self._has_no_goal)
        self._reports = []
        if any(isinstance(action, SendGoal) for action in actions):
            self.goal_waits, self.flies_other_goal = True, False
        return actions

    @property
    def has_navigator_goal(self) -> bool:
        """True if the navigator has a goal, or gets one."""
        return not self._has_no_goal

    @property
    def is_done(self) -> bool:
        """True if all goals of the sequence have ended, and a person's goal as well."""
        return self.sequencer.done and not self.flies_other_goal

    def replace_goal(self) -> None:
        """Note that a person has sent another goal to the navigator."""
        self.goal_waits = self.flies_other_goal = True
        self._reports.append(NavigatorReport(Verdict.REPLACED))

    def cancel_goal(self) -> None:
        """Note that a person has cancelled the navigator's goal."""
        verdict = Verdict.OTHER_ENDED if self.flies_other_goal else Verdict.CANCELLED
        self.goal_waits = self.flies_other_goal = False
        self._reports.append(NavigatorReport(verdict))

    def update(self, tick: Tick, goal_waits: bool) -> bool:
        """Store the result of the navigator's tick for the log and the sequencer.

        Returns:
            True if ``due_s`` may have changed.
        """
        had_no_goal = self._has_no_goal
        self.goal_waits, self._is_idle = goal_waits, tick.state is State.IDLE
        if self._has_no_goal and not had_no_goal:
            self.sequencer.note_busy(tick.now_s)
        if tick.recovery is not None:
            self._log.recoveries += 1
        if tick.outcome is not None:
            self._log.aborts += not tick.outcome.succeeded
            # A goal that waits has replaced the one that ended here.
            if not goal_waits:
                verdict = Verdict.SUCCEEDED if tick.outcome.succeeded else Verdict.ABORTED
                if self.flies_other_goal:
                    verdict, self.flies_other_goal = Verdict.OTHER_ENDED, False
                self._reports.append(NavigatorReport(verdict, tick.outcome.text))
        return bool(self._reports) or self._has_no_goal is not had_no_goal


class GoalWatch:
    """Finds the robots whose sequencers have something to do, all at once."""

    def __init__(self, robots: Sequence[FlightRobot]) -> None:
        """Watch robots; at first every sequencer has something to do."""
        self._robots = robots
        self._goals_m = np.zeros((len(robots), 2))
        self._squares_m2 = np.full(len(robots), -1.0)  # of the tolerances; -1 without a goal
        self._due_s = np.full(len(robots), -math.inf)

    def update(self, robot: int) -> None:
        """Take over what a robot's sequencer waits for now."""
        sequencer = self._robots[robot].sequencer
        self._due_s[robot] = self._robots[robot].due_s - _SLACK_S
        if sequencer.active_goal is None:
            self._squares_m2[robot] = -1.0
        else:
            goal = sequencer.active_goal.goal
            self._goals_m[robot] = goal.x_m, goal.y_m
            self._squares_m2[robot] = (sequencer.sequence.tolerance_m(goal) + _SLACK_M) ** 2

    def due(self, now_s: float, poses: NDArray[np.float64]) -> List[int]:
        """Return the numbers of robots that are at their goals, or whose sequencers are due.

        Args:
            now_s: Simulated time.
            poses: float64[n, 3], poses (x_m, y_m, yaw_rad) of all robots in ``map``.
        """
        offsets_m = poses[:, :2] - self._goals_m
        offsets_m *= offsets_m
        is_due = offsets_m[:, 0] + offsets_m[:, 1] <= self._squares_m2
        is_due |= self._due_s <= now_s
        numbers: List[int] = np.flatnonzero(is_due).tolist()
        return numbers
