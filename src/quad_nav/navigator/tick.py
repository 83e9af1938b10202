"""Input and output of one step of the navigator."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Dict, List, Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.controller import Control
from quad_nav.costmap.cost_grid import Window
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.navigator.command_filter import StopReason
from quad_nav.navigator.state import State as State
from quad_nav.peers.right_of_way import YieldDecision

_SAME_FRAME = Pose2D(0.0, 0.0, 0.0)


class Trigger(enum.Enum):
    """Reasons for recoveries; the value is move_base's result text of an aborted goal."""

    PLANNING = "Failed to find a valid plan. Even after executing recovery behaviors."
    CONTROLLING = "Failed to find a valid control. Even after executing recovery behaviors."
    OSCILLATION = "Robot is oscillating. Even after executing recovery behaviors."


@dataclass(frozen=True)
class RobotPoses:
    """Poses of the robot in the frames of both costmaps.

    Attributes:
        in_global: Pose in the frame of the global costmap, None if unknown.
        in_local: Pose in the frame of the local costmap, None if unknown.
        unknown_reason: Why a pose is unknown, "" if there is no particular reason.
    """

    in_global: Optional[Pose2D]
    in_local: Optional[Pose2D]
    unknown_reason: str = ""

    @property
    def local_from_global(self) -> Optional[Pose2D]:
        """Transform from the global costmap's frame to the local one's, None if unknown."""
        a, b = self.in_local, self.in_global
        if a is None or b is None:
            return None
        if a is b or a == b:
            return _SAME_FRAME
        rotation = Pose2D(0.0, 0.0, a.yaw_rad - b.yaw_rad)
        x_m, y_m = rotation.rotate(b.x_m, b.y_m)
        return Pose2D(a.x_m - x_m, a.y_m - y_m, rotation.yaw_rad)


@dataclass(frozen=True)
class RecoveryStart:
    """Start of a recovery behaviour: number ``index`` (from 0) of ``total``."""

    name: str
    index: int
    total: int
    trigger: Trigger


@dataclass(frozen=True)
class Outcome:
    """End of a goal, with the result text of the action."""

    succeeded: bool
    text: str


@dataclass
class Tick:
    """Result of one step, for topics, reports and tuning.

    Attributes:
        now_s: Time of the step.
        state: State after the step.
        windows: Cells that costmap updates changed, by costmap: "global", "local". None at the
            time of an update that is not made: the costmap rests, or the pose is unknown.
        cycle: A control cycle ran.
        command: Command to publish now, if any.
        stop: Why that command is a stop, None if it is none.
        plan: New global plan, float64[n, 3] of (x_m, y_m, yaw_rad) in the global costmap's
            frame.
        planning_failed: Why the search for a plan failed, "" if it did not.
        no_path: That search was made; none is where start or goal is outside of the map.
        control: Result of the local planner.
        recovery: The recovery behaviour that started.
        outcome: End of the goal.
        yielding: The decision to yield that is in force.
        goal: The goal in the global costmap's frame; None without one, also while it yields.
        velocity: Velocity that the navigator was given, in the robot's frame.
        limited_by: Name of the peer or thing for which a command filter holds the robot back, "" if
            none does.
        notes: Messages for the log that tell no fault.
        warnings: Messages for the log that tell a fault.
    """

    now_s: float
    state: State = State.IDLE
    windows: Dict[str, Optional[Window]] = field(default_factory=dict)
    cycle: bool = False
    command: Optional[Twist2D] = None
    stop: Optional[StopReason] = None
    plan: Optional[NDArray[np.float64]] = None
    planning_failed: str = ""
    no_path: bool = False
    control: Optional[Control] = None
    recovery: Optional[RecoveryStart] = None
    outcome: Optional[Outcome] = None
    yielding: Optional[YieldDecision] = None
    goal: Optional[Pose2D] = None
    velocity: Twist2D = Twist2D()
    limited_by: str = ""
    notes: List[str] = field(default_factory=list)
    warnings: List[str] = field(default_factory=list)

    @property
    def is_stopped(self) -> bool:
        """True if the robot stops for lack of data; the first warning says of which."""
        return self.stop is StopReason.NO_DATA

    def halt(self, reason: StopReason) -> None:
        """Command a stop."""
        self.command, self.stop = Twist2D(), reason

    def steer(self, command: Twist2D) -> None:
        """Command a velocity in the robot's frame."""
        self.command, self.stop = command, None
