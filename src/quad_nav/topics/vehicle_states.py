"""States of a real vehicle, as its bridge publishes them in `/vehicle{i}/state`."""

from __future__ import annotations

import enum
from typing import Any


class State(enum.Enum):
    """State of a vehicle, in the order of the numbers of ``quad/VehicleState``."""

    NO_LINK = "no link"
    NOT_READY = "not ready"
    READY = "ready"
    ARMING = "arming"
    TAKING_OFF = "taking off"
    FLYING = "flying"
    HOLDING = "holding"
    LANDING = "landing"
    LANDED = "landed"
    TAKEN_OVER = "taken over"

    @property
    def number(self) -> int:
        """Number of the state in ``quad/VehicleState``."""
        return _STATES.index(self)


_STATES = tuple(State)
IN_FLIGHT = (State.TAKING_OFF, State.FLYING, State.HOLDING, State.LANDING)
ON_GROUND = (State.NOT_READY, State.READY, State.LANDED)


def state_from_message(message: Any) -> State:
    """Return the state of a ``quad/VehicleState``.

    Raises:
        ValueError: The number is that of no state.
    """
    if message.state >= len(_STATES):
        raise ValueError(f"state {message.state}, expected 0 to {len(_STATES) - 1}")
    return _STATES[message.state]
