"""What people ask a vehicle to do that takes a while, as an action.

Its goal begins it; the states of the vehicle tell how it has ended.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any, Callable, NamedTuple, Optional, Tuple

from quad.msg import (
    LandAction,
    LandFeedback,
    LandResult,
    TakeOffAction,
    TakeOffFeedback,
    TakeOffResult,
)

from quad_nav.ros.common.polled_actions import PolledActionServer
from quad_nav.topics.vehicle_states import ON_GROUND, State
from quad_vehicles.link import VehicleLink
from quad_vehicles.orders import Response
from quad_vehicles.states import VehicleMachine

FEEDBACK_PERIOD_S = 0.2


@dataclass(frozen=True)
class Maneuver:
    """A request and the states that follow it.

    Attributes:
        begin: Asks the state machine for it, at a time in s.
        ends: States in which it has succeeded.
        passes: States on the way.
        cancel: Ends it on the way, at a time in s; None if it cannot be cancelled.
    """

    begin: Callable[[VehicleMachine, float], Response]
    ends: Tuple[State, ...]
    passes: Tuple[State, ...]
    cancel: Optional[Callable[[VehicleMachine, float], Response]] = None

    def outcome(self, machine: VehicleMachine) -> Optional[Response]:
        """Return how it has ended; None while it goes on."""
        state = machine.state
        if state in self.ends:
            return Response(True, state.value)
        if state in self.passes and not machine.refusal:
            return None
        return Response(False, f"{state.value}: {machine.refusal or machine.reason}")


TAKE_OFF = Maneuver(
    VehicleMachine.take_off,
    (State.HOLDING, State.FLYING),
    (State.ARMING, State.TAKING_OFF),
    lambda machine, now_s: machine.land(now_s, "the take-off was cancelled"),
)
LAND = Maneuver(
    lambda machine, now_s: machine.land(now_s, "asked to land"),
    ON_GROUND,
    (State.LANDING,),
)
RESUMPTION = Maneuver(
    VehicleMachine.resume,
    (State.HOLDING, State.FLYING),
    (State.TAKEN_OVER,),
)


class ActionTypes(NamedTuple):
    """Messages of an action: the whole, its feedback with a height, and its empty result."""

    action: Any
    feedback: Any
    result: Any


TAKE_OFF_TYPES = ActionTypes(TakeOffAction, TakeOffFeedback, TakeOffResult)
LAND_TYPES = ActionTypes(LandAction, LandFeedback, LandResult)


class ManeuverAction:
    """Action server of one maneuver, polled by the node.

    Its goal and result are empty, its feedback is the height. Cancelling a landing has no effect.
    """

    def __init__(
        self,
        name: str,
        types: ActionTypes,
        maneuver: Maneuver,
        link: VehicleLink,
        warn: Callable[[str], None],
    ) -> None:
        """Start the action server.

        Args:
            name: Name of the action.
            types: Its messages.
            maneuver: What it does.
            link: Connection to the vehicle.
            warn: Gets a line for each message that is dropped.
        """
        self._types, self._maneuver, self._link = types, maneuver, link
        self._next_feedback_s = -math.inf
        self._server = PolledActionServer(name, types.action, warn)

    def poll(self) -> None:
        """Take a waiting goal or cancel request, and report progress and result."""
        server, now_s = self._server, time.monotonic()
        server.publish_status(now_s)
        is_cancelled = server.is_active() and server.is_preempt_requested()
        if server.is_new_goal_available():  # it also asks to preempt the one before
            server.accept_new_goal()
            self._begin(now_s)
        elif is_cancelled and self._maneuver.cancel is not None:
            with self._link.lock:
                response = self._maneuver.cancel(self._link.machine, now_s)
            server.set_preempted(self._types.result(), response.text)
        if server.is_active():
            self._report(now_s)

    def _begin(self, now_s: float) -> None:
        with self._link.lock:
            response = self._maneuver.begin(self._link.machine, now_s)
        if not response.is_accepted:
            self._server.set_aborted(self._types.result(), response.text)

    def _report(self, now_s: float) -> None:
        with self._link.lock:
            outcome = self._maneuver.outcome(self._link.machine)
            machine = self._link.machine
            height_m = machine.inputs.height_m(machine.ground_m)
        if outcome is None:
            if now_s >= self._next_feedback_s:
                self._next_feedback_s = now_s + FEEDBACK_PERIOD_S
                self._server.publish_feedback(self._types.feedback(height_m))
        elif outcome.is_accepted:
            self._server.set_succeeded(self._types.result(), outcome.text)
        else:
            self._server.set_aborted(self._types.result(), outcome.text)
