"""Parameters of the avoidance between robots."""

from __future__ import annotations

from dataclasses import dataclass

from quad_nav.parameter import flag, number


@dataclass(frozen=True)
class PeerParams:
    """Parameters of the avoidance of peers, see ``docs/peers.md``.

    Attributes:
        margin_m: Hulls stay twice as far apart.
        moving_obstacle_patience_s: A random time of up to twice as much is added.
    """

    avoid_peers: bool = flag(
        "avoid_peers", True, "Avoid the peers whose poses are known, and yield.", upstream=False
    )
    margin_m: float = number(
        "margin", 0.05, "metres", 0, 2, "Distance of a footprint from the bisector of two robots."
    )
    timeout_s: float = number(
        "timeout", 0.5, "seconds", 0, 60, "Age from which a peer's state is left to the LIDAR."
    )
    yield_when_idle: bool = flag(
        "yield_when_idle", True, "A robot without a goal leaves the path of peers.", upstream=False
    )
    roundabouts: bool = flag(
        "roundabouts", True, "Where four robots meet, all keep right of a circle.", upstream=False
    )
    yield_to_moving_obstacles: bool = flag(
        "yield_to_moving_obstacles", False, "Make room for one that is in the way.", upstream=False
    )
    moving_obstacle_patience_s: float = number(
        "moving_obstacle_patience", 3.0, "seconds", 0.1, 60, "Time until the robot makes room."
    )
