"""What a recovery behaviour is, and what it may look at, change and ask for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Protocol, Tuple

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.geometry import Pose2D, Twist2D


@dataclass(frozen=True)
class RecoveryContext:
    """What a recovery may look at and change. Poses are None when unknown."""

    now_s: float
    global_costmap: LayeredCostmap
    local_costmap: LayeredCostmap
    pose_in_global: Optional[Pose2D]
    pose_in_local: Optional[Pose2D]

    @property
    def costmaps(self) -> Tuple[Tuple[str, LayeredCostmap, Optional[Pose2D]], ...]:
        """(name, costmap, the robot's pose on it): global, local."""
        return (
            ("global", self.global_costmap, self.pose_in_global),
            ("local", self.local_costmap, self.pose_in_local),
        )


@dataclass(frozen=True)
class ParameterLimit:
    """What a controller's parameters may be at most until the robot has moved ``distance_m``.

    ``greatest``: (field of the controller's parameters, greatest magnitude).
    """

    greatest: Tuple[Tuple[str, float], ...]
    distance_m: float


@dataclass(frozen=True)
class Step:
    """One step of a recovery: a command to send, if any, and whether it is over.

    ``limit`` holds after the recovery, from where the robot is now.
    """

    command: Optional[Twist2D] = None
    done: bool = False
    message: str = ""
    limit: Optional[ParameterLimit] = None


class Recovery(Protocol):
    """What the navigator asks of a recovery behaviour."""

    period_s: float

    def start(self, context: RecoveryContext) -> None: ...

    def step(self, context: RecoveryContext) -> Step: ...
