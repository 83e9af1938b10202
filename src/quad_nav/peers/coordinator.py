"""Coordination of one robot with its peers.

The navigator asks three things: ``observe`` updates the peers, ``decide`` says whether the robot
yields, ``cell`` is the robot's Voronoi cell, inside of which commands are safe. A robot without a
goal yields by a manoeuvre: to a holding point, and back.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.tracks import Tracks
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.peers.peer import IDLE_PRIORITY, NO_PATH, Intention, Peer, priority_of, resample
from quad_nav.peers.peer_costs import PeerCosts
from quad_nav.peers.peer_params import PeerParams
from quad_nav.peers.peer_tracker import PeerTracker
from quad_nav.peers.right_of_way import MOVING_OBSTACLE, Yield, YieldDecision
from quad_nav.peers.roundabout import Roundabout
from quad_nav.peers.stand_off import StandOff
from quad_nav.peers.voronoi_cell import Cell
from quad_nav.peers.yielding import YieldRules
from quad_nav.timing import StallTimer

LATENCY_S = 0.15  # how much later than due the next command may come
GIVE_UP_PRIORITY_AFTER_S = 15.0  # without progress
REPLAN_AFTER_S = 3.0  # of limited commands without progress
_PROGRESS_M = 0.2
_AT_HOLDING_POINT_M = 0.15
_SPACING_M = 0.1  # of the points of the path in the intention


@dataclass(frozen=True)
class PeerAdvice:
    """Result of ``PeerCoordinator.decide``.

    Attributes:
        messages: What the robot does for its peers from now on, for the log.
        replan: The target has changed to or from a holding point.
        manoeuvre_goal: Goal of the yielding manoeuvre that an idle robot begins.
    """

    messages: Tuple[str, ...] = ()
    replan: bool = False
    manoeuvre_goal: Optional[Pose2D] = None


class PeerCoordinator:
    """Coordinates one robot with its peers.

    Attributes:
        params: The parameters; they may change in flight.
        decision: The decision to yield that is in force, None if the robot does not yield.
        parking_pose: Pose that an idle robot has left to make room, None if it is there.
        is_yield_manoeuvre: The robot flies a yielding manoeuvre, not to a goal of its own.
    """

    def __init__(
        self,
        params: PeerParams,
        global_costmap: LayeredCostmap,
        local_costmap: LayeredCostmap,
        number: int = 0,
    ) -> None:
        """Coordinate an idle robot.

        Args:
            params: The parameters.
            global_costmap: Costmap of the global planner, in ``map``.
            local_costmap: Costmap of the local planner, with the robot's footprint.
            number: Number of the robot among those that fly together.
        """
        self.params = params
        self.decision: Optional[YieldDecision] = None
        self.parking_pose: Optional[Pose2D] = None
        self.is_yield_manoeuvre = False
        self._number = number
        self._tracker = PeerTracker(global_costmap, local_costmap)
        self._roundabout = Roundabout(self._tracker, global_costmap)
        self._costs = PeerCosts(self._tracker, self._roundabout, global_costmap, local_costmap)
        self._rules = YieldRules(self._tracker, self._roundabout, global_costmap)
        self._stand_off = StandOff(self._tracker, global_costmap, number)
        self._goal_set_s = -IDLE_PRIORITY
        self._path = NO_PATH
        self._progress = StallTimer()
        self._limited = StallTimer()
        self._tracks = False  # moving obstacles are tracked
        self._has_costs = False  # in the costmaps

    @property
    def peers(self) -> Sequence[Peer]:
        """The peers within reach whose state is fresh."""
        return self._tracker.peers

    @property
    def safety_radius_m(self) -> float:
        """Robot radius plus the margin to peers."""
        return self._tracker.safety_radius_m

    @property
    def reach_m(self) -> float:
        """Distance up to which peers matter; ``observe`` ignores the others."""
        return max(self._tracker.reach_m, self._roundabout.reach_m)

    @property
    def priority(self) -> float:
        """Priority of the robot; the higher one goes first."""
        return priority_of(self._goal_set_s, self._number)

    @property
    def intention(self) -> Intention:
        """Message to the peers."""
        return Intention(self.priority, self._path)

    @property
    def holding_point(self) -> Optional[Pose2D]:
        """Pose at which the robot makes room, None if it does not yield that way."""
        return self.decision.holding_point if self.decision is not None else None

    # -- goals and plans -----------------------------------------------------------------

    def start_goal(self, goal: Pose2D, now_s: float) -> None:
        """Give the robot the priority of a goal that is set now; ``goal`` is in ``map``."""
        self.end_goal()
        self.parking_pose = None
        self._goal_set_s = now_s
        self._path = _straight_to(goal)
        self._progress = StallTimer()
        self._limited = StallTimer()
        self._stand_off.start_goal()
        self._roundabout.start(goal)

    def end_goal(self) -> None:
        """Make the robot idle; a parking pose that it has not reached stays."""
        self.decision, self.is_yield_manoeuvre = None, False
        self._goal_set_s = -IDLE_PRIORITY
        self._path = NO_PATH
        self._roundabout.start(None)

    def end_manoeuvre(self, succeeded: bool) -> None:
        """End a yielding manoeuvre; the robot is at its parking pose if it succeeded."""
        if succeeded:
            self.parking_pose = None

    def follow_plan(self, plan: NDArray[np.float64]) -> None:
        """Tell the peers another path: the plan float64[n, 3] of (x_m, y_m, yaw_rad) in ``map``."""
        self._path = resample(plan[:, :2], _SPACING_M)

    def reject_holding_point(self) -> None:
        """Wait in place, because no plan leads to the holding point."""
        if self.decision is not None:
            self.decision = YieldDecision(self.decision.peer, Yield.WAIT)

    def restart(self) -> None:
        """Forget all peers, after a jump of the clock."""
        self._tracker.restart()
        self._rules.restart()
        self._stand_off.restart()
        self._roundabout.restart()

    # -- observe -------------------------------------------------------------------------

    def observe(
        self,
        now_s: float,
        pose: Optional[Pose2D],
        local_from_global: Optional[Pose2D],
        peers: Sequence[Peer],
        cruise_mps: float,
        tracks: Optional[Tracks] = None,
    ) -> List[str]:
        """Update the peers and their costs in both costmaps.

        Args:
            now_s: Time of the update.
            pose: Pose of the robot in ``map``, None if unknown.
            local_from_global: Transform from ``map`` to the frame of the local costmap, None if
                unknown.
            peers: All peers with a known pose, however old.
            cruise_mps: Speed at which robots are expected to fly.
            tracks: Moving obstacles in the frame of the local costmap, None if nothing tracks
                them.

        Returns:
            Messages about peers that were lost or came back, for the log.
        """
        self._tracks = tracks is not None
        self._tracker.cruise_mps = cruise_mps
        messages = self._tracker.observe(
            now_s,
            pose,
            peers if self.params.avoid_peers else (),
            self.params.margin_m,
            self.params.timeout_s,
        )
        messages += self._update_roundabout(now_s, pose, peers)
        if pose is not None and local_from_global is not None:
            in_map = None if tracks is None else _in_map(tracks, local_from_global)
            self._update_costs(pose, local_from_global)
            self._observe_obstacles(now_s, pose, in_map)
        return messages

    def _update_roundabout(
        self, now_s: float, pose: Optional[Pose2D], peers: Sequence[Peer]
    ) -> List[str]:
        if not (self.params.avoid_peers and self.params.roundabouts):
            self._roundabout.restart()
        elif pose is not None:
            return self._roundabout.update(now_s, pose, peers, self.params.timeout_s)
        return []

    def _update_costs(self, pose: Pose2D, local_from_global: Pose2D) -> None:
        in_roundabout = self._roundabout.centre is not None
        costs = bool(self._tracker.peers) or in_roundabout
        if costs or self._has_costs:
            self._costs.update(pose, local_from_global, self.priority)
        self._has_costs = costs

    def _observe_obstacles(self, now_s: float, pose: Pose2D, tracks: Optional[Tracks]) -> None:
        if tracks is None or not self.params.yield_to_moving_obstacles:
            if self._stand_off.is_watching:
                self._stand_off.restart()
            return
        self._stand_off.observe(now_s, pose, tracks.states[:, :2])

    # -- decide --------------------------------------------------------------------------

    def decide(self, now_s: float, pose: Pose2D, goal: Optional[Pose2D]) -> PeerAdvice:
        """Decide whether a robot with a goal in ``map``, or an idle one, yields.

        ``decision`` holds the result.
        """
        if goal is None:
            return self._decide_idle(now_s, pose)
        before = self.decision
        if not self._tracker.peers and before is None and self._stand_off.obstacle is None:
            return PeerAdvice()
        messages = self._give_up_priority(now_s, pose) if self._tracker.peers or before else ()
        for_obstacle = before if before is not None and before.peer == MOVING_OBSTACLE else None
        self.decision = self._rules.decide(
            now_s,
            pose,
            self._path,
            _straight_to(goal),
            self.priority,
            before if for_obstacle is None else None,
        )
        if self.decision is None:
            self.decision = self._stand_off.decide(
                now_s, pose, self._path, for_obstacle, self.params.moving_obstacle_patience_s
            )
        if self.decision != before:
            messages += (str(self.decision or "path clear, resuming goal"),)
        replan = self.holding_point != (before.holding_point if before is not None else None)
        return PeerAdvice(messages, replan)

    def waits_at(self, pose: Pose2D) -> bool:
        """Return whether the robot stands still for a peer, on its path or a holding point."""
        if self.decision is None:
            return False
        point = self.decision.holding_point
        return point is None or pose.distance_to(point) <= _AT_HOLDING_POINT_M

    def _decide_idle(self, now_s: float, pose: Pose2D) -> PeerAdvice:
        """Begin a yielding manoeuvre of a robot without a goal, if it is on a peer's path."""
        if not self.params.yield_when_idle or not self._tracker.peers:
            return PeerAdvice()
        decision = self._rules.decide(now_s, pose, NO_PATH, NO_PATH, self.priority, None)
        parking_pose = self.parking_pose
        if decision is not None and decision.holding_point is not None:
            parking_pose = parking_pose or pose
        elif parking_pose is None or decision is not None or not self._rules.is_free(parking_pose):
            return PeerAdvice()
        self.end_goal()
        self.decision, self.parking_pose, self.is_yield_manoeuvre = decision, parking_pose, True
        self._path = _straight_to(parking_pose)
        message = str(decision or "path clear, returning to its parking pose")
        return PeerAdvice((message,), manoeuvre_goal=parking_pose)

    def _give_up_priority(self, now_s: float, pose: Pose2D) -> Tuple[str, ...]:
        """Give a robot that goes first and makes no progress the lowest priority of all goals."""
        self._progress.has_moved(now_s, pose, _PROGRESS_M)
        if self.decision is not None or self.is_yield_manoeuvre:
            self._progress.restart(now_s)
        if not self._progress.exceeds(now_s, GIVE_UP_PRIORITY_AFTER_S):
            return ()
        self._progress.restart(now_s)
        self._goal_set_s = now_s
        return (f"no progress for {GIVE_UP_PRIORITY_AFTER_S:g} s, giving up priority",)

    # -- limit ---------------------------------------------------------------------------

    def cell(self, pose: Pose2D, velocity: Twist2D, control_period_s: float) -> Cell:
        """Return the robot's Voronoi cell, inside of which its commands are safe.

        Where moving obstacles are tracked, a peer that went silent a moment ago bounds it, too.

        Args:
            pose: Pose of the robot in ``map``.
            velocity: Current velocity in the robot's frame.
            control_period_s: Period of commands; the next one may come later by a latency.
        """
        tracker = self._tracker
        peers = [*tracker.peers, *tracker.silent] if self._tracks else tracker.peers
        hold_s = control_period_s + LATENCY_S
        return Cell(pose, velocity, peers, tracker.safety_radius_m, hold_s)

    def is_blocked(self, now_s: float, pose: Pose2D) -> bool:
        """Return whether limited commands have kept the robot in place; then restart the count.

        To be called for each limited command.
        """
        self._limited.has_moved(now_s, pose, _PROGRESS_M)
        if not self._limited.exceeds(now_s, REPLAN_AFTER_S):
            return False
        self._limited.restart(now_s)
        return True


def _in_map(tracks: Tracks, local_from_global: Pose2D) -> Tracks:
    if not len(tracks) or local_from_global == Pose2D(0.0, 0.0):
        return tracks
    return tracks.transformed(local_from_global.inverse())


def _straight_to(goal: Pose2D) -> NDArray[np.float64]:
    return np.array([[goal.x_m, goal.y_m]])
