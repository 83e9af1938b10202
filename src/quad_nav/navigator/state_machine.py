"""move_base's state machine: planning, control and recoveries of one goal.

The states and their transitions are those of ROS's move_base. PLANNING lasts until there is a
plan, CONTROLLING follows it. CLEARING runs the next recovery behaviour when planning or control
has failed for its patience or the robot oscillates; PLANNING follows. ``docs/upstream_bugs.md``
lists the differences from upstream.
"""

from __future__ import annotations

import math
from typing import Optional

from quad_nav.control.escape import escape
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.map_edge import closed_edge
from quad_nav.errors import NoPath, PlanningError
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.navigator.command_filter import StopReason
from quad_nav.navigator.control_supervisor import ControlSupervisor, StuckAction
from quad_nav.navigator.costmap_updates import CostmapUpdates
from quad_nav.navigator.params import NavigatorParams
from quad_nav.navigator.plan_search import PlanSearch
from quad_nav.navigator.recovery_sequence import RecoverySequence
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
        goal: Goal pose in the global costmap's frame, None if the robot is idle or it is unknown.
    """

    def __init__(
        self,
        params: NavigatorParams,
        global_costmap: LayeredCostmap,
        local_costmap: LayeredCostmap,
        updates: CostmapUpdates,
        planner: GlobalPlanner,
        control: ControlSupervisor,
        recovery: RecoverySequence,
        peers: PeerCoordinator,
    ) -> None:
        """Create an idle state machine of these parts."""
        self.params = params
        self.planner = planner
        self.state = State.IDLE
        self.goal: Optional[Pose2D] = None
        self._control, self._recovery = control, recovery
        self._global, self._local = global_costmap, local_costmap
        self._updates = updates
        self._peers = peers
        self._search = PlanSearch(params.planner_frequency_hz)
        self._cycle = Schedule(params.controller_frequency_hz)
        self._starts_from_rest = False  # no control cycle since an idle robot took a goal
        self._recovery_overruns = False  # the last control cycle fell into a recovery

    # -- goals ---------------------------------------------------------------------------

    def start_goal(self, goal: Optional[Pose2D], now_s: float) -> None:
        """Head for a pose in the global costmap's frame, from this cycle on.

        None is a pose that is not known, for which there is no plan.
        """
        if self.state is State.IDLE:
            self._cycle.start(now_s)
            self._starts_from_rest = True
        self.goal = goal
        self._recovery.reset()
        self._control.reset()
        self._begin_planning(now_s)
        self._control.start(now_s)

    def _finish(self, tick: Tick, outcome: Outcome) -> None:
        if not self._peers.is_yield_manoeuvre:
            tick.outcome = outcome
        else:
            self._peers.end_manoeuvre(outcome.succeeded)
            failed = f"yielding manoeuvre failed: {outcome.text}"
            tick.notes.append("back at its parking pose" if outcome.succeeded else failed)
        tick.halt(StopReason.GOAL_ENDED)
        self.end_goal()

    def end_goal(self) -> None:
        """Drop the goal; the robot is idle."""
        self.state = State.IDLE
        self.goal = None
        self._search.drop()
        self._recovery.stop()
        self._peers.end_goal()
        self._cycle.due_s = math.inf

    def plan_anew(self) -> None:
        """Drop the plan and the recoveries of the goal, if there is one; plan in the next cycle."""
        self._search.drop()
        self._recovery.reset()
        if self.state is not State.IDLE:
            self.state = State.PLANNING

    # -- time ----------------------------------------------------------------------------

    @property
    def due_s(self) -> float:
        """Time at which ``run`` has something to do; +inf for an idle robot."""
        if self.state is State.IDLE:
            return math.inf
        due_s = min(self._cycle.due_s, self._recovery.due_s)
        if not self.params.command_in_first_cycle:
            return min(due_s, self._search.thread.due_s)
        return min(due_s, self._search.due_s) if self.state is State.CONTROLLING else due_s

    def is_cycle_due(self, now_s: float) -> bool:
        """Return whether a control cycle is due."""
        return is_due(self._cycle.due_s, now_s)

    def run(self, tick: Tick, poses: RobotPoses, velocity: Twist2D) -> None:
        """Do what is due for the goal: search a plan, recover, control. The tick has it all."""
        self._cycle.set_frequency(self.params.controller_frequency_hz, tick.now_s)
        self._search.set_frequency(self.params.planner_frequency_hz, tick.now_s)
        if self._is_search_due(tick.now_s):
            self._search_plan(tick, poses.in_global)
        if self.is_blocked_by_recovery:
            self._recovery_overruns |= self._cycle.pop(tick.now_s)
            self._continue_recovery(tick, poses)
        else:
            if self._recovery.is_running:
                self._continue_recovery(tick, poses)
            self._run_due_cycle(tick, poses, velocity)
        if not self.params.command_in_first_cycle and self._search.thread.is_due(tick.now_s):
            self._search_plan(tick, poses.in_global)

    def _run_due_cycle(self, tick: Tick, poses: RobotPoses, velocity: Twist2D) -> None:
        if self._cycle.pop(tick.now_s):
            tick.cycle = True
            self._recovery_overruns = self._recovery.is_running
            self._run_control_cycle(tick, poses, velocity)
            self._starts_from_rest = False

    def hold_back(self, tick: Tick, pose: Optional[Pose2D]) -> None:
        """Take note that a command filter holds the robot back, at a pose."""
        self._control.restart_timers(tick.now_s)
        if pose is None or self.state is not State.CONTROLLING:
            return
        if self._peers.is_blocked(tick.now_s, pose):
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
                raise PlanningError(f"{'goal' if target is None else 'robot'} pose unknown")
            with closed_edge(costmap, start, target, self.params.plan_inside_map):
                tick.plan = self.planner.make_plan(costmap.spec, costmap.costs, start, target)
        except PlanningError as error:
            tick.planning_failed, tick.no_path = str(error), isinstance(error, NoPath)
            if self._peers.holding_point is not None:
                self._peers.reject_holding_point()
            if self.state is State.PLANNING and self._search.fail(tick.now_s, self.params):
                self._enter_clearing(tick, Trigger.PLANNING)
            return
        self._peers.follow_plan(tick.plan)
        self._search.succeed(tick.plan, self.state, tick.now_s)
        if not self._recovery.is_running:
            self.state = State.CONTROLLING

    # -- control -------------------------------------------------------------------------

    def _run_control_cycle(self, tick: Tick, poses: RobotPoses, velocity: Twist2D) -> None:
        if (
            poses.in_global is not None
            and poses.in_local is not None
            and self._control.track(tick.now_s, poses.in_global, self.params.oscillation_distance_m)
        ):
            self._recovery.reset_after(Trigger.OSCILLATION)
        if self.stops_without_data:
            missing = self.missing_data(tick.now_s, poses)
        else:  # upstream goes on without a pose: planning and control fail, and recoveries follow
            missing = self._updates.outdated_reason(tick.now_s)
        if missing:
            self.stop_without_data(tick, missing)
            return
        if poses.in_global is not None and self._yield_to_peers(tick, poses.in_global):
            return
        plan = self._search.pop_plan()
        if plan is not None:
            self._control.set_plan(plan)
            self._recovery.reset_after(Trigger.PLANNING)
        if self.state is State.CONTROLLING:
            self._follow_plan(tick, poses, velocity)
        elif self.state is State.CLEARING and not self._recovery.is_running:
            self._start_recovery(tick, poses)
        elif self.state is State.PLANNING:
            self._search.notify_thread()
            if self.params.stop_while_planning or self._starts_from_rest:
                tick.halt(StopReason.NO_PLAN)

    def missing_data(self, now_s: float, poses: RobotPoses) -> str:
        """Return what a robot that moves has to know and this one does not, "" if nothing."""
        if poses.in_global is None or poses.in_local is None:
            return poses.unknown_reason or "robot pose unknown"
        return self._updates.outdated_reason(now_s)

    def stop_without_data(self, tick: Tick, reason: str) -> None:
        """Command a stop for lack of data, and warn."""
        tick.warnings.append(f"stopping: {reason}")
        tick.halt(StopReason.NO_DATA)
        if self.stops_without_data:
            self._control.restart_timers(tick.now_s)

    @property
    def stops_without_data(self) -> bool:
        """Without data, upstream continues recoveries, and the patience runs out."""
        return self.params.sensor_timeout_s > 0.0

    def _follow_plan(self, tick: Tick, poses: RobotPoses, velocity: Twist2D) -> None:
        params = self.params
        if self._control.is_goal_reached():
            if self._peers.holding_point is None:
                self._finish(tick, Outcome(True, "Goal reached."))
            else:
                tick.halt(StopReason.PEER)
            return
        if self._control.is_oscillating(tick.now_s, params.oscillation_timeout_s):
            self._enter_clearing(tick, Trigger.OSCILLATION)
            if params.interrupt_recoveries:
                return
        if poses.in_global is None or poses.in_local is None:
            self._miss_command(tick, None)
            return
        action = self._control.check_progress(
            tick, poses.in_global, params.progress, params.oscillation_distance_m
        )
        if action is StuckAction.RECOVER:
            self._enter_clearing(tick, Trigger.OSCILLATION)
        elif action is StuckAction.REPLAN:
            tick.halt(StopReason.NO_PROGRESS)
            self._begin_planning(tick.now_s)
        elif self._control.compute_velocity(tick, self._local, poses, velocity):
            self._recovery.reset_after(Trigger.CONTROLLING)
        else:
            self._miss_command(tick, poses.in_local)

    def _miss_command(self, tick: Tick, pose: Optional[Pose2D]) -> None:
        """Plan anew, or recover after a while: the local planner has no command."""
        if self._control.is_patience_exhausted(tick.now_s, self.params.controller_patience_s):
            self._enter_clearing(tick, Trigger.CONTROLLING)
            return
        tick.halt(StopReason.NO_TRAJECTORY)
        if self.params.escape_collision and pose is not None:
            local = self._local
            way_out = escape(local.spec, local.costs, local.footprint, pose)
            tick.steer(way_out or Twist2D())
        self._begin_planning(tick.now_s)

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
            self._control.restart_timers(tick.now_s)
        if not self._peers.waits_at(pose):
            return False
        tick.halt(StopReason.PEER)
        return True

    # -- recovery ------------------------------------------------------------------------

    def _enter_clearing(self, tick: Tick, trigger: Trigger) -> None:
        if self._peers.is_yield_manoeuvre:
            self._finish(tick, Outcome(False, trigger.value))
            return
        self.state = State.CLEARING
        self._recovery.trigger = trigger
        if trigger is Trigger.PLANNING:
            self._search.thread.stop()
        tick.halt(StopReason.RECOVERY)

    def _start_recovery(self, tick: Tick, poses: RobotPoses) -> None:
        assert self._recovery.trigger is not None
        if self.params.recovery_behavior_enabled and self._recovery.start(tick, poses):
            self._step_recovery(tick, poses)
        else:
            self._finish(tick, Outcome(False, self._failure_text(self._recovery.trigger)))

    def _failure_text(self, trigger: Trigger) -> str:
        """Return move_base's text, with what it leaves to be guessed."""
        costmap, goal = self._global, self.goal
        is_off = goal is not None and costmap.spec.cell_of(goal.x_m, goal.y_m) is None
        if trigger is Trigger.PLANNING and costmap.params.rolling_window and is_off:
            extent = costmap.spec.extent
            return f"{trigger.value} The goal is off the rolling global costmap, {extent}."
        return trigger.value

    @property
    def is_blocked_by_recovery(self) -> bool:
        """True while a recovery delays goals and control cycles, as upstream."""
        return self._recovery.is_running and not self.params.interrupt_recoveries

    def _continue_recovery(self, tick: Tick, poses: RobotPoses) -> None:
        if self.stops_without_data and self.missing_data(tick.now_s, poses):
            self._recovery.pause(tick.now_s)
        else:
            self._step_recovery(tick, poses)

    def _step_recovery(self, tick: Tick, poses: RobotPoses) -> None:
        if self._recovery.step(tick, poses, self._control.limiter):
            self._control.end_recovery(tick.now_s)
            self._begin_planning(tick.now_s, wakes_thread=False)
            if self._recovery_overruns and not self.params.command_in_first_cycle:
                self._cycle.start(tick.now_s)  # upstream's recoveries delay its control cycles
