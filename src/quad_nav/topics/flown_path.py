"""Where a quadcopter has been."""

from __future__ import annotations

import collections
from typing import Callable, Deque, Generic, Optional, TypeVar

from quad_nav.geometry import Pose2D, Pose3D

PATH_PERIOD_S = 0.5
PATH_SPACING_M = 0.05
PATH_POSES = 1000  # 50 m, and some megabyte of messages

T = TypeVar("T")


class FlownPath(Generic[T]):
    """Poses some way apart, to be told twice a second while the quadcopter moves.

    ``poses``: the newest ones, as ``make`` makes them of a stamp in seconds and a pose.
    """

    def __init__(self, make: Callable[[float, Pose3D], T]):
        self._make = make
        self.poses: Deque[T] = collections.deque(maxlen=PATH_POSES)
        self._last: Optional[Pose2D] = None
        self._is_news = False
        self._next_s = 0.0

    def clear(self) -> None:
        self.poses.clear()
        self._last = None
        self._next_s = 0.0

    def add(self, stamp_s: float, pose: Pose3D) -> bool:
        """Take a pose in ``map``; whether it is time to tell the path."""
        here = Pose2D(pose.x_m, pose.y_m)
        if self._last is None or here.distance_to(self._last) >= PATH_SPACING_M:
            self._last = here
            self.poses.append(self._make(stamp_s, pose))
            self._is_news = True
        if not self._is_news or stamp_s < self._next_s:
            return False
        self._is_news = False
        self._next_s = stamp_s + PATH_PERIOD_S
        return True
