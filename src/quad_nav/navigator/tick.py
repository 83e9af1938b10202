"""What goes into one tick of the navigator and what comes out of it."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Dict, List, Optional

import numpy as np

from quad_nav.control.controller import Control
from quad_nav.costmap.cost_grid import Window
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.peers.right_of_way import YieldDecision


class State(enum.Enum):
    IDLE = "idle"
    PLANNING = "planning"
    CONTROLLING = "controlling"
    CLEARING = "clearing"


class Trigger(enum.Enum):
    """Why recoveries are run; the value is the original's closing sentence."""

    PLANNING = "Failed to find a valid plan. Even after executing recovery behaviors."
    CONTROLLING = "Failed to find a valid control. Even after executing recovery behaviors."
    OSCILLATION = "Robot is oscillating. Even after executing recovery behaviors."


@dataclass(frozen=True)
class RobotPoses:
    """Where the robot is in each costmap's frame; None when it is not known, and why not."""

    in_global: Optional[Pose2D]
    in_local: Optional[Pose2D]
    why_not: str = ""


@dataclass(frozen=True)
class RecoveryStart:
    """A recovery behaviour begins: its name, its number and how many there are."""

    name: str
    index: int
    total: int
    trigger: Trigger


@dataclass(frozen=True)
class Outcome:
    """The end of a goal."""

    succeeded: bool
    text: str


@dataclass
class Tick:
    """What one tick did, for topics, report and tuner alike."""

    now_s: float
    state: State = State.IDLE
    windows: Dict[str, Window] = field(default_factory=dict)  # changed by costmap updates
    cycle: bool = False  # whether a control cycle ran
    command: Optional[Twist2D] = None  # to be sent now, if any
    plan: Optional[np.ndarray] = None  # a new global plan float64[n, 3]
    planning_failed: str = ""
    control: Optional[Control] = None
    recovery: Optional[RecoveryStart] = None
    outcome: Optional[Outcome] = None
    giving_way: Optional[YieldDecision] = None  # what it does for a peer just now
    limited_by: str = ""  # the peer that the command was slowed down for
    notes: List[str] = field(default_factory=list)  # what is worth knowing, and no fault
    warnings: List[str] = field(default_factory=list)


def local_from_global(located: RobotPoses) -> Pose2D:
    """The planar transform between the costmaps' frames, from the two poses."""
    if located.in_local == located.in_global:
        return Pose2D(0.0, 0.0, 0.0)
    assert located.in_local is not None and located.in_global is not None
    a, b = located.in_local, located.in_global
    turn = Pose2D(0.0, 0.0, a.yaw_rad - b.yaw_rad)
    x_m, y_m = turn.rotate(b.x_m, b.y_m)
    return Pose2D(a.x_m - x_m, a.y_m - y_m, turn.yaw_rad)
