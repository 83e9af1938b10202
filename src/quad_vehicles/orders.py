"""What goes between the state machine and the world: orders, answers, states, requests.

An adapter gives the orders to the autopilot and returns its answers; a node passes requests of
people on and publishes the state.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Optional, Tuple

from quad_vehicles.telemetry import Velocity


class Order(enum.Enum):
    """An order to the autopilot that it acknowledges or refuses."""

    TAKE_CONTROL = "take control"
    ARM = "arm"
    TAKE_OFF = "take off"
    LAND = "land"
    DISARM = "disarm"


@dataclass(frozen=True)
class Answer:
    """The autopilot's answer to an order.

    Attributes:
        order: The order.
        is_accepted: Whether the autopilot carries it out.
        reason: Why not, in the autopilot's own words; "" if it gave none.
    """

    order: Order
    is_accepted: bool
    reason: str = ""


@dataclass(frozen=True)
class Traits:
    """What the state machine has to know of a kind of autopilot.

    Attributes:
        streams_before_control: Set-points must be streamed before it takes our control.
        takes_off_by_command: It has an order for take-off, during which set-points cancel it.
            Otherwise it takes off by set-points that climb.
        needs_arming: It has to be armed.
        lands_by_itself: It goes on landing without us. Otherwise it lands by set-points that sink.
    """

    streams_before_control: bool = False
    takes_off_by_command: bool = True
    needs_arming: bool = True
    lands_by_itself: bool = True


@dataclass(frozen=True)
class Permissions:
    """What the person at the desk allows.

    Attributes:
        may_arm: Whether the bridge may arm the motors; otherwise the pilot arms.
        is_dry: Everything but arming and take-off, with the vehicle on the desk.
    """

    may_arm: bool = False
    is_dry: bool = False


@dataclass(frozen=True)
class Response:
    """Response to a request: whether it is carried out, and why not."""

    is_accepted: bool
    text: str


@dataclass(frozen=True)
class Output:
    """What to send after a tick.

    Attributes:
        velocity: Set-point to send now; None for silence.
        orders: Orders to give, each once.
        sends_heartbeat: Whether our heartbeats go on.
        pauses_mission: True once, when the robot's mission must stop until somebody resumes it.
        news: Lines for the log.
    """

    velocity: Optional[Velocity] = None
    orders: Tuple[Order, ...] = ()
    sends_heartbeat: bool = True
    pauses_mission: bool = False
    news: Tuple[str, ...] = ()
