"""What one sensor saw lately: points in the global frame, and for how long they count."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import List, Optional

import numpy as np


@dataclass(frozen=True)
class SourceParams:
    """One entry of an obstacle layer's ``observation_sources``.

    ``expected_update_period_s`` is what YAML calls ``expected_update_rate``: a
    period, 0 for "never stale". ``sensor_frame`` "" means the frame of the message.
    Ranges that are None are those of the layer.
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
    """``points``: float32[n, 3], ``sensor``: float64[3], both in the global frame, metres."""

    stamp_s: float
    sensor: np.ndarray
    points: np.ndarray

    @cached_property
    def stamp_ns(self) -> int:
        return _nanoseconds(self.stamp_s)


@dataclass(frozen=True)
class ObservationStack:
    """Observations in one piece, for kernels: sensors float64[k, 3], points float32[n, 3].

    Observation i has the points from ``ends[i - 1]``, or 0, to ``ends[i]``, int64[k].
    """

    sensors: np.ndarray
    points: np.ndarray
    ends: np.ndarray


class ObservationBuffer:
    """The observations of one source, newest first.

    Age is judged when a message arrives, against that moment, and never between messages:
    if a sensor falls silent its last observations stay.
    """

    def __init__(self, params: SourceParams):
        self.params = params
        self.observations: List[Observation] = []
        self._last_reception_s: Optional[float] = None
        self._stack: Optional[ObservationStack] = None

    @property
    def stack(self) -> ObservationStack:
        """All that is kept, newest first."""
        if self._stack is None:
            self._stack = _stacked(self.observations)
        return self._stack

    def add(self, observation: Observation, now_s: float) -> None:
        """Keep an observation that arrived now; drop those that are too old now."""
        self.observations.insert(0, observation)
        self._stack = None
        self.restart_clock(now_s)

    def start_clock(self, now_s: float) -> None:
        """Count silence from now if nothing was ever received."""
        if self._last_reception_s is None:
            self._last_reception_s = now_s

    def restart_clock(self, now_s: float) -> None:
        """Count silence from now."""
        self._last_reception_s = now_s
        self._drop_stale(now_s)

    def silence_s(self, now_s: float) -> float:
        return 0.0 if self._last_reception_s is None else now_s - self._last_reception_s

    def is_current(self, now_s: float) -> bool:
        period_s = self.params.expected_update_period_s
        return period_s == 0.0 or _nanoseconds(self.silence_s(now_s)) <= _nanoseconds(period_s)

    def _drop_stale(self, reception_s: float) -> None:
        persistence_s = self.params.observation_persistence_s
        if persistence_s == 0.0:
            del self.observations[1:]
            self._stack = None
            return
        oldest_ns = _nanoseconds(reception_s) - _nanoseconds(persistence_s)
        for k, observation in enumerate(self.observations):
            if observation.stamp_ns < oldest_ns:
                del self.observations[k:]
                self._stack = None
                return


def _stacked(observations: List[Observation]) -> ObservationStack:
    if not observations:
        return ObservationStack(np.empty((0, 3)), np.empty((0, 3), np.float32),
                                np.empty(0, np.int64))
    return ObservationStack(np.array([one.sensor for one in observations]),
                            np.concatenate([one.points for one in observations]),
                            np.cumsum([len(one.points) for one in observations]))


def _nanoseconds(seconds: float) -> int:
    """ROS compares times as whole nanoseconds; so 0.3 s is never above 0.3 s."""
    return round(seconds * 1e9)
