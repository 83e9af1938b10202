"""Names of topics, and publication schedules of costmaps and flown paths."""

from __future__ import annotations

import collections
from typing import Callable, Deque, Generic, Optional, TypeVar

from quad_nav.costmap.cost_grid import NO_CELLS, Window
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.grid import GridSpec
from quad_nav.timing import Schedule, is_due

PATH_PERIOD_S = 0.5
PATH_SPACING_M = 0.05
PATH_POSES = 1000  # 50 m, about a megabyte of messages

T = TypeVar("T")

Names = Callable[[str], str]
"""Maps the name that move_base uses for a topic, service or parameter to the actual one."""

_ACTION = ("goal", "cancel", "status", "feedback", "result", "recovery_status")
_NUMBERED = ("clicked_point", "cmd_vel", "initialpose", "odom", "scan", "move_base_simple/goal")


def own_node(name: str) -> str:
    """Return the name unchanged, for the only robot of a node: rospy resolves and remaps it."""
    return name


def in_fleet(number: int) -> Names:
    """Return the names of a robot that shares its node with others.

    A launch file cannot remap these, and the node has only one private namespace. The names are
    those that the remaps of `launch/quad.launch` lead to.
    """
    node = f"/move_base{number}"
    remaps = {f"/{name}": f"/{name}{number}" for name in _NUMBERED}
    remaps.update({f"/move_base/{name}": f"{node}/{name}" for name in _ACTION})
    remaps["/move_base"] = node

    def resolved(name: str) -> str:
        if name.startswith("~"):
            return f"{node}/{name[1:]}".rstrip("/")
        absolute = name if name.startswith("/") else f"/{name}"
        return remaps.get(absolute, absolute)

    return resolved


def topic_below(namespace: str, topic: str) -> str:
    """Return the name of a topic of a namespace, unless it is absolute."""
    return topic if topic.startswith("/") else f"{namespace}/{topic}"


class CostmapSchedule:
    """Collect the windows that updates of a costmap change until publishing is due.

    The rules are those of costmap_2d: publish the full grid when the map has moved or changed its
    size, else only the window that changed, at the publish frequency.
    """

    def __init__(self, costmap: LayeredCostmap) -> None:
        """Start at time 0 with nothing changed and nothing published."""
        self._costmap = costmap
        self._changed = self._last = NO_CELLS
        self._has_begun = False
        self._published_s = 0.0
        self._published: Optional[GridSpec] = None
        self._schedule = Schedule(costmap.params.publish_frequency_hz)
        self.restart(0.0)

    def restart(self, now_s: float) -> None:
        """Restart the schedule after a clock jump: publishing is due after one period."""
        self._published_s = now_s
        self._schedule.start(now_s)
        self._schedule.pop(now_s)

    def add(self, now_s: float, window: Optional[Window]) -> bool:
        """Add the window that an update changed, None if it was not made.

        A late update does not delay the following ones.

        Returns:
            True if publishing is due; never with a publish frequency of 0, nor before an update.
        """
        params = self._costmap.params
        self._has_begun = self._has_begun or window is not None
        if window not in (None, NO_CELLS):
            self._last = window
        self._changed = self._changed.union(window or NO_CELLS)
        if not params.publish_on_time:
            self._changed = self._changed.union(self._last)
            return self._has_begun and self._pop_late(now_s, params.publish_frequency_hz)
        self._schedule.set_frequency(params.publish_frequency_hz, now_s)
        return self._has_begun and self._schedule.pop(now_s)

    def _pop_late(self, now_s: float, frequency_hz: float) -> bool:
        """Return whether more than a period has passed, in whole nanoseconds as in ROS."""
        passed_ns = round((now_s - self._published_s) * 1e9)
        if frequency_hz <= 0.0 or passed_ns <= round(1e9 / frequency_hz):
            return False
        self._published_s = now_s
        return True

    def pop(self) -> Window:
        """Return the window that has changed since the last call."""
        changed, self._changed = self._changed, NO_CELLS
        return changed

    def pop_full_grid(self) -> bool:
        """Return whether the full grid is due, and count it as published."""
        costmap = self._costmap
        is_due = costmap.params.always_send_full_costmap or costmap.spec != self._published
        self._published = costmap.spec
        return is_due


class FlownPath(Generic[T]):
    """Recent poses at a minimum spacing, due twice a second while the quadcopter moves.

    Attributes:
        poses: The newest poses, oldest first, as `make` returned them.
    """

    def __init__(self, make: Callable[[float, Pose3D], T]) -> None:
        """Start an empty path.

        Args:
            make: Converts a stamp in seconds and a pose in `map` to an entry of `poses`.
        """
        self._make = make
        self.poses: Deque[T] = collections.deque(maxlen=PATH_POSES)
        self._last: Optional[Pose2D] = None
        self._has_grown = False
        self._next_s = 0.0

    def clear(self) -> None:
        """Remove all poses and restart the schedule."""
        self.poses.clear()
        self._last = None
        self._next_s = 0.0

    def add(self, stamp_s: float, pose: Pose3D) -> bool:
        """Add a pose in `map` and return whether publishing the path is due."""
        here = Pose2D(pose.x_m, pose.y_m)
        if self._last is None or here.distance_to(self._last) >= PATH_SPACING_M:
            self._last = here
            self.poses.append(self._make(stamp_s, pose))
            self._has_grown = True
        if not self._has_grown or not is_due(self._next_s, stamp_s):
            return False
        self._has_grown = False
        self._next_s = stamp_s + PATH_PERIOD_S
        return True
