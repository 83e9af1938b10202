"""Observations: points that one sensor saw lately, and how long they count."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Callable, List, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.observation_kernel import (
    ObservationStack,
    Ranges,
    store_marks,
    store_observation,
)
from quad_nav.parameter import ANY, fixed_flag, fixed_number, fixed_text


@dataclass(frozen=True)
class SourceParams:
    """Entry of an obstacle layer's ``observation_sources``.

    Attributes:
        expected_update_period_s: ``expected_update_rate`` of the YAML, which is a period.
        obstacle_range_m: None for the layer's; ``raytrace_range_m`` too.
    """

    name: str
    topic: str = fixed_text("topic", "", "a topic's name", "The source's name if unset.")
    sensor_frame: str = fixed_text(
        "sensor_frame", "", "a frame's name", "Frame of the rays' start; the message's if unset."
    )
    data_type: str = fixed_text(
        "data_type", "PointCloud", "LaserScan, PointCloud or PointCloud2", "Type of the topic."
    )
    observation_persistence_s: float = fixed_number(
        "observation_persistence", 0.0, "seconds", "Observations stay so long; 0 for the newest."
    )
    expected_update_period_s: float = fixed_number(
        "expected_update_rate", 0.0, "seconds", "Period after which data is overdue; 0 for never."
    )
    min_obstacle_height_m: float = fixed_number(
        "min_obstacle_height", 0.0, "metres", "Points below this height are ignored.", ANY
    )
    max_obstacle_height_m: float = fixed_number(
        "max_obstacle_height", 2.0, "metres", "Points above this height are ignored.", ANY
    )
    obstacle_range_m: Optional[float] = fixed_number(
        "obstacle_range", None, "metres", "Range of marking; the layer's if unset."
    )
    raytrace_range_m: Optional[float] = fixed_number(
        "raytrace_range", None, "metres", "Range of clearing; the layer's if unset."
    )
    marking: bool = fixed_flag("marking", True, "The sensor marks obstacles.")
    clearing: bool = fixed_flag("clearing", False, "The sensor clears the space before obstacles.")
    inf_is_valid: bool = fixed_flag(
        "inf_is_valid", False, "Beams of a LaserScan that return inf clear up to range_max."
    )


MakePoints = Callable[[], NDArray[np.float32]]
"""Makes float32[n, 3], metres."""


class Observation:
    """Points of one message, in the global frame, made when a costmap first needs them.

    Many messages need not be projected: another comes before the costmaps are updated.

    Attributes:
        stamp_s: When the sensor saw them.
        sensor: float64[3], where the rays start, metres.
        stamp_ns: The stamp in whole nanoseconds.
        some_mark: Not all of the points mark.
    """

    def __init__(
        self,
        stamp_s: float,
        sensor: NDArray[np.float64],
        make_points: MakePoints,
        make_marks: Optional[MakePoints] = None,
    ) -> None:
        self.stamp_s, self.sensor = stamp_s, sensor
        self.stamp_ns = _nanoseconds(stamp_s)
        self.some_mark = make_marks is not None
        self._make_points, self._make_marks = make_points, make_marks
        # Not cached_property: before Python 3.12 it has one lock for all robots of a process.
        self._points: Optional[NDArray[np.float32]] = None
        self._marks: Optional[NDArray[np.float32]] = None

    @property
    def points(self) -> NDArray[np.float32]:
        """float32[n, 3], metres."""
        if self._points is None:
            self._points = self._make_points()
        return self._points

    @property
    def marks(self) -> NDArray[np.float32]:
        """float32[m, 3], the points that mark, metres."""
        if self._marks is None:
            self._marks = self.points if self._make_marks is None else self._make_marks()
        return self._marks


class ObservationBuffer:
    """Observations of one source, newest first.

    Observations expire when a message arrives, and never between messages: those of a silent
    sensor stay.
    """

    def __init__(self, params: SourceParams) -> None:
        self.params = params
        self.observations: List[Observation] = []
        self._persistence_ns = _nanoseconds(params.observation_persistence_s)
        self.expect_within(params.expected_update_period_s)
        self._in_order = True  # no stamp of an observation is above that of a newer one
        self._last_reception_s: Optional[float] = None
        self._stack = _make_stack(0, 0)
        self._newest = 0  # slot of the stack
        self._unstored = 0  # newest observations that are not in the stack
        self._ranges: Optional[Ranges] = None  # of the observations in it

    def expect_within(self, period_s: float) -> None:
        """Expect a message within another period."""
        self.params = replace(self.params, expected_update_period_s=period_s)
        self._period_ns = _nanoseconds(period_s)

    def stack(self, ranges: Ranges) -> Tuple[ObservationStack, int, int]:
        """Return the observations for the kernels: a ring, the slot of the newest, their number."""
        kept = len(self.observations)
        if ranges != self._ranges:
            self._ranges, self._unstored = ranges, kept
        if self._unstored:
            slots, width = self._stack.sectors.shape
            fresh = self.observations[: self._unstored]
            points = [one.points for one in fresh]
            most = max(map(len, points), default=0)
            if kept > slots or most > width:
                slots, width = max(slots, kept + kept // 2), max(width, most)
                self._stack = _make_stack(slots, width)
                fresh = self.observations
                points = [one.points for one in fresh]
            for one, own in zip(reversed(fresh), reversed(points)):
                self._newest = (self._newest + 1) % slots
                store_observation(self._stack, self._newest, one.sensor, own, ranges)
                if one.some_mark:
                    store_marks(self._stack, self._newest, one.sensor, one.marks, ranges)
            self._unstored = 0
        return self._stack, self._newest, kept

    def add(self, observation: Observation, now_s: float) -> None:
        """Keep an observation that arrived now; drop those that have expired."""
        if self.observations and observation.stamp_ns < self.observations[0].stamp_ns:
            self._in_order = False
        self.observations.insert(0, observation)
        self._unstored += 1
        self._last_reception_s = now_s
        # Rounding is slow, and mostly a message counts from its stamp on.
        at_stamp = now_s == observation.stamp_s
        self._drop_stale(observation.stamp_ns if at_stamp else _nanoseconds(now_s))

    def start_clock(self, now_s: float) -> None:
        """Count silence from now if nothing was ever received."""
        if self._last_reception_s is None:
            self._last_reception_s = now_s

    def restart_clock(self, now_s: float) -> None:
        """Count silence from now."""
        self._last_reception_s = now_s
        self._drop_stale(_nanoseconds(now_s))

    def silence_s(self, now_s: float) -> float:
        """Return the time since the last message, or since ``start_clock``."""
        return 0.0 if self._last_reception_s is None else now_s - self._last_reception_s

    def is_current(self, now_s: float) -> bool:
        """Tell whether the source is within its expected update period."""
        period_s, silence_s = self.params.expected_update_period_s, self.silence_s(now_s)
        # Rounding is slow: it decides only where it can.
        return (
            period_s == 0.0
            or silence_s < period_s - 1e-8
            or _nanoseconds(silence_s) <= self._period_ns
        )

    def _drop_stale(self, reception_ns: int) -> None:
        if self.params.observation_persistence_s == 0.0:
            del self.observations[1:]
            return
        oldest_ns = reception_ns - self._persistence_ns
        if self._in_order:
            while self.observations and self.observations[-1].stamp_ns < oldest_ns:
                self.observations.pop()
            return
        for k, observation in enumerate(self.observations):
            if observation.stamp_ns < oldest_ns:
                del self.observations[k:]
                return


def _make_stack(slots: int, width: int) -> ObservationStack:
    """Make a ring for so many observations of so many points."""
    return ObservationStack(
        np.empty((slots, 3)),
        np.empty((slots, width, 2), np.float32),
        np.empty((slots, width), np.int16),
        np.empty((slots, width, 2), np.float32),
        np.zeros((slots, 2), np.int64),
        np.empty((slots, 4)),
        np.empty((slots, 9)),
    )


@lru_cache(maxsize=64)  # the scans of all robots often have one stamp, and rounding is slow
def _nanoseconds(seconds: float) -> int:
    """Return whole nanoseconds, which ROS compares; so 0.3 s is never above 0.3 s."""
    return round(seconds * 1e9)
