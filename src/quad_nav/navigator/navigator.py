"""The navigator: one robot's move_base without ROS.

``Navigator.tick`` does what is due at a time: update a costmap, search for a plan, run a
control cycle. It owns no clock and no thread; the caller ticks it at ``next_due_s`` or more
often.
"""

from __future__ import annotations

import math
from typing import Any, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.controller import LocalPlanner
from quad_nav.costmap.cost_grid import Square
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.map_edge import closed_edge
from quad_nav.costmap.tracks import Tracks
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.navigator.command_filter import (
    Command,
    CommandFilter,
    CommandFilters,
    Situation,
    StopReason,
)
from quad_nav.navigator.control_supervisor import ControlSupervisor
from quad_nav.navigator.costmap_updates import CostmapUpdates
from quad_nav.navigator.params import NavigatorParams
from quad_nav.navigator.recovery_sequence import NamedRecovery, RecoverySequence
from quad_nav.navigator.state_machine import StateMachine
from quad_nav.navigator.tick import RobotPoses, State, Tick
from quad_nav.peers.coordinator import PeerCoordinator
from quad_nav.peers.peer import Peer
from quad_nav.peers.peer_tracker import CRUISE_MPS
from quad_nav.plan.planner import GlobalPlanner, plan_near
from quad_nav.timing import Schedule

_IDLE_CHECK_HZ = 4.0  # of whether an idle robot is on the path of a peer


class Navigator(StateMachine):
    """Navigator of one robot: its state machine, fed and ticked.

    The caller gives observations to the layers of the costmaps; the navigator updates the
    costmaps at their frequency.

    Attributes:
        global_costmap: Costmap of the global planner.
        local_costmap: Costmap of the local planner.
        controller: The local planner.
        peers: Coordination with the other robots.
        filters: The command filters.
    """

    def __init__(
        self,
        params: NavigatorParams,
        global_costmap: LayeredCostmap,
        local_costmap: LayeredCostmap,
        planner: GlobalPlanner,
        controller: LocalPlanner,
        recoveries: Sequence[NamedRecovery],
        peers: PeerCoordinator,
        filters: Sequence[CommandFilter] = (),
    ) -> None:
        """Create an idle navigator; recoveries and filters are in the order in which they run."""
        self.global_costmap, self.local_costmap = global_costmap, local_costmap
        self.controller = controller
        self.peers = peers
        self.filters = CommandFilters(filters, params.controller_frequency_hz)
        costmaps = global_costmap, local_costmap
        super().__init__(
            params,
            *costmaps,
            CostmapUpdates(*costmaps),
            planner,
            ControlSupervisor(controller),
            RecoverySequence(recoveries, *costmaps),
            peers,
        )
        self._idle_check = Schedule(_IDLE_CHECK_HZ)
        self._started = False
        self._stop_wanted: Optional[StopReason] = None

    @property
    def recoveries(self) -> Tuple[NamedRecovery, ...]:
        """The recovery behaviours in the order in which they run."""
        return self._recovery.recoveries

    @property
    def recoveries_done(self) -> int:
        """Number of recovery behaviours that have run for what fails now."""
        return self._recovery.done

    # -- changes in flight ---------------------------------------------------------------

    def set_params(self, params: NavigatorParams) -> None:
        """Change the parameters."""
        self.params = params

    def set_planner(self, planner: GlobalPlanner) -> None:
        """Replace the global planner by one of its kind; the plan in flight stays."""
        self.planner = planner

    def change_planner(self, planner: GlobalPlanner) -> None:
        """Change to another global planner: the robot stops and plans anew."""
        self.planner = planner
        self._stop_and_plan_anew()

    def change_controller(self, controller: LocalPlanner) -> None:
        """Change to another local planner: the robot stops and plans anew."""
        self.controller = controller
        self._control.change_controller(controller)
        self._stop_and_plan_anew()

    def _stop_and_plan_anew(self) -> None:
        self._stop_wanted = StopReason.NO_PLAN
        self.plan_anew()

    def set_controller_params(self, params: Any) -> None:
        """Change the local planner's parameters; limits of recoveries stay in force."""
        self._control.limiter.set_params(params)

    # -- goals ---------------------------------------------------------------------------

    def accepts_goal(self, now_s: float) -> bool:
        """Return whether a new goal or a cancel takes effect now.

        As in move_base, an active goal is replaced or cancelled at the next control cycle only.
        """
        if self.is_blocked_by_recovery:
            return False
        return self.state is State.IDLE or self.is_cycle_due(now_s)

    def set_goal(self, goal: Optional[Pose2D], now_s: float) -> None:
        """Head for a pose in the global costmap's frame, from this cycle on; None if unknown."""
        if goal is not None:
            self.peers.start_goal(goal, now_s)
        self._stop_wanted = None
        self.start_goal(goal, now_s)

    def cancel(self) -> None:
        """Drop the goal; the next tick publishes a stop."""
        if self.state is not State.IDLE:
            self._stop_wanted = StopReason.CANCELLED
        self.end_goal()

    # -- time ----------------------------------------------------------------------------

    @property
    def next_due_s(self) -> float:
        """Time at which the next tick has something to do; -inf before the first."""
        if not self._started:
            return -math.inf
        due_s = math.inf if self._costmaps_rest else self._updates.due_s
        due_s = min(due_s, self._control.limiter.due_s)
        if self.state is not State.IDLE:
            return min(due_s, self.due_s)
        due_s = min(due_s, self.filters.idle_due_s)
        return min(due_s, self._idle_check.due_s) if self.peers.params.avoid_peers else due_s

    @property
    def has_work(self) -> bool:
        """True if a tick is due at once: the first one, or one that publishes a stop."""
        return not self._started or self._stop_wanted is not None

    def restart(self, now_s: float) -> None:
        """Restart schedules, patience and costmaps after the clock has jumped back."""
        goal = None if self.peers.is_yield_manoeuvre else self.goal
        self.end_goal()
        self._start_idle_checks(now_s)
        self.peers.restart()
        self._updates.start(now_s)
        self.clear_costmaps(now_s)
        self._control.limiter.lift()
        self.filters.reset()
        if goal is not None:
            self.set_goal(goal, now_s)

    def tick(
        self,
        now_s: float,
        poses: RobotPoses,
        velocity: Twist2D,
        peers: Sequence[Peer] = (),
        tracks: Optional[Tracks] = None,
    ) -> Tick:
        """Do what is due.

        Args:
            now_s: Time of the step.
            poses: Poses of the robot in the costmaps' frames.
            velocity: Velocity of the odometry, in the robot's frame.
            peers: The other robots with a known pose.
            tracks: Moving obstacles in the local costmap's frame, None if nothing tracks them.
        """
        if not self._started:
            self._started = True
            self._start_idle_checks(now_s)
            self._updates.start(now_s)
        tick = Tick(now_s)
        self._observe_peers(tick, poses, peers, tracks)
        if not self._costmaps_rest:
            self._updates.update(tick, poses)
        if poses.in_global is not None:
            self._control.limiter.check(now_s, poses.in_global)
        self._propose(tick, poses, velocity)
        proposed = tick.command
        self._filter(tick, poses, velocity, tracks)
        self._stop_without_data(tick, poses, proposed)  # last: nothing overrides it
        if tick.command is not None:
            self.filters.last = tick.command
        if tick.is_stopped:
            self.filters.reset()
        tick.state = self.state
        tick.yielding = self.peers.decision
        tick.goal = None if self.peers.is_yield_manoeuvre else self.goal
        tick.velocity = velocity
        return tick

    def _propose(self, tick: Tick, poses: RobotPoses, velocity: Twist2D) -> None:
        """Plan, control and recover, as far as it is due."""
        if self._stop_wanted is not None:
            tick.halt(self._stop_wanted)
            self._stop_wanted = None
        if self.state is State.IDLE and self._idle_check.pop(tick.now_s):
            self._make_room_when_idle(tick, poses.in_global)
        if self.state is not State.IDLE:
            self.run(tick, poses, velocity)

    def _filter(
        self, tick: Tick, poses: RobotPoses, velocity: Twist2D, tracks: Optional[Tracks]
    ) -> None:
        """Pass the command through the filters."""
        frequency_hz, is_idle = self.params.controller_frequency_hz, self.state is State.IDLE
        is_idle_cycle = self.filters.pop_idle_cycle(tick.now_s, frequency_hz) and is_idle
        if tick.is_stopped or poses.local_from_global is None:
            return
        given = None if tick.command is None else Command(tick.command, tick.stop)
        if given is None:
            if not is_idle_cycle or self.missing_data(tick.now_s, poses):
                return
        command = self.filters.filter(given, self._situation(tick, poses, velocity, tracks))
        if command is None:
            return
        tick.command, tick.stop = command.velocity, command.stop
        tick.limited_by = command.limited_by
        if tick.limited_by:
            self.hold_back(tick, poses.in_global)

    def _situation(
        self, tick: Tick, poses: RobotPoses, velocity: Twist2D, tracks: Optional[Tracks]
    ) -> Situation:
        assert poses.in_local is not None and poses.in_global is not None
        local_from_global = poses.local_from_global
        assert local_from_global is not None
        follows = tick.control is not None and self.state is State.CONTROLLING
        return Situation(
            tick.now_s,
            1.0 / self.params.controller_frequency_hz,
            poses.in_local,
            poses.in_global,
            local_from_global,
            velocity,
            self.filters.last,
            self._control.plan if follows else None,
            self.local_costmap,
            self._control.limiter.usual,
            tracks,
            self.peers,
        )

    def _stop_without_data(
        self, tick: Tick, poses: RobotPoses, proposed: Optional[Twist2D]
    ) -> None:
        """Stop a robot that does not know where it is or what is around it."""
        command = tick.command or self.filters.last
        if command.is_zero or (tick.command is None and self.state is not State.IDLE):
            return  # it stands, or the next control cycle stops it
        recovers = tick.command is not None and tick.command is proposed
        if recovers and not self.stops_without_data:
            return  # a recovery goes on, as upstream
        missing = self.missing_data(tick.now_s, poses)
        if missing:
            self.stop_without_data(tick, missing)

    def _start_idle_checks(self, now_s: float) -> None:
        self._idle_check.start(now_s)
        self.filters.start(now_s)

    def _observe_peers(
        self, tick: Tick, poses: RobotPoses, peers: Sequence[Peer], tracks: Optional[Tracks]
    ) -> None:
        cruise_mps = getattr(self._control.limiter.usual, "max_vel_x_mps", CRUISE_MPS)
        tick.notes += self.peers.observe(
            tick.now_s, poses.in_global, poses.local_from_global, peers, cruise_mps, tracks
        )

    def _make_room_when_idle(self, tick: Tick, pose: Optional[Pose2D]) -> None:
        if pose is None:
            return
        advice = self.peers.decide(tick.now_s, pose, None)
        tick.notes += advice.messages
        if advice.manoeuvre_goal is not None:
            self.start_goal(advice.manoeuvre_goal, tick.now_s)

    # -- costmaps ------------------------------------------------------------------------

    @property
    def _costmaps_rest(self) -> bool:
        return self.params.shutdown_costmaps and self.state is State.IDLE

    def clear_costmaps(self, now_s: float) -> None:
        """Reset the layers of both costmaps, as the service ``~clear_costmaps`` does."""
        self.global_costmap.reset_layers(now_s)
        self.local_costmap.reset_layers(now_s)

    def free_surroundings(self, poses: RobotPoses, radius_m: float) -> None:
        """Mark the square around the robot as free until the next updates."""
        costmaps = self.global_costmap, self.local_costmap
        for costmap, pose in zip(costmaps, (poses.in_global, poses.in_local)):
            if pose is not None:
                costmap.free_square(Square(pose.x_m, pose.y_m, 2.0 * radius_m))

    # -- planning ------------------------------------------------------------------------

    def make_plan(self, start: Pose2D, goal: Pose2D) -> NDArray[np.float64]:
        """Plan between two poses without flying.

        Returns:
            The plan, float64[n, 3] of (x_m, y_m, yaw_rad) in the global costmap's frame.

        Raises:
            PlanningError: There is no plan.
        """
        return self.plan_near(start, goal, 0.0)[0]

    def plan_near(
        self, start: Pose2D, goal: Pose2D, tolerance_m: float
    ) -> Tuple[NDArray[np.float64], bool]:
        """Plan without flying, to a point beside the goal if need be; see ``plan.planner``."""
        costmap = self.global_costmap
        with closed_edge(costmap, start, goal, self.params.plan_inside_map):
            return plan_near(self.planner, costmap.spec, costmap.costs, start, goal, tolerance_m)
