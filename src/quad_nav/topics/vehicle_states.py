"""States of a real vehicle, as its bridge publishes them in `/vehicle{i}/state`."""

from __future__ import annotations

import enum


class State(enum.Enum):
    """State of a vehicle."""

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


IN_FLIGHT = (State.TAKING_OFF, State.FLYING, State.HOLDING, State.LANDING)
ON_GROUND = (State.NOT_READY, State.READY, State.LANDED)
