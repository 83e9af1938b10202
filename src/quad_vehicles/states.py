"""State machine of one vehicle: from no link to flying and landed.

Telemetry, velocity commands and requests go in, each with its time; `tick` returns what to send.
The machine orders the same of all kinds of autopilots; `Traits` says what differs.

    no link -> not ready -> ready -> arming -> taking off -> holding <-> flying
                                                                 |         |
                                           landed <- landing <---+---------+--> taken over
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Callable, Dict, List, Optional, Tuple

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.topics.vehicle_states import IN_FLIGHT, ON_GROUND, State
from quad_vehicles import safety
from quad_vehicles.inputs import Inputs
from quad_vehicles.orders import Answer, Order, Output, Permissions, Response, Traits
from quad_vehicles.safety import Danger, FlightView, Reaction, danger, inside_fence
from quad_vehicles.setpoints import HeightLoop
from quad_vehicles.telemetry import Landed, Limits, Velocity

RETRY_S = 1.0
"""An order that has had no effect is given again after this time."""
MOST_ORDERS = 4
STREAM_S = 1.5
"""Set-points are streamed for this long before an autopilot that wants them takes our control; PX4
wants them for more than 1 s."""
TAKE_OFF_AGAIN_S = 7.0
"""A take-off that has not left the ground is ordered again; a set-point may have cancelled it."""
TAKE_OFF_S = 20.0
NEAR_M = 0.15
"""A take-off by set-points has ended this close to the altitude."""
DISARM_S = 10.0
"""After a landing the autopilot disarms; after this time on the ground we order it."""


class VehicleMachine:
    """State machine of one vehicle.

    Attributes:
        inputs: Telemetry and commands; the adapters write to it.
        state: Present state.
        reason: Why it is in this state, for people; "" if that is plain.
        odom_from_start: Where the vehicle stood before the last take-off.
        map_from_start: The same in ``map``, if a localization knew it.
        ground_m: Height of that place in the odometry frame.
        altitude_m: Flying altitude above it.
        refusal: Why the last take-off or resumption was given up before it took effect.
        traits: What is special about the kind of autopilot.
    """

    def __init__(
        self,
        altitude_m: float,
        limits: Limits,
        traits: Traits,
        permissions: Permissions,
        localizer: str = "",
    ) -> None:
        """Start without a link; ``localizer`` is that of ``Inputs``."""
        self.inputs = Inputs(limits, localizer)
        self.state, self.reason = State.NO_LINK, "no heartbeat yet"
        self.odom_from_start: Optional[Pose2D] = None
        self.map_from_start: Optional[Pose2D] = None
        self.ground_m, self.refusal = 0.0, ""
        self.altitude_m, self._limits = altitude_m, limits
        self.traits, self._permissions = traits, permissions
        self._loop = HeightLoop(climb_mps=limits.climb_mps)
        self._before_loss = State.NO_LINK
        self._state_s = 0.0  # begin of the state
        self._order: Optional[Order] = None  # the one that has not taken effect yet
        self._order_s, self._orders, self._is_confirmed = -math.inf, 0, False
        self._grounded_s: Optional[float] = None
        self._wants_control = False  # taken over, and somebody has asked to resume
        self._stops_once = self._pauses = False
        self._news: List[str] = []

    # Requests of people and of the mission.

    def take_off(self, now_s: float) -> Response:
        """Ask for a take-off."""
        if self.state in IN_FLIGHT or self.state is State.ARMING:
            return Response(True, f"already {self.state.value}")
        if self.state not in (State.READY, State.LANDED):
            return Response(False, f"{self.state.value}: {self.reason}")
        problem = self._take_off_problem(now_s)
        if problem:
            return Response(False, problem)
        estimate = self.inputs.estimate
        assert estimate is not None  # otherwise not ready
        self.odom_from_start = estimate.odom_from_base.to_2d()
        self.map_from_start = self.inputs.map_from_base()
        self.ground_m = estimate.odom_from_base.z_m
        self.inputs.begin_flight(now_s)
        self._enter(State.ARMING, "", now_s)
        return Response(True, "taking off")

    def _take_off_problem(self, now_s: float) -> str:
        return "; ".join(self.inputs.not_ready(now_s)) or self._permission_problem()

    def _permission_problem(self) -> str:
        status, permissions = self.inputs.status, self._permissions
        is_armed = status is not None and status.is_armed
        if is_armed or permissions.may_arm or permissions.is_dry or not self.traits.needs_arming:
            return ""
        return "the motors are not armed: arm by hand, or start with arm:=true"

    def land(self, now_s: float, reason: str, is_stop_all: bool = False) -> Response:
        """Ask for a landing; with ``is_stop_all`` not against the mode that a pilot has set."""
        status = self.inputs.status
        if self.state in (State.FLYING, State.HOLDING, State.TAKING_OFF):
            self._enter(State.LANDING, reason, now_s)
        elif self.state is State.ARMING:
            self._give_up(reason, now_s)
        elif self.state is State.TAKEN_OVER and status is not None and status.is_armed:
            if is_stop_all and not status.is_controlled:
                return Response(False, f"taken over: {self.reason}")
            self._enter(State.LANDING, reason, now_s)
        elif self.state is State.NO_LINK:
            return Response(False, "no link")
        return Response(True, self.state.value)

    def resume(self, now_s: float) -> Response:
        """Ask to fly again after the vehicle was taken over; on the ground it takes nothing off."""
        status = self.inputs.status
        if self.state is State.TAKEN_OVER and status is not None:
            self.inputs.moved_sticks = ""
            if status.is_armed and self.inputs.landed is not Landed.ON_GROUND:
                self._wants_control, self.refusal, self._state_s = True, "", now_s
                self._order, self._orders = None, 0
                return Response(True, "taking control")
            self._enter(State.NOT_READY, "on the ground", now_s)
        text = self.state.value + (f": {self.reason}" if self.reason else "")
        hint = "; take off first, then resume" if self.state in ON_GROUND else ""
        return Response(self.state in (State.FLYING, State.HOLDING), text + hint)

    # The machine.

    def tick(self, now_s: float) -> Output:
        """Return what to send now; called at the rate of the set-points."""
        self._orders_now: List[Order] = []
        if self.state in IN_FLIGHT:
            self._watch(now_s)
        elif self.state is not State.NO_LINK and self.inputs.link_problem(now_s):
            self._lose_link(self.inputs.link_problem(now_s), now_s)
        velocity = self._STEPS[self.state](self, now_s)
        if self._stops_once:
            velocity, self._stops_once = self._hover(now_s), False
        output = Output(
            velocity,
            tuple(self._orders_now),
            self.state is not State.NO_LINK or self._before_loss not in IN_FLIGHT,
            self._pauses,
            tuple(self._news),
        )
        self._pauses, self._news = False, []
        return output

    def answer(self, answer: Answer, now_s: float) -> None:
        """Take the autopilot's answer to an order."""
        if answer.is_accepted or answer.order is not self._order:
            self._is_confirmed |= answer.order is self._order
            return
        what = f"the autopilot refuses to {answer.order.value}"
        reason = f"{what}: {answer.reason or 'without a reason'}"
        if self.state is State.ARMING:
            self._give_up(reason, now_s)
        elif self.state is State.TAKING_OFF and self._orders >= MOST_ORDERS:
            self._enter(State.LANDING, reason, now_s)
        elif self.state is State.TAKEN_OVER:
            self._wants_control, self.refusal = False, reason
            self._news.append(reason)

    def _watch(self, now_s: float) -> None:
        """React to the most important danger in flight."""
        found = danger(self._view(now_s), self._limits)
        if found is None:
            if self.state is State.HOLDING:
                self._enter(State.FLYING, "", now_s)
        elif found.reaction is Reaction.TAKEN_OVER:
            self._taken_over(found, now_s)
        elif found.reaction is Reaction.LINK_LOST:
            self._lose_link(found.reason, now_s)
        elif found.reaction is Reaction.LAND and self.state is not State.LANDING:
            self._enter(State.LANDING, found.reason, now_s)
        elif found.reaction is Reaction.HOVER and self.state is State.FLYING:
            self._enter(State.HOLDING, found.reason, now_s)

    def _view(self, now_s: float) -> FlightView:
        view = self.inputs.view(now_s, self._ways(), self.ground_m)
        if self.state in (State.FLYING, State.HOLDING):
            view = replace(view, is_grounded=self.inputs.landed is Landed.ON_GROUND)
        else:  # commands count only in flight
            view = replace(view, command_age_s=0.0, waiting_age_s=0.0)
        if self._permissions.is_dry:
            view = view.on_desk()
        return replace(view, may_land=self.state is State.LANDING)

    def _taken_over(self, found: Danger, now_s: float) -> None:
        status = self.inputs.status
        if self.state is State.LANDING and status is not None and not status.is_armed:
            return self._enter(State.LANDED, "", now_s)
        self._stops_once = status is not None and status.is_controlled and status.is_armed
        self._wants_control, self._pauses = False, True
        return self._enter(State.TAKEN_OVER, found.reason, now_s)

    def _lose_link(self, reason: str, now_s: float) -> None:
        self._before_loss = self.state
        self._enter(State.NO_LINK, reason, now_s)

    # One step for each state; it returns the set-point.

    def _in_no_link(self, now_s: float) -> Optional[Velocity]:
        status, problem = self.inputs.status, self.inputs.link_problem(now_s)
        if status is None or problem:
            self._enter(State.NO_LINK, self.reason if status else problem, now_s)
            return None
        if self.inputs.status_s < self._state_s:  # a heartbeat, not only an echo from before
            return None
        before, self._before_loss = self._before_loss, State.NO_LINK
        is_up = status.is_armed and self.inputs.landed is not Landed.ON_GROUND
        if not is_up:
            self._enter(State.NOT_READY, "connected", now_s)
        elif before is State.LANDING and status.is_landing:
            self._enter(State.LANDING, "link restored", now_s)
        elif before in IN_FLIGHT and status.is_controlled:
            self.inputs.restore_link(now_s)
            self._enter(State.HOLDING, "link restored", now_s)
        else:
            self._pauses = True
            what = "bridge started in flight" if before is State.NO_LINK else "the link was lost"
            self._enter(State.TAKEN_OVER, f"{what}; mode {status.mode}; resume or land it", now_s)
        return None

    def _on_ground(self, now_s: float) -> Optional[Velocity]:
        status = self.inputs.status
        assert status is not None
        if status.is_armed and self.inputs.landed in (Landed.IN_AIR, Landed.TAKING_OFF):
            self._enter(State.TAKEN_OVER, "somebody else took off", now_s)
            return None
        reasons = self.inputs.not_ready(now_s)
        if reasons:
            self._enter(State.NOT_READY, "; ".join(reasons), now_s)
        elif self.state is State.NOT_READY:
            self._enter(State.READY, "", now_s)
        return None

    def _in_arming(self, now_s: float) -> Optional[Velocity]:
        status = self.inputs.status
        assert status is not None
        streams, age_s = self.traits.streams_before_control, now_s - self._order_s
        arms = self._order is Order.ARM
        problem = safety.arming_problem(status, self._is_confirmed, age_s) if arms else ""
        problem = problem or self._permission_problem()  # the pilot may have disarmed meanwhile
        if problem:
            self._give_up(problem, now_s)
        elif not status.is_controlled:
            if not streams or now_s - self._state_s >= STREAM_S:
                self._give(Order.TAKE_CONTROL, now_s)
        elif self._permissions.is_dry:
            self._enter(State.FLYING, "dry run", now_s)
        elif self.traits.needs_arming and not status.is_armed:
            self._give(Order.ARM, now_s)
        else:
            self._enter(State.TAKING_OFF, "", now_s)
            return self._in_taking_off(now_s)
        if self._orders > MOST_ORDERS and self._order is not None:
            self._give_up(f"no effect of the order to {self._order.value}", now_s)
        return Velocity() if streams else None

    def _in_taking_off(self, now_s: float) -> Optional[Velocity]:
        inputs, elapsed_s = self.inputs, now_s - self._state_s
        if elapsed_s > TAKE_OFF_S:
            self._enter(State.LANDING, f"take-off not finished after {TAKE_OFF_S:g} s", now_s)
            return None
        if not self.traits.takes_off_by_command:
            if inputs.height_m(self.ground_m) > self.altitude_m - NEAR_M:
                self._hold(now_s)
            return self._hover(now_s)
        if inputs.landed is Landed.IN_AIR:
            self._hold(now_s)
            return self._hover(now_s)
        again_s = TAKE_OFF_AGAIN_S if self._is_confirmed else RETRY_S
        if self._order is not Order.TAKE_OFF or (
            inputs.landed is Landed.ON_GROUND and now_s - self._order_s > again_s
        ):
            self._order, self._is_confirmed = None, False
            self._give(Order.TAKE_OFF, now_s)
        return None

    def _give_up(self, reason: str, now_s: float) -> None:
        """End a take-off before the vehicle has left the ground."""
        self.refusal = reason
        self.inputs.refuse(reason, now_s)
        self._enter(State.NOT_READY, reason, now_s)

    def _hold(self, now_s: float) -> None:
        self.inputs.begin_flight(now_s)
        self._enter(State.HOLDING, "at altitude, waiting for commands", now_s)

    def _in_landing(self, now_s: float) -> Optional[Velocity]:
        status = self.inputs.status
        assert status is not None
        if not status.is_armed:
            self._enter(State.LANDED, "", now_s)
        elif not status.is_landing:
            self._give(Order.LAND, now_s)
        elif self.inputs.landed is not Landed.ON_GROUND:
            self._grounded_s = None
        elif self._grounded_s is None:
            self._grounded_s = now_s
        elif now_s - self._grounded_s > DISARM_S:
            self._give(Order.DISARM, now_s)
        return None

    def _in_taken_over(self, now_s: float) -> Optional[Velocity]:
        status = self.inputs.status
        assert status is not None
        if self._wants_control and (self._orders > MOST_ORDERS or not status.is_armed):
            self._wants_control, self.refusal = False, "no effect of the order to take control"
            self._news.append(self.refusal)
        self._explain(now_s)
        if not self._wants_control or self.inputs.landed is Landed.TAKING_OFF:
            return None  # a set-point would cancel somebody's take-off
        if status.is_controlled:
            self._hold(now_s)
            return self._hover(now_s)
        streams = self.traits.streams_before_control
        if not streams or now_s - self._state_s >= STREAM_S:
            self._give(Order.TAKE_CONTROL, now_s)
        return Velocity() if streams else None

    def _explain(self, now_s: float) -> None:
        """Give the autopilot's own reason, which comes after its new mode."""
        view = self._view(now_s)
        found = danger(view, self._limits)
        if view.autopilot_text and found and found.reaction is Reaction.TAKEN_OVER:
            self._enter(State.TAKEN_OVER, found.reason, now_s)

    # Parts of the steps.

    def _hover(self, now_s: float) -> Velocity:
        return self._velocity(Twist2D(), now_s)

    def commanded_velocity(self, now_s: float) -> Velocity:
        """Return the set-point for the last command, slowed down at the limit of distance."""
        twist = self.inputs.command
        velocity = twist.vx_mps, twist.vy_mps
        for way in self._ways():
            velocity = inside_fence(velocity, way, self._limits.radius_m)
        return self._velocity(Twist2D(*velocity, twist.vyaw_radps), now_s)

    def _ways(self) -> List[Tuple[float, float]]:
        return self.inputs.ways(self.odom_from_start, self.map_from_start)

    _STEPS: Dict[State, Callable[[VehicleMachine, float], Optional[Velocity]]] = {
        State.NO_LINK: _in_no_link,
        **dict.fromkeys(ON_GROUND, _on_ground),
        State.ARMING: _in_arming,
        State.TAKING_OFF: _in_taking_off,
        State.FLYING: commanded_velocity,
        State.HOLDING: _hover,
        State.LANDING: _in_landing,
        State.TAKEN_OVER: _in_taken_over,
    }

    def _velocity(self, twist: Twist2D, now_s: float) -> Velocity:
        vz_mps = 0.0
        if not self.inputs.is_estimate_late(now_s):
            height_m = self.inputs.height_m(self.ground_m)
            vz_mps = self._loop.velocity_mps(self.altitude_m, height_m)
        return Velocity(twist.vx_mps, twist.vy_mps, vz_mps, twist.vyaw_radps, self.altitude_m)

    def _give(self, order: Order, now_s: float) -> None:
        """Give an order, again while it has no effect."""
        if order is not self._order:
            self._order, self._orders, self._is_confirmed = order, 0, False
        elif now_s - self._order_s < RETRY_S or (order is Order.ARM and self._is_confirmed):
            return
        self._order_s, self._orders = now_s, self._orders + 1
        self._orders_now.append(order)

    def _enter(self, state: State, reason: str, now_s: float) -> None:
        if state is not self.state or reason != self.reason:
            self._news.append(f"{state.value}: {reason}" if reason else state.value)
        if state is not self.state:
            self._order, self._orders, self._state_s, self._grounded_s = None, 0, now_s, None
        if state not in ON_GROUND:
            self.refusal = ""
        self.state, self.reason = state, reason
