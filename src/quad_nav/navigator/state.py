"""States of the navigator, apart from ``tick`` for nodes that need no kernels."""

from __future__ import annotations

import enum


class State(enum.Enum):
    """States of move_base."""

    IDLE = "idle"
    PLANNING = "planning"
    CONTROLLING = "controlling"
    CLEARING = "clearing"
