"""Parameters of the tracking of moving obstacles."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class TrackerParams:
    """Parameters of the tracking of moving obstacles, see ``docs/moving_obstacles.md``.

    Attributes:
        track_moving_obstacles: Track what moves; False leaves everything to the costmaps.
        range_m: Farthest range at which obstacles are tracked.
        min_speed_mps: Slower obstacles count as standing.
        max_radius_m: Larger obstacles count as standing.
        acceleration_mps2: Standard deviation of the obstacles' accelerations.
        lost_after_s: Time for which an obstacle that is hidden is predicted.
        margin_m: A point moves if it is inside space that was free, by so much.
    """

    track_moving_obstacles: bool = False
    range_m: float = 10.0
    min_speed_mps: float = 0.2
    max_radius_m: float = 1.0
    acceleration_mps2: float = 1.5
    lost_after_s: float = 1.5
    margin_m: float = 0.12
