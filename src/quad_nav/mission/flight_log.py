"""What was flown: path lengths, smallest gaps, contacts, and each goal's outcome.

Gaps are between hulls: a quadcopter is a disc of ``robot_radius_m``, so the
gap to an obstacle is the centre's distance to its surface less one radius, and
the gap between two quadcopters their centres' distance less both radii.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, List, Optional, Sequence, Tuple

from quad_nav.geometry import Pose2D, angle_difference
from quad_nav.mission.distances import DistanceLog, SurfaceDistance
from quad_nav.mission.goal_sequence import Goal, GoalSequence
from quad_nav.mission.sequencer import Action, GoalEnded, SendGoal, SequenceDone, Sequencer
from quad_nav.sim.contacts import CONTACT_GAP_S, Contact

# Contacts of a pair begin more than CONTACT_GAP_S apart, so reports of a begin that differ by less
# than this, in rounding or because both robots report it, are of the same contact.
_SAME_BEGIN_S = CONTACT_GAP_S / 2
# A quadcopter that is slower than this and turns faster than this spins.
SPIN_BELOW_MPS, SPIN_ABOVE_RADPS = 0.05, 0.2

# Reasons of legs that no fault of theirs kept from their end.
INTERRUPTED = "interrupted"
NOT_SENT = "not sent"


@dataclass(frozen=True)
class Leg:
    """The flight to one goal; ``straight_length_m`` is from where it was sent to where it ended."""

    index: int
    lap: int
    goal: Goal
    reached: bool
    reason: str
    attempts: int
    time_s: Optional[float] = None
    path_length_m: float = 0.0
    straight_length_m: float = 0.0


@dataclass(frozen=True)
class Flown:
    """The figures of one quadcopter up to a moment, for a log that goes on from there.

    ``leg_start`` is where the leg in flight began, ``leg_start_length_m`` how long the path
    was by then; ``pose`` is where the quadcopter was last, None when it is somewhere else now.
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
    """What one quadcopter has flown from its first goal to its last.

    ``spin_s`` is how long it turned on the spot, ``aborts`` how many goals its navigator
    gave up. ``before`` is what it had flown before this log begins; to the first pose it
    flew straight.
    """

    def __init__(self, name: str, before: Flown = Flown()):
        self.name = name
        self.legs: List[Leg] = list(before.legs)
        self.path_length_m = before.path_length_m
        self.recoveries = before.recoveries
        self.aborts = before.aborts
        self.spin_s = before.spin_s
        self._pose = before.pose
        self._stamp_s = 0.0
        self._is_flying = before.pose is not None
        self._leg_start = before.leg_start
        self._leg_start_length_m = before.leg_start_length_m

    @property
    def flown(self) -> Flown:
        """Up to now."""
        return Flown(
            tuple(self.legs),
            self.path_length_m,
            self.recoveries,
            self.aborts,
            self.spin_s,
            self._leg_start,
            self._leg_start_length_m,
            self._pose,
        )

    def move(self, stamp_s: float, pose: Pose2D) -> bool:
        """Take a pose; False for one that is not newer than the last."""
        if self._pose is not None:
            if stamp_s <= self._stamp_s:
                return False
            if self._is_flying:
                self._fly(self._pose, pose, stamp_s - self._stamp_s)
        self._pose, self._stamp_s = pose, stamp_s
        return True

    def _fly(self, before: Pose2D, after: Pose2D, time_s: float) -> None:
        length_m = before.distance_to(after)
        self.path_length_m += length_m
        turn_rad = abs(angle_difference(after.yaw_rad, before.yaw_rad))
        if length_m < SPIN_BELOW_MPS * time_s and turn_rad > SPIN_ABOVE_RADPS * time_s:
            self.spin_s += time_s

    def act(self, action: Action) -> Optional[Leg]:
        """Take the sequencer's action; the leg when it ended one."""
        self._is_flying = not isinstance(action, SequenceDone)
        if isinstance(action, SendGoal) and not action.why:
            self._leg_start, self._leg_start_length_m = self._pose, self.path_length_m
        if not isinstance(action, GoalEnded):
            return None
        leg = self._leg(
            action.index,
            action.lap,
            action.goal,
            action.reached,
            action.reason,
            action.attempts,
            action.time_s,
        )
        self.legs.append(leg)
        return leg

    def all_legs(self, sequencer: Sequencer, now_s: float) -> List[Leg]:
        """The legs flown, the one cut short and those that were never begun."""
        flight, index, lap = sequencer.flight, sequencer.index, sequencer.lap
        rest: List[Leg] = []
        for number, goal in enumerate(sequencer.sequence.goals[index:], start=index):
            if flight is not None and number == index:
                rest.append(
                    self._leg(
                        number,
                        lap,
                        goal,
                        False,
                        INTERRUPTED,
                        flight.attempt,
                        now_s - flight.first_sent_s,
                    )
                )
            else:
                rest.append(Leg(number, lap, goal, False, NOT_SENT, 0))
        return self.legs + rest

    def _leg(
        self,
        index: int,
        lap: int,
        goal: Goal,
        reached: bool,
        reason: str,
        attempts: int,
        time_s: float,
    ) -> Leg:
        straight_m = 0.0
        if self._leg_start is not None and self._pose is not None:
            straight_m = self._leg_start.distance_to(self._pose)
        return Leg(
            index,
            lap,
            goal,
            reached,
            reason,
            attempts,
            time_s,
            self.path_length_m - self._leg_start_length_m,
            straight_m,
        )


class FlightLog:
    """What all quadcopters of a mission have flown."""

    def __init__(
        self,
        names: Sequence[str],
        robot_radius_m: float,
        surface_distance: Optional[SurfaceDistance] = None,
    ):
        self.robots: Dict[str, RobotLog] = {name: RobotLog(name) for name in names}
        self.robot_radius_m = robot_radius_m
        self.contacts: List[Contact] = []
        self.distances = DistanceLog(names, robot_radius_m, surface_distance)

    def move(self, name: str, stamp_s: float, pose: Pose2D) -> None:
        """Take a quadcopter's pose in ``map``."""
        if self.robots[name].move(stamp_s, pose):
            self.distances.add(name, stamp_s, pose.x_m, pose.y_m)

    def add_contact(self, contact: Contact) -> bool:
        """Add a contact that begins; return False if it is in the log already.

        ``sim.contacts`` defines what a contact is. This method only ignores a contact that is
        reported again, or by both robots of the pair.
        """
        if any(_is_same(contact, known) for known in self.contacts):
            return False
        self.contacts.append(contact)
        return True

    def go_on(
        self, name: str, before: Flown, clearance_m: Optional[float], separation_m: Optional[float]
    ) -> None:
        """Take over what a quadcopter has flown, and its smallest gaps, from another log."""
        self.robots[name] = RobotLog(name, before)
        self.distances.restore(name, clearance_m, separation_m)

    def contacts_of(self, name: str) -> int:
        return sum(contact.involves(name) for contact in self.contacts)


def _is_same(one: Contact, other: Contact) -> bool:
    return (
        abs(one.time_s - other.time_s) < _SAME_BEGIN_S
        and one.involves(other.robot)
        and one.involves(other.other)
    )


def unflown(sequence: GoalSequence) -> List[Leg]:
    """The legs of a mission that never began."""
    return [Leg(index, 1, goal, False, NOT_SENT, 0) for index, goal in enumerate(sequence.goals)]
