"""Interface of recovery behaviours: context, step and parameter limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Optional, Protocol, Tuple

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.geometry import Pose2D, Twist2D


@dataclass(frozen=True)
class RecoveryContext:
    """Costmaps and poses that a behaviour may read and change; poses are None if unknown."""

    now_s: float
    global_costmap: LayeredCostmap
    local_costmap: LayeredCostmap
    pose_in_global: Optional[Pose2D]
    pose_in_local: Optional[Pose2D]

    @property
    def costmaps(self) -> Tuple[Tuple[str, LayeredCostmap, Optional[Pose2D]], ...]:
        """Name, costmap and robot pose in it: first the global one, then the local one."""
        return (
            ("global", self.global_costmap, self.pose_in_global),
            ("local", self.local_costmap, self.pose_in_local),
        )


@dataclass(frozen=True)
class ParameterLimit:
    """Temporary limit of a local planner's parameters.

    Attributes:
        greatest: (field of the local planner's parameters, greatest magnitude) for each.
        distance_m: The limit ends when the robot has moved so far.
        raises: Set the parameters to their greatest values, even if they are lower.
        check_period_s: Time between two checks of the distance; 0 for one in each control cycle.
    """

    greatest: Tuple[Tuple[str, float], ...]
    distance_m: float
    raises: bool = False
    check_period_s: float = 0.0


@dataclass(frozen=True)
class Step:
    """Result of one step of a recovery behaviour.

    Attributes:
        command: Command to publish, if any.
        done: The behaviour has ended.
        message: Warning for the log, "" for none.
        limit: Limit that holds after the behaviour, from the robot's present pose on.
    """

    command: Optional[Twist2D] = None
    done: bool = False
    message: str = ""
    limit: Optional[ParameterLimit] = None


class Recovery(Protocol):
    """Recovery behaviour, as the navigator uses it.

    Attributes:
        period_s: Time between two steps; 0 for a step in every cycle.
    """

    period_s: float

    def start(self, context: RecoveryContext) -> None:
        """Start the behaviour, also after an earlier run that was stopped."""
        ...

    def step(self, context: RecoveryContext) -> Step:
        """Do the next step."""
        ...


class OneStepRecovery:
    """Base of the behaviours that do all in one step and have no state."""

    period_s = 0.0

    def __init__(self, params: Any) -> None:
        self.params = params

    def start(self, context: RecoveryContext) -> None:
        """Start the behaviour; it has no state."""
