"""Flight log: path lengths, clearances, contacts and the outcome of each goal.

``RobotLog`` has the figures of one robot, ``FlightLog`` those of all robots of a mission. Both
shells fill them and sum them up with ``summary``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import assert_never
from quad_nav.geometry import Pose2D, angle_difference
from quad_nav.mission.actions import Action, GoalEnded, SendGoal, SequenceDone
from quad_nav.mission.distances import DistanceLog, SurfaceDistance
from quad_nav.mission.goal import Goal
from quad_nav.mission.goal_file import GoalSequence
from quad_nav.mission.sequencer import Sequencer
from quad_nav.sim.contacts import CONTACT_GAP_S, Contact

_SAME_BEGIN_S = CONTACT_GAP_S / 2
"""Two reports of one contact differ by less: contacts of a pair begin further apart."""

SPIN_BELOW_MPS, SPIN_ABOVE_RADPS = 0.05, 0.2
"""A robot turns on the spot if it is slower than this and turns faster than this."""

INTERRUPTED = "interrupted"
NOT_SENT = "not sent"
"""Reasons of goals that did not fail: the mission ended while they were flown, or before."""


@dataclass(frozen=True)
class Leg:
    """Flight to one goal.

    ``straight_length_m`` is the distance from the position where the goal was sent to the one
    where it ended. ``time_s`` is None if the goal was not sent. ``yaw_error_rad`` is the robot's
    yaw at the end less the goal's; None for a goal without yaw, or if it was not sent.
    """

    index: int
    lap: int
    goal: Goal
    reached: bool
    reason: str
    attempts: int
    time_s: Optional[float] = None
    path_length_m: float = 0.0
    straight_length_m: float = 0.0
    yaw_error_rad: Optional[float] = None


@dataclass(frozen=True)
class RobotLogState:
    """Snapshot of a robot's log that another log can resume from.

    Attributes:
        legs: The legs that have ended.
        path_length_m: Length of the path since the first goal was sent.
        recoveries: Number of recoveries.
        aborts: Number of goals that the navigator aborted.
        spin_s: Time that the robot turned on the spot.
        leg_start: Pose in ``map`` at which the present leg began.
        leg_start_length_m: Length of the path at that time.
        pose: Last pose in ``map``; None if the robot is somewhere else now.
    """

    legs: Tuple[Leg, ...] = ()
    path_length_m: float = 0.0
    recoveries: int = 0
    aborts: int = 0
    spin_s: float = 0.0
    leg_start: Optional[Pose2D] = None
    leg_start_length_m: float = 0.0
    pose: Optional[Pose2D] = None


class RobotLog:
    """Log of one robot, from its first goal to its last.

    ``previous`` is the state of an earlier log to resume from; the path from its last pose to the
    first new pose counts as straight.
    """

    def __init__(self, name: str, previous: RobotLogState = RobotLogState()) -> None:
        self.name = name
        self.legs: List[Leg] = list(previous.legs)
        self.path_length_m = previous.path_length_m
        self.recoveries = previous.recoveries
        self.aborts = previous.aborts
        self.spin_s = previous.spin_s
        self._pose = previous.pose
        self._stamp_s = 0.0
        self._is_flying = previous.pose is not None
        self._leg_start = previous.leg_start
        self._leg_start_length_m = previous.leg_start_length_m

    @property
    def state(self) -> RobotLogState:
        """Snapshot of the present state."""
        return RobotLogState(
            tuple(self.legs),
            self.path_length_m,
            self.recoveries,
            self.aborts,
            self.spin_s,
            self._leg_start,
            self._leg_start_length_m,
            self._pose,
        )

    def add_track(self, stamps_s: Sequence[float], poses: Sequence[Sequence[float]]) -> None:
        """Add poses (x_m, y_m, yaw_rad) in ``map``; the stamps increase beyond the last one."""
        if self._pose is None:
            self._pose, self._stamp_s = Pose2D(*poses[0]), stamps_s[0]
        if self._is_flying:
            self._add_steps(self._pose, stamps_s, poses)
        self._pose, self._stamp_s = Pose2D(*poses[-1]), stamps_s[-1]

    def newer(self, stamps_s: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return the mask bool[n] of the times float64[n] that are newer than all before."""
        last_s = -np.inf if self._pose is None else self._stamp_s
        newest_s = np.maximum.accumulate(np.concatenate(([last_s], stamps_s)))
        is_newer: NDArray[np.bool_] = stamps_s > newest_s[:-1]
        return is_newer

    def relocate(self) -> None:
        """Forget the last pose: the robot did not fly to the next one."""
        self._pose = None

    def _add_steps(
        self, start: Pose2D, stamps_s: Sequence[float], poses: Sequence[Sequence[float]]
    ) -> None:
        """Add the steps from one pose to the next."""
        before_s, (x_m, y_m, yaw_rad) = self._stamp_s, (start.x_m, start.y_m, start.yaw_rad)
        for stamp_s, (next_x_m, next_y_m, next_yaw_rad) in zip(stamps_s, poses):
            time_s = stamp_s - before_s
            length_m = math.hypot(next_x_m - x_m, next_y_m - y_m)
            self.path_length_m += length_m
            if length_m < SPIN_BELOW_MPS * time_s:
                if abs(angle_difference(next_yaw_rad, yaw_rad)) > SPIN_ABOVE_RADPS * time_s:
                    self.spin_s += time_s
            before_s, x_m, y_m, yaw_rad = stamp_s, next_x_m, next_y_m, next_yaw_rad

    def add_action(self, action: Action) -> Optional[Leg]:
        """Add an action of the sequencer; return the leg if the action ended one."""
        self._is_flying = not isinstance(action, SequenceDone)
        if isinstance(action, SendGoal):
            if not action.resend_reason:
                self._leg_start, self._leg_start_length_m = self._pose, self.path_length_m
            return None
        if isinstance(action, GoalEnded):
            leg = self._present_leg(action)
            self.legs.append(leg)
            return leg
        if isinstance(action, SequenceDone):
            return None
        assert_never(action)

    def all_legs(self, sequencer: Sequencer, now_s: float) -> List[Leg]:
        """Return the legs flown, the one that is interrupted now and those that were not sent."""
        active, first, lap = sequencer.active_goal, sequencer.index, sequencer.lap
        rest = [
            Leg(index, lap, goal, False, NOT_SENT, 0)
            for index, goal in enumerate(sequencer.sequence.goals[first:], start=first)
        ]
        if active is not None and rest:
            until_s = now_s if sequencer.held_s is None else sequencer.held_s
            time_s = until_s - active.first_sent_s
            error_rad = None if self._pose is None else active.goal.yaw_error_rad(self._pose)
            rest[0] = self._present_leg(
                GoalEnded(
                    first, lap, active.goal, False, time_s, active.attempt, INTERRUPTED, error_rad
                )
            )
        return self.legs + rest

    def _present_leg(self, ended: GoalEnded) -> Leg:
        straight_m = 0.0
        if self._leg_start is not None and self._pose is not None:
            straight_m = self._leg_start.distance_to(self._pose)
        return Leg(
            ended.index,
            ended.lap,
            ended.goal,
            ended.reached,
            ended.reason,
            ended.attempts,
            ended.time_s,
            self.path_length_m - self._leg_start_length_m,
            straight_m,
            ended.yaw_error_rad,
        )


class FlightLog:
    """Log of all robots of a mission.

    ``surface_distance`` returns the distance to the nearest obstacle or wall; without it there are
    no clearances.
    """

    def __init__(
        self,
        names: Sequence[str],
        robot_radius_m: float,
        surface_distance: Optional[SurfaceDistance] = None,
    ) -> None:
        self.robots: Dict[str, RobotLog] = {name: RobotLog(name) for name in names}
        self.robot_radius_m = robot_radius_m
        self.contacts: List[Contact] = []
        self.distances = DistanceLog(names, robot_radius_m, surface_distance)

    def add_track(
        self, name: str, stamps_s: NDArray[np.float64], poses: NDArray[np.float64]
    ) -> None:
        """Add poses of a robot in the order in which they arrived; ignore those that are not newer.

        Args:
            name: Name of the robot.
            stamps_s: float64[n], times of the poses.
            poses: float64[n, 3], poses (x_m, y_m, yaw_rad) in ``map``.
        """
        is_newer = self.robots[name].newer(stamps_s)
        times_s, track = stamps_s[is_newer].tolist(), poses[is_newer].tolist()
        if times_s:
            self.robots[name].add_track(times_s, track)
            places = [(time_s, x_m, y_m) for time_s, (x_m, y_m, _) in zip(times_s, track)]
            self.distances.add_tracks({name: places})

    def add_tracks(self, stamps_s: Sequence[float], poses: NDArray[np.float64]) -> None:
        """Add poses of all robots at the same times.

        Args:
            stamps_s: Times, which increase beyond those of the poses before.
            poses: float64[t, n, 3], poses (x_m, y_m, yaw_rad) in ``map`` at these times of the
                robots in the order of their names.
        """
        tracks = {}
        for k, (name, robot) in enumerate(self.robots.items()):
            track = poses[:, k].tolist()
            robot.add_track(stamps_s, track)
            tracks[name] = [(stamp_s, x_m, y_m) for stamp_s, (x_m, y_m, _) in zip(stamps_s, track)]
        self.distances.add_tracks(tracks)

    def add_contact(self, contact: Contact) -> bool:
        """Add a contact that begins; return False if it is in the log already.

        ``sim.contacts`` defines what a contact is. This method only ignores a contact that is
        reported again, or by both robots of the pair.
        """
        if any(_is_same(contact, known) for known in self.contacts):
            return False
        self.contacts.append(contact)
        return True

    def resume(
        self,
        name: str,
        previous: RobotLogState,
        clearance_m: Optional[float],
        separation_m: Optional[float],
    ) -> None:
        """Take over a robot's state and smallest distances from an earlier log."""
        self.robots[name] = RobotLog(name, previous)
        self.distances.restore(name, clearance_m, separation_m)

    def touches(self, name: str, robots: bool) -> bool:
        """Return whether a robot had a contact with another robot, or else with anything else."""
        return any(
            contact.involves(name)
            and (contact.robot in self.robots and contact.other in self.robots) is robots
            for contact in self.contacts
        )

    def contacts_of(self, name: str) -> int:
        """Return the number of contacts of a robot."""
        return sum(contact.involves(name) for contact in self.contacts)


def _is_same(one: Contact, other: Contact) -> bool:
    return (
        abs(one.time_s - other.time_s) < _SAME_BEGIN_S
        and one.involves(other.robot)
        and one.involves(other.other)
    )


def unflown_legs(sequence: GoalSequence) -> List[Leg]:
    """Return the legs of a mission that did not start."""
    return [Leg(index, 1, goal, False, NOT_SENT, 0) for index, goal in enumerate(sequence.goals)]
