"""move_base's state machine: which of planning, driving and recovering is on.

``Navigator.tick`` does whatever is due at a time: update a costmap, look for a
plan, run a control cycle. It owns no clock and no thread; the caller ticks it
at ``next_due_s`` or more often.

The states and their transitions are those of ROS's move_base: PLANNING until
there is a plan, CONTROLLING along it, CLEARING (one recovery behaviour after
the other) when planning or control has failed for its patience or the robot
oscillates, and then PLANNING again. What differs, and why, is in
``docs/upstream_bugs.md``.
"""

from __future__ import annotations

import math
from typing import Any, Optional, Sequence, Tuple

import numpy as np

from quad_nav.control.controller import LocalPlanner
from quad_nav.control.escape import escape
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.errors import ControlError, PlanningError
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.navigator.costmap_updates import CostmapUpdates
from quad_nav.navigator.parameter_limiter import ParameterLimiter
from quad_nav.navigator.params import NavigatorParams
from quad_nav.navigator.progress_checker import (
    ProgressChecker,
    StuckAction,
    relaxed_obstacle_weight,
)
from quad_nav.navigator.recovery_sequence import NamedRecovery, RecoverySequence
from quad_nav.navigator.tick import Outcome, RobotPoses, State, Tick, Trigger, local_from_global
from quad_nav.peers.coordinator import Yielding
from quad_nav.peers.params import PeerParams
from quad_nav.peers.peer import Intention, Peer
from quad_nav.peers.traffic import CRUISING_MPS, Traffic
from quad_nav.plan.near import plan_near
from quad_nav.plan.planner import GlobalPlanner
from quad_nav.recovery import RecoveryContext
from quad_nav.timing import Schedule, StallTimer

__all__ = ["Navigator", "NavigatorParams"]

PEER_WATCH_HZ = 4.0  # how often an idle robot looks whether it is in the way


class Navigator:
    """One robot's move_base.

    The costmaps are given observations by the caller (through their layers);
    the navigator updates them when their update frequency says so.
    """

    def __init__(
        self,
        params: NavigatorParams,
        global_costmap: LayeredCostmap,
        local_costmap: LayeredCostmap,
        planner: GlobalPlanner,
        controller: LocalPlanner,
        recoveries: Sequence[NamedRecovery],
        peers: PeerParams,
        number: int = 0,
    ):
        self.params = params
        self.peer_params = peers
        self.global_costmap = global_costmap
        self.local_costmap = local_costmap
        self.planner = planner
        self.controller = controller
        self._recovering = RecoverySequence(recoveries)
        self._yielding = Yielding(Traffic(global_costmap, local_costmap), number)
        self._watch = Schedule(PEER_WATCH_HZ)
        self._limiter = ParameterLimiter(controller)
        self.state = State.IDLE
        self.goal: Optional[Pose2D] = None
        self._updates = CostmapUpdates(global_costmap, local_costmap)
        self._cycle = Schedule(params.controller_frequency_hz)
        self._replan = Schedule(params.planner_frequency_hz)
        self._started = False
        self._plan_wanted = False
        self._new_plan: Optional[np.ndarray] = None
        self._oscillation = StallTimer()
        self._progress = ProgressChecker()
        self._reset_recovery()

    @property
    def recoveries(self) -> Tuple[NamedRecovery, ...]:
        return self._recovering.recoveries

    # -- goals ---------------------------------------------------------------------

    def accepts_goal(self, now_s: float) -> bool:
        """Whether a new goal or a cancel takes effect now.

        An active goal is replaced or cancelled at the next control cycle only.
        """
        return self.state is State.IDLE or now_s >= self._cycle.due_s - 1e-9

    def set_goal(self, goal: Pose2D, now_s: float) -> None:
        """Heads for a pose in the global costmap's frame, from this cycle on."""
        self._yielding.set_out(goal, now_s)
        self._set_goal(goal, now_s)

    def _set_goal(self, goal: Pose2D, now_s: float) -> None:
        if self.state is State.IDLE:
            self._cycle.start(now_s)
        self.goal = goal
        self._reset_recovery()
        self._begin_planning(now_s)
        self._last_valid_control_s = now_s

    def cancel(self) -> None:
        """Drops the goal; the next tick sends a stop."""
        self._stop_wanted = self.state is not State.IDLE
        self._end_goal()

    # -- time ----------------------------------------------------------------------

    @property
    def next_due_s(self) -> float:
        """When the next tick has something to do; -inf before the first."""
        if not self._started:
            return -math.inf
        due = [math.inf]
        if not self._costmaps_rest:
            due.append(self._updates.due_s)
        if self.state is not State.IDLE:
            due += [self._cycle.due_s, self._recovering.due_s]
        if self.state is State.CONTROLLING:
            due.append(self._replan.due_s)
        elif self.state is State.IDLE and self.peer_params.avoid_peers:
            due.append(self._watch.due_s)
        return min(due)

    @property
    def has_work(self) -> bool:
        """Whether a tick is wanted at once: the first one, or a stop to be sent."""
        return not self._started or self._stop_wanted

    def restart(self, now_s: float) -> None:
        """For a clock that has jumped back: schedules, patience and costmaps begin anew."""
        goal = None if self._yielding.is_errand else self.goal
        self._end_goal()
        self._watch.start(now_s)
        self._yielding.traffic.restart()
        self._updates.start(now_s)
        self.clear_costmaps(now_s)
        self._limiter.lift()
        if goal is not None:
            self.set_goal(goal, now_s)

    def tick(
        self, now_s: float, located: RobotPoses, velocity: Twist2D, peers: Sequence[Peer] = ()
    ) -> Tick:
        """Does what is due.

        ``velocity`` is the odometry's twist in the robot's frame; ``peers`` are the other
        robots as far as they are known.
        """
        if not self._started:
            self._started = True
            self._watch.start(now_s)
            self._updates.start(now_s)
        tick = Tick(now_s)
        self._see_peers(tick, located, peers)
        if not self._costmaps_rest:
            self._updates.update(tick, located)
        if self._stop_wanted:
            self._stop_wanted = False
            tick.command = Twist2D()
        if self.state is State.IDLE and self._watch.pop(now_s):
            self._run_errand(tick, located.in_global)
        if self.state is not State.IDLE:
            self._cycle.set_frequency(self.params.controller_frequency_hz, now_s)
            self._replan.set_frequency(self.params.planner_frequency_hz, now_s)
            self._plan(tick, located.in_global)
            if self._recovering.is_running and not (
                self._minds_blindness and self._updates.silence(now_s)
            ):
                self._step_recovery(tick, located)
            if self._cycle.pop(now_s):
                tick.cycle = True
                self._control_cycle(tick, located, velocity)
        self._hold_off(tick, located.in_global, velocity)
        tick.state = self.state
        tick.giving_way = self._yielding.now
        return tick

    # -- costmaps ------------------------------------------------------------------

    @property
    def _costmaps_rest(self) -> bool:
        return self.params.shutdown_costmaps and self.state is State.IDLE

    def clear_costmaps(self, now_s: float) -> None:
        """Forgets everything that was observed, as ``~clear_costmaps`` does."""
        self.global_costmap.reset_layers(now_s)
        self.local_costmap.reset_layers(now_s)

    def free_surroundings(self, located: RobotPoses, radius_m: float) -> None:
        """Takes the square around the robot for free until the next updates."""
        for costmap, pose in (
            (self.global_costmap, located.in_global),
            (self.local_costmap, located.in_local),
        ):
            if pose is not None:
                costmap.free_square(pose.x_m, pose.y_m, 2.0 * radius_m)

    # -- planning ------------------------------------------------------------------

    def make_plan(self, start: Pose2D, goal: Pose2D, tolerance_m: float = 0.0) -> np.ndarray:
        """A plan between two poses without flying it, as ``~make_plan`` gives it.

        Raises:
            PlanningError: no plan, not even within the tolerance of the goal.
        """
        costmap = self.global_costmap
        return plan_near(
            self.planner,
            costmap.spec,
            costmap.costs,
            start,
            goal,
            tolerance_m,
            self.params.make_plan_add_unreachable_goal,
        )

    def _plan_between(self, start: Pose2D, goal: Pose2D) -> np.ndarray:
        costmap = self.global_costmap
        return self.planner.make_plan(costmap.spec, costmap.costs, start, goal)

    def _begin_planning(self, now_s: float) -> None:
        self.state = State.PLANNING
        self._plan_wanted = True
        self._new_plan = None
        self._last_valid_plan_s = now_s
        self._planning_retries = 0
        self._replan.start(now_s)

    def _plan(self, tick: Tick, start: Optional[Pose2D]) -> None:
        """Looks for a plan when one is wanted, at most once per tick."""
        again = self.state is State.CONTROLLING and self._replan.pop(tick.now_s)
        if self.state is State.PLANNING and self._plan_wanted:
            # A failed search is repeated once per control cycle: the costs it
            # depends on change no faster.
            again = tick.now_s >= self._cycle.due_s - 1e-9
        if again and self.goal is not None:
            self._search(tick, start)

    def _search(self, tick: Tick, start: Optional[Pose2D]) -> None:
        target = self._yielding.target(self.goal)
        try:
            if start is None or target is None:
                raise PlanningError("the robot's pose is unknown")
            tick.plan = self._plan_between(start, target)
        except PlanningError as error:
            tick.planning_failed = str(error)
            self._planning_failed(tick)
            return
        self._new_plan = tick.plan
        self._yielding.follow(tick.plan)
        self._last_valid_plan_s = tick.now_s
        self._planning_retries = 0
        self._plan_wanted = False
        if self.state is State.PLANNING:
            self._replan.pop(tick.now_s)
            self.state = State.CONTROLLING

    def _planning_failed(self, tick: Tick) -> None:
        if self._yielding.refuge is not None:
            self._yielding.refuse_refuge()
        if self.state is not State.PLANNING:
            return
        self._planning_retries += 1
        too_long = tick.now_s > self._last_valid_plan_s + self.params.planner_patience_s
        too_often = 0 <= self.params.max_planning_retries < self._planning_retries
        if too_long or too_often:
            self._enter_clearing(tick, Trigger.PLANNING)

    # -- control -------------------------------------------------------------------

    def _control_cycle(self, tick: Tick, located: RobotPoses, velocity: Twist2D) -> None:
        if located.in_global is None or located.in_local is None:
            self._stand_blind(tick, located.why_not or "the robot's pose is unknown")
            return
        self._limiter.follow(located.in_global)
        if self._oscillation.has_moved(
            tick.now_s, located.in_global, self.params.oscillation_distance_m
        ):
            self._recovering.works_again(Trigger.OSCILLATION)
        out_of_date = self._updates.out_of_date(tick.now_s)
        if out_of_date:
            self._stand_blind(tick, out_of_date)
            return
        if self._gives_way(tick, located.in_global):
            return
        if self._new_plan is not None:
            self.controller.set_plan(self._new_plan)
            self._new_plan = None
            self._recovering.works_again(Trigger.PLANNING)
        if self.state is State.CONTROLLING:
            self._follow(tick, located, velocity)
        elif self.state is State.CLEARING and not self._recovering.is_running:
            self._start_recovery(tick, located)
        elif self.state is State.PLANNING:
            tick.command = Twist2D()  # the command of the goal before is not for this one

    def _stand_blind(self, tick: Tick, reason: str) -> None:
        tick.warnings.append("stopped: " + reason)
        tick.command = Twist2D()
        if self._minds_blindness:
            self._excuse(tick.now_s)

    @property
    def _minds_blindness(self) -> bool:
        """The original goes on recovering while it is blind, and is impatient afterwards."""
        return self.params.sensor_timeout_s > 0.0

    def _follow(self, tick: Tick, located: RobotPoses, velocity: Twist2D) -> None:
        assert located.in_local is not None and located.in_global is not None
        if self.controller.is_goal_reached():
            if self._yielding.refuge is None:
                self._finish(tick, Outcome(True, "Goal reached."))
            else:
                tick.command = Twist2D()
            return
        if self._oscillation.exceeds(tick.now_s, self.params.oscillation_timeout_s):
            self._enter_clearing(tick, Trigger.OSCILLATION)
            return
        if not self._is_progressing(tick, located.in_global):
            return
        try:
            tick.control = self.controller.compute_velocity(
                self.local_costmap.spec,
                self.local_costmap.costs,
                located.in_local,
                velocity,
                local_from_global(located),
            )
        except ControlError as error:
            tick.warnings.append(str(error))
            self._control_failed(tick, located.in_local)
            return
        tick.command = tick.control.command
        self._last_valid_control_s = tick.now_s
        self._recovering.works_again(Trigger.CONTROLLING)

    def _control_failed(self, tick: Tick, pose: Pose2D) -> None:
        if tick.now_s > self._last_valid_control_s + self.params.controller_patience_s:
            self._enter_clearing(tick, Trigger.CONTROLLING)
            return
        tick.command = Twist2D()
        if self.params.escape_collision:
            local = self.local_costmap
            tick.command = escape(local.spec, local.costs, local.footprint, pose) or Twist2D()
        self._begin_planning(tick.now_s)

    def _is_progressing(self, tick: Tick, pose: Pose2D) -> bool:
        """Whether the robot has moved lately; if not, a new plan, then recoveries."""
        remedy = self._progress.look(tick.now_s, pose, self.params.progress)
        if remedy is StuckAction.NONE:
            return True
        where = (
            f"no progress for {self.params.progress.timeout_s:g} s at "
            f"({pose.x_m:.2f}, {pose.y_m:.2f})"
        )
        if remedy is StuckAction.RECOVERIES:
            tick.warnings.append(where + " with a new plan either: trying recoveries")
            self._enter_clearing(tick, Trigger.OSCILLATION)
            return False
        tick.warnings.append(where + ": planning anew")
        limit = relaxed_obstacle_weight(
            self._limiter.usual,
            self.params.progress.stuck_cost_factor,
            self.params.oscillation_distance_m,
        )
        if limit is not None:
            self._limiter.impose(limit, pose)
        tick.command = Twist2D()
        self._begin_planning(tick.now_s)
        return False

    def set_controller_params(self, params: Any) -> None:
        """Other parameters for the controller; a recovery's speed limit stays in force."""
        self._limiter.set_params(params)

    # -- peers ---------------------------------------------------------------------

    @property
    def intention(self) -> Intention:
        """What the peers may know of this robot."""
        return self._yielding.intention

    @property
    def peer_reach_m(self) -> float:
        """Peers farther away need not be told of."""
        return self._yielding.traffic.reach_m

    def _see_peers(self, tick: Tick, located: RobotPoses, peers: Sequence[Peer]) -> None:
        traffic, had_some = self._yielding.traffic, bool(self._yielding.traffic.peers)
        traffic.cruising_mps = getattr(self._limiter.usual, "max_vel_x_mps", CRUISING_MPS)
        tick.notes += traffic.see(tick.now_s, located.in_global, peers, self.peer_params)
        if (traffic.peers or had_some) and located.in_global and located.in_local:
            traffic.tell_costmaps(
                tick.now_s, located.in_global, local_from_global(located), self._yielding.rank_s
            )

    def _gives_way(self, tick: Tick, here: Pose2D) -> bool:
        """Whether it stands still for a peer; to a refuge it flies as to a goal."""
        yielding = self._yielding
        if (
            not yielding.concerns
            or self.goal is None
            or self.state not in (State.PLANNING, State.CONTROLLING)
        ):
            return False
        before = yielding.refuge
        tick.notes += yielding.decide(tick.now_s, here, self.goal)
        if yielding.refuge != before:
            self._begin_planning(tick.now_s)
            self._search(tick, here)
        if yielding.now is not None:
            self._excuse(tick.now_s)
        if not yielding.waits_at(here):
            return False
        tick.command = Twist2D()
        return True

    def _excuse(self, now_s: float) -> None:
        """No progress for a peer's sake, or blind, is no fault."""
        self._progress.restart(now_s)
        self._oscillation.restart(now_s)
        self._last_valid_control_s = now_s

    def _hold_off(self, tick: Tick, pose: Optional[Pose2D], velocity: Twist2D) -> None:
        """Whatever the command comes from, it leads to nobody."""
        if tick.command is None or pose is None:
            return
        held = self._yielding.traffic.held(
            pose, velocity, tick.command, 1.0 / self.params.controller_frequency_hz
        )
        tick.command, tick.limited_by = held.command, held.by
        if held.by:
            self._excuse(tick.now_s)
            if self.state is State.CONTROLLING and self._yielding.is_held_up(tick.now_s, pose):
                self._begin_planning(tick.now_s)  # the peer may stand on the plan

    def _run_errand(self, tick: Tick, here: Optional[Pose2D]) -> None:
        """Without a goal: out of a peer's way, or back again."""
        home = (
            self._yielding.errand(tick.now_s, here, self.peer_params) if here is not None else None
        )
        if home is not None:
            self._set_goal(home, tick.now_s)
            tick.notes.append(str(self._yielding.now or "returns to its place"))

    # -- recovery ------------------------------------------------------------------

    def _reset_recovery(self) -> None:
        self._recovering.reset()
        self._oscillation = StallTimer()
        self._progress = ProgressChecker()
        self._stop_wanted = False

    def _enter_clearing(self, tick: Tick, trigger: Trigger) -> None:
        if self._yielding.is_errand:
            self._finish(tick, Outcome(False, trigger.value))
            return
        self.state = State.CLEARING
        self._plan_wanted = False
        self._recovering.trigger = trigger
        tick.command = Twist2D()

    def _start_recovery(self, tick: Tick, located: RobotPoses) -> None:
        assert self._recovering.trigger is not None
        if self.params.recovery_behavior_enabled:
            tick.recovery = self._recovering.start(self._recovery_context(tick.now_s, located))
        if tick.recovery is None:
            self._finish(tick, Outcome(False, self._recovering.trigger.value))
        else:
            self._step_recovery(tick, located)

    def _step_recovery(self, tick: Tick, located: RobotPoses) -> None:
        step = self._recovering.step(self._recovery_context(tick.now_s, located))
        if step is None:
            return
        if step.command is not None:
            tick.command = step.command
        if step.message:
            tick.warnings.append(step.message)
        if step.limit is not None and located.in_global is not None:
            self._limiter.impose(step.limit, located.in_global)
        if step.done:
            self._oscillation.restart(tick.now_s)
            self._progress.begin_anew(tick.now_s)
            self._begin_planning(tick.now_s)

    def _recovery_context(self, now_s: float, located: RobotPoses) -> RecoveryContext:
        return RecoveryContext(
            now_s, self.global_costmap, self.local_costmap, located.in_global, located.in_local
        )

    # -- the end of a goal ---------------------------------------------------------

    def _finish(self, tick: Tick, outcome: Outcome) -> None:
        if not self._yielding.is_errand:
            tick.outcome = outcome
        else:
            tick.notes.append("is back in its place" if outcome.succeeded else outcome.text)
            if outcome.succeeded:
                self._yielding.home = None
        tick.command = Twist2D()
        self._end_goal()

    def _end_goal(self) -> None:
        self.state = State.IDLE
        self.goal = None
        self._plan_wanted = False
        self._new_plan = None
        self._recovering.stop()
        self._yielding.stand()
        self._cycle.due_s = math.inf
