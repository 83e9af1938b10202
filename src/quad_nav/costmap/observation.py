"""Observations: points that one sensor saw lately, and how long they count."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import List, Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.kernels.raytrace import ObservationStack


@dataclass(frozen=True)
class SourceParams:
    """Entry of an obstacle layer's ``observation_sources``.

    Attributes:
        sensor_frame: Frame where rays start; "" for the frame of the message.
        expected_update_period_s: ``expected_update_rate`` of the YAML, which is a period; 0 for
            never stale.
        obstacle_range_m: None for the layer's.
        raytrace_range_m: None for the layer's.
    """

    name: str
    topic: str = ""
    sensor_frame: str = ""
    data_type: str = "PointCloud"
    observation_persistence_s: float = 0.0
    expected_update_period_s: float = 0.0
    min_obstacle_height_m: float = 0.0
    max_obstacle_height_m: float = 2.0
    obstacle_range_m: Optional[float] = None
    raytrace_range_m: Optional[float] = None
    marking: bool = True
    clearing: bool = False
    inf_is_valid: bool = False


@dataclass(frozen=True)
class Observation:
    """Points of one message, in the global frame.

    Attributes:
        stamp_s: When the sensor saw them.
        sensor: float64[3], where the rays start, metres.
        points: float32[n, 3], metres.
        stamp_ns: The stamp in whole nanoseconds.
    """

    stamp_s: float
    sensor: NDArray[np.float64]
    points: NDArray[np.float32]
    stamp_ns: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "stamp_ns", _nanoseconds(self.stamp_s))


class ObservationBuffer:
    """Observations of one source, newest first.

    Observations expire when a message arrives, and never between messages: those of a silent
    sensor stay.
    """

    def __init__(self, params: SourceParams) -> None:
        self.params = params
        self.observations: List[Observation] = []
        self._last_reception_s: Optional[float] = None
        self._stack: Optional[ObservationStack] = None
        self._points = np.empty((0, 3), np.float32)  # those of the observations, and old ones
        self._begins: List[int] = []  # of the observations' points in that
        self._end = 0

    @property
    def stack(self) -> ObservationStack:
        """All observations kept, newest first, for the kernels."""
        if self._stack is None:
            count = len(self.observations)
            begins = np.array(self._begins[:count], np.int64)
            lengths = np.array([len(one.points) for one in self.observations], np.int64)
            sensors = [one.sensor for one in self.observations] or [np.empty(0)]
            self._stack = ObservationStack(
                np.concatenate(sensors).reshape(count, 3), self._points, begins, begins + lengths
            )
        return self._stack

    def add(self, observation: Observation, now_s: float) -> None:
        """Keep an observation that arrived now; drop those that have expired."""
        self.observations.insert(0, observation)
        self._begins.insert(0, self._end)
        self._stack = None
        self.restart_clock(now_s)
        if self.observations:  # else it has expired itself
            self._store(observation.points)

    def start_clock(self, now_s: float) -> None:
        """Count silence from now if nothing was ever received."""
        if self._last_reception_s is None:
            self._last_reception_s = now_s

    def restart_clock(self, now_s: float) -> None:
        """Count silence from now."""
        self._last_reception_s = now_s
        self._drop_stale(now_s)

    def silence_s(self, now_s: float) -> float:
        """Return the time since the last message, or since ``start_clock``."""
        return 0.0 if self._last_reception_s is None else now_s - self._last_reception_s

    def is_current(self, now_s: float) -> bool:
        """Tell whether the source is within its expected update period."""
        period_s = self.params.expected_update_period_s
        return period_s == 0.0 or _nanoseconds(self.silence_s(now_s)) <= _nanoseconds(period_s)

    def _store(self, points: NDArray[np.float32]) -> None:
        """Append points to the array; if there is no room, move all to a larger one."""
        if self._end + len(points) <= len(self._points):
            self._points[self._end : self._end + len(points)] = points
            self._end += len(points)
            return
        clouds = [one.points for one in reversed(self.observations)]
        ends = np.cumsum([len(cloud) for cloud in clouds]).tolist()
        self._begins = [0, *ends[:-1]][::-1]
        self._end = ends[-1]
        self._points = np.concatenate([*clouds, np.empty((self._end, 3), np.float32)])

    def _drop_stale(self, reception_s: float) -> None:
        persistence_s = self.params.observation_persistence_s
        if persistence_s == 0.0:
            self._drop_from(1)
            return
        oldest_ns = _nanoseconds(reception_s) - _nanoseconds(persistence_s)
        for k, observation in enumerate(self.observations):
            if observation.stamp_ns < oldest_ns:
                self._drop_from(k)
                return

    def _drop_from(self, first: int) -> None:
        del self.observations[first:]
        del self._begins[first:]
        self._stack = None


def _nanoseconds(seconds: float) -> int:
    """Return whole nanoseconds, which ROS compares; so 0.3 s is never above 0.3 s."""
    return round(seconds * 1e9)
