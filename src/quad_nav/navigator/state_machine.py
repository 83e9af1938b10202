"""move_base's state machine: planning, control and recoveries of one goal.

The states and their transitions are those of ROS's move_base. PLANNING lasts until there is a
plan, CONTROLLING follows it. CLEARING runs the next recovery behaviour when planning or control
has failed for its patience or the robot oscillates; PLANNING follows. ``docs/upstream_bugs.md``
lists the differences from upstream.
"""

from __future__ import annotations

import math
from typing import Optional, Sequence

from quad_nav.control.controller import LocalPlanner
from quad_nav.control.moving_discs import MovingDiscs
from quad_nav.control.neighbours import NO_NEIGHBOURS, Neighbours
from quad_nav.control.prediction import NO_DISCS
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.map_edge import closed_edge
from quad_nav.errors import PlanningError
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.navigator.control_supervisor import ControlSupervisor, StuckAction, escape_command
from quad_nav.navigator.costmap_updates import CostmapUpdates
from quad_nav.navigator.evasion_guard import EvasionGuard, speed_limits
from quad_nav.navigator.params import NavigatorParams
from quad_nav.navigator.plan_search import PlanSearch
from quad_nav.navigator.recovery_sequence import NamedRecovery, RecoverySequence
from quad_nav.navigator.tick import Outcome, RobotPoses, State, Tick, Trigger
from quad_nav.peers.coordinator import PeerCoordinator
from quad_nav.plan.planner import GlobalPlanner
from quad_nav.timing import Schedule, is_due


class StateMachine:
    """The states of one robot and their transitions.

    Attributes:
        params: The parameters; they may change in flight.
        planner: The global planner; it may be replaced in flight.
        state: The state.
        goal: Goal pose in the global costmap's frame, None if the robot is idle.
        control: Supervisor of the local planner.
        recovery: The recovery behaviours.
        guard: Evasion of moving obstacles.
    """

    def __init__(
        self,
        params: NavigatorParams,
        global_costmap: LayeredCostmap,
        local_costmap: LayeredCostmap,
        updates: CostmapUpdates,
        planner: GlobalPlanner,
        controller: LocalPlanner,
        recoveries: Sequence[NamedRecovery],
        peers: PeerCoordinator,
    ) -> None:
        """Create an idle state machine.

        Args:
            params: The parameters.
            global_costmap: Costmap of the global planner.
            local_costmap: Costmap of the local planner.
            updates: Updates of both costmaps.
            planner: The global planner.
            controller: The local planner.
            recoveries: The recovery behaviours in the order in which they run.
            peers: Coordination with the other robots.
        """
        self.params = params
        self.planner = planner
        self.state = State.IDLE
        self.goal: Optional[Pose2D] = None
        self.control = ControlSupervisor(controller)
        self.recovery = RecoverySequence(recoveries, global_costmap, local_costmap)
        self._global, self._local = global_costmap, local_costmap
        self.guard = EvasionGuard(params.evasion, local_costmap, self._period_s)
        self._updates = updates
        self._peers = peers
        self._search = PlanSearch(params.planner_frequency_hz)
        self._cycle = Schedule(params.controller_frequency_hz)
        self._starts_from_rest = False  # no control cycle since an idle robot took a goal
        self._recovery_overruns = False  # the last control cycle fell into a recovery

    # -- goals ---------------------------------------------------------------------------

    def start_goal(self, goal: Pose2D, now_s: float) -> None:
        """Head for a pose in the global costmap's frame, from this cycle on."""
        if self.state is State.IDLE:
            self._cycle.start(now_s)
            self._starts_from_rest = True
        self.goal = goal
        self.recovery.reset()
        self.control.reset()
        self._begin_planning(now_s)
        self.control.start(now_s)

    def _finish(self, tick: Tick, outcome: Outcome) -> None:
        if not self._peers.is_yield_manoeuvre:
            tick.outcome = outcome
        else:
            self._peers.end_manoeuvre(outcome.succeeded)
            failed = f"yielding manoeuvre failed: {outcome.text}"
            tick.notes.append("back at its parking pose" if outcome.succeeded else failed)
        tick.command = Twist2D()
        self.end_goal()

    def end_goal(self) -> None:
        """Drop the goal; the robot is idle."""
        self.state = State.IDLE
        self.goal = None
        self._search.drop()
        self.recovery.stop()
        self._peers.end_goal()
        self._cycle.due_s = math.inf

    # -- time ----------------------------------------------------------------------------

    @property
    def due_s(self) -> float:
        """Time at which ``run`` has something to do; +inf for an idle robot."""
        if self.state is State.IDLE:
            return math.inf
        due_s = min(self._cycle.due_s, self.recovery.due_s)
        if not self.params.command_in_first_cycle:
            return min(due_s, self._search.thread.due_s)
        return min(due_s, self._search.due_s) if self.state is State.CONTROLLING else due_s

    def is_cycle_due(self, now_s: float) -> bool:
        """Return whether a control cycle is due."""
        return is_due(self._cycle.due_s, now_s)

    def run(self, tick: Tick, poses: RobotPoses, velocity: Twist2D) -> None:
        """Do what is due for the goal: search a plan, recover, control.

        Args:
            tick: The step; it takes the results.
            poses: Poses of the robot in the costmaps' frames.
            velocity: Velocity of the odometry, in the robot's frame.
        """
        self._cycle.set_frequency(self.params.controller_frequency_hz, tick.now_s)
        self._search.set_frequency(self.params.planner_frequency_hz, tick.now_s)
        if self._is_search_due(tick.now_s):
            self._search_plan(tick, poses.in_global)
        if self.recovery.is_running:
            if self._stops_without_data and self._missing_data(tick.now_s, poses):
                self.recovery.pause(tick.now_s)
            else:
                self._step_recovery(tick, poses)
        if self._cycle.pop(tick.now_s):
            tick.cycle = True
            self._recovery_overruns = self.recovery.is_running
            self._run_control_cycle(tick, poses, velocity)
            self._starts_from_rest = False
        if not self.params.command_in_first_cycle and self._search.thread.is_due(tick.now_s):
            self._search_plan(tick, poses.in_global)

    def evade(self, tick: Tick, poses: RobotPoses, velocity: Twist2D) -> None:
        """Replace a command that moving obstacles threaten; without a goal, hover or evade.

        Without data nobody knows where obstacles are, and an evasion ends with a stop.
        """
        self.guard.params = self.params.evasion
        self.guard.period_s = self._period_s
        limits = speed_limits(self.control.limiter.usual)
        if self.control.tracks is None or limits is None:
            return
        missing = self._missing_data(tick.now_s, poses)
        if missing:
            if self.guard.stop() and not tick.is_stopped:
                self._stop_without_data(tick, missing)
            return
        follows = tick.control is not None and self.state is State.CONTROLLING
        plan = self.control.plan if follows else None
        neighbours = self._neighbours(poses, velocity)
        self.guard.check(tick, poses, velocity, self.control.tracks, plan, limits, neighbours)
        if tick.evades:
            self.control.restart_timers(tick.now_s)

    def _neighbours(self, poses: RobotPoses, velocity: Twist2D) -> Neighbours:
        tracks = self.control.tracks
        if tracks is None or not tracks.any_may_move:
            return NO_NEIGHBOURS
        if poses.in_global is None or poses.local_from_global is None:
            return NO_NEIGHBOURS
        return self._peers.neighbours(
            poses.in_global, velocity, poses.local_from_global, self._period_s
        )

    @property
    def _period_s(self) -> float:
        """Time between two control cycles."""
        return 1.0 / self.params.controller_frequency_hz

    def limit_command(self, tick: Tick, pose: Optional[Pose2D], velocity: Twist2D) -> None:
        """Limit the final command so that it cannot lead to a collision with a peer."""
        if tick.command is None or pose is None or tick.is_stopped:
            return
        limited = self._peers.limit(pose, velocity, tick.command, self._period_s)
        tick.command, tick.limited_by = limited.command, limited.limited_by
        if limited.limited_by:
            self.control.restart_timers(tick.now_s)
            if self.state is State.CONTROLLING and self._peers.is_blocked(tick.now_s, pose):
                self._begin_planning(tick.now_s)  # the peer may stand on the plan

    # -- planning ------------------------------------------------------------------------

    def _begin_planning(self, now_s: float, wakes_thread: bool = True) -> None:
        self.state = State.PLANNING
        self._search.begin(now_s, wakes_thread)

    def _is_search_due(self, now_s: float) -> bool:
        """Return whether to search before the control cycle."""
        if self.params.command_in_first_cycle:
            return self._search.is_due(self.state, now_s, self._cycle.due_s)
        return self._search.is_retry_due(self.state, now_s, self._cycle.due_s)

    def _search_plan(self, tick: Tick, start: Optional[Pose2D]) -> None:
        self._search.start(tick.now_s)
        target = self._peers.holding_point or self.goal
        costmap = self._global
        try:
            if start is None or target is None:
                raise PlanningError("robot pose unknown")
            with closed_edge(costmap, start, target, self.params.plan_inside_map):
                tick.plan = self.planner.make_plan(costmap.spec, costmap.costs, start, target)
        except PlanningError as error:
            tick.planning_failed = str(error)
            if self._peers.holding_point is not None:
                self._peers.reject_holding_point()
            if self.state is State.PLANNING and self._search.fail(tick.now_s, self.params):
                self._enter_clearing(tick, Trigger.PLANNING)
            return
        self._peers.follow_plan(tick.plan)
        self._search.succeed(tick.plan, self.state, tick.now_s)
        if not self.recovery.is_running:
            self.state = State.CONTROLLING

    # -- control -------------------------------------------------------------------------

    def _run_control_cycle(self, tick: Tick, poses: RobotPoses, velocity: Twist2D) -> None:
        if (
            poses.in_global is not None
            and poses.in_local is not None
            and self.control.track(tick.now_s, poses.in_global, self.params.oscillation_distance_m)
        ):
            self.recovery.reset_after(Trigger.OSCILLATION)
        missing = self._missing_data(tick.now_s, poses)
        if missing:
            self._stop_without_data(tick, missing)
            return
        assert poses.in_global is not None
        if self._yield_to_peers(tick, poses.in_global):
            return
        plan = self._search.pop_plan()
        if plan is not None:
            self.control.set_plan(plan)
            self.recovery.reset_after(Trigger.PLANNING)
        if self.state is State.CONTROLLING:
            self._follow_plan(tick, poses, velocity)
        elif self.state is State.CLEARING and not self.recovery.is_running:
            self._start_recovery(tick, poses)
        elif self.state is State.PLANNING:
            self._search.notify_thread()
            if self.params.stop_while_planning or self._starts_from_rest:
                tick.command = Twist2D()

    def _missing_data(self, now_s: float, poses: RobotPoses) -> str:
        """Return what a robot that moves has to know and this one does not, "" if nothing."""
        if poses.in_global is None or poses.in_local is None:
            return poses.unknown_reason or "robot pose unknown"
        return self._updates.outdated_reason(now_s)

    def _stop_without_data(self, tick: Tick, reason: str) -> None:
        tick.warnings.append(f"stopping: {reason}")
        tick.is_stopped = True
        tick.command = Twist2D()
        if self._stops_without_data:
            self.control.restart_timers(tick.now_s)

    @property
    def _stops_without_data(self) -> bool:
        """Without data, upstream continues recoveries, and the patience runs out."""
        return self.params.sensor_timeout_s > 0.0

    def _follow_plan(self, tick: Tick, poses: RobotPoses, velocity: Twist2D) -> None:
        assert poses.in_local is not None and poses.in_global is not None
        params = self.params
        if self.control.is_goal_reached():
            if self._peers.holding_point is None:
                self._finish(tick, Outcome(True, "Goal reached."))
            else:
                tick.command = Twist2D()
            return
        if self.control.is_oscillating(tick.now_s, params.oscillation_timeout_s):
            self._enter_clearing(tick, Trigger.OSCILLATION)
            return
        action = self.control.check_progress(
            tick, poses.in_global, params.progress, params.oscillation_distance_m
        )
        if action is StuckAction.RECOVER:
            self._enter_clearing(tick, Trigger.OSCILLATION)
        elif action is StuckAction.REPLAN:
            tick.command = Twist2D()
            self._begin_planning(tick.now_s)
        elif self.control.compute_velocity(
            tick, self._local, poses, velocity, self._predicted(tick.now_s, poses.in_local)
        ):
            self.recovery.reset_after(Trigger.CONTROLLING)
        elif self.control.is_patience_exhausted(tick.now_s, params.controller_patience_s):
            self._enter_clearing(tick, Trigger.CONTROLLING)
        else:
            tick.command = Twist2D()
            if params.escape_collision:
                tick.command = escape_command(self._local, poses.in_local)
            self._begin_planning(tick.now_s)

    def _predicted(self, now_s: float, pose: Pose2D) -> MovingDiscs:
        """Return the moving obstacles that rollouts are judged against."""
        tracks, usual = self.control.tracks, self.control.limiter.usual
        rollout_s = getattr(usual, "sim_time_s", 0.0)
        if tracks is None or not self.params.evasion.avoid_moving_obstacles:
            return NO_DISCS
        return self.guard.predict(now_s, pose, tracks, rollout_s)

    # -- peers ---------------------------------------------------------------------------

    def _yield_to_peers(self, tick: Tick, pose: Pose2D) -> bool:
        """Return whether the robot stands still for a peer; it flies to a holding point first."""
        if self.goal is None or self.state not in (State.PLANNING, State.CONTROLLING):
            return False
        advice = self._peers.decide(tick.now_s, pose, self.goal)
        tick.notes += advice.messages
        if advice.replan:
            self._begin_planning(tick.now_s)
            self._search_plan(tick, pose)
        if self._peers.decision is not None:
            self.control.restart_timers(tick.now_s)
        if not self._peers.waits_at(pose):
            return False
        tick.command = Twist2D()
        return True

    # -- recovery ------------------------------------------------------------------------

    def _enter_clearing(self, tick: Tick, trigger: Trigger) -> None:
        if self._peers.is_yield_manoeuvre:
            self._finish(tick, Outcome(False, trigger.value))
            return
        self.state = State.CLEARING
        self.recovery.trigger = trigger
        if trigger is Trigger.PLANNING:
            self._search.thread.stop()
        tick.command = Twist2D()

    def _start_recovery(self, tick: Tick, poses: RobotPoses) -> None:
        assert self.recovery.trigger is not None
        if self.params.recovery_behavior_enabled and self.recovery.start(tick, poses):
            self._step_recovery(tick, poses)
        else:
            self._finish(tick, Outcome(False, self.recovery.trigger.value))

    def _step_recovery(self, tick: Tick, poses: RobotPoses) -> None:
        if self.recovery.step(tick, poses, self.control.limiter):
            self.control.end_recovery(tick.now_s)
            self._begin_planning(tick.now_s, wakes_thread=False)
            if self._recovery_overruns and not self.params.command_in_first_cycle:
                self._cycle.start(tick.now_s)  # upstream's recoveries delay its control cycles
