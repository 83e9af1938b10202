"""Costmaps of a recording at any time: the last full grid, and the updates since."""

from __future__ import annotations

import collections
import zlib
from dataclasses import dataclass
from typing import Any, Callable, Optional, OrderedDict, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.grid import GridSpec
from quad_nav.topics.validation import MAX_MAGNITUDE
from quad_web.replay.recording_index import RecordingIndex

_KEYFRAME_EVERY = 40  # updates
_MOST_KEYFRAMES = 200
MAX_CELLS = 50_000_000
"""Larger grids are not shown."""


@dataclass(frozen=True)
class RecordedCostmap:
    """A costmap at one time.

    Attributes:
        spec: Its cells, in ``frame``.
        costs: int8[rows, columns] as of ``nav_msgs/OccupancyGrid``; not changed afterwards.
        frame: Name of its frame.
    """

    spec: GridSpec
    costs: NDArray[np.int8]
    frame: str


class CostmapTrack:
    """One costmap of a recording.

    The states after every few updates are kept, compressed, so that a second jump is quick.
    """

    def __init__(
        self,
        index: RecordingIndex,
        topic: str,
        times_s: NDArray[np.float64],
        update_times_s: NDArray[np.float64],
    ) -> None:
        """Show the costmap of ``topic``, full grids float64[n], and its updates, float64[m]."""
        self._index, self._topic = index, topic
        self._times_s, self._update_times_s = times_s, update_times_s
        self._keyframes: OrderedDict[Tuple[int, int], bytes] = collections.OrderedDict()
        self._full: Optional[Tuple[int, Any]] = None  # number and content of the last full grid
        self._last: Optional[Tuple[Tuple[int, int], NDArray[np.int8]]] = None

    def place(self, time_s: float) -> Optional[Tuple[int, int]]:
        """Identify the state at a time: number of the full grid, and of updates up to it."""
        full = int(np.searchsorted(self._times_s, time_s, side="right")) - 1
        if full < 0:
            return None
        return full, int(np.searchsorted(self._update_times_s, time_s, side="right"))

    def at(
        self, place: Tuple[int, int], has_time: Callable[[], bool] = lambda: True
    ) -> Optional[RecordedCostmap]:
        """Return the costmap at a place; ``has_time`` is asked after each update.

        None if it is malformed, or if there was no time for all updates: call it again.

        Raises:
            InputError: The file is damaged there.
        """
        grid = self._full_grid(place[0])
        info = grid.info
        rows, columns = int(info.height), int(info.width)
        position = info.origin.position
        numbers = (float(info.resolution), position.x, position.y)
        if rows * columns != len(grid.data) or not 0 < rows * columns <= MAX_CELLS:
            return None
        if not all(abs(number) <= MAX_MAGNITUDE for number in numbers) or numbers[0] <= 0.0:
            return None
        costs = self._costs(place, np.asarray(grid.data, np.int8).reshape(rows, columns), has_time)
        if costs is None:
            return None
        spec = GridSpec(columns, rows, *numbers)
        return RecordedCostmap(spec, costs, grid.header.frame_id.lstrip("/"))

    def _full_grid(self, number: int) -> Any:
        if self._full is None or self._full[0] != number:
            self._full = number, self._index.read(self._topic, number).content
        return self._full[1]

    def _costs(
        self, place: Tuple[int, int], full: NDArray[np.int8], has_time: Callable[[], bool]
    ) -> Optional[NDArray[np.int8]]:
        """Apply the updates since the full grid, or since the nearest known state after it."""
        number, end = place
        first = int(np.searchsorted(self._update_times_s, self._times_s[number], side="right"))
        start, costs = self._nearest(number, first, end, full)
        for update in range(start, end):
            _apply(costs, self._index.read(f"{self._topic}_updates", update).content)
            if (update + 1 - first) % _KEYFRAME_EVERY == 0:
                self._keep((number, update + 1), costs)
            if update + 1 < end and not has_time():
                self._last = (number, update + 1), costs
                return None
        self._last = (number, max(start, end)), costs
        return costs.copy()

    def _nearest(
        self, number: int, first: int, end: int, full: NDArray[np.int8]
    ) -> Tuple[int, NDArray[np.int8]]:
        """Return the latest known state up to an update, and how many updates it has."""
        kept = [place[1] for place in self._keyframes if place[0] == number and place[1] <= end]
        start = max(kept, default=first)
        if self._last is not None:
            (last_number, last_end), costs = self._last
            if last_number == number and start <= last_end <= end:
                return last_end, costs
        if not kept:
            return first, full.copy()
        packed = zlib.decompress(self._keyframes[number, start])
        return start, np.frombuffer(packed, np.int8).reshape(full.shape).copy()

    def _keep(self, place: Tuple[int, int], costs: NDArray[np.int8]) -> None:
        self._keyframes[place] = zlib.compress(costs.tobytes(), 1)
        while len(self._keyframes) > _MOST_KEYFRAMES:
            self._keyframes.popitem(last=False)


def _apply(costs: NDArray[np.int8], update: Any) -> None:
    """Write an update into the costs, as far as it is on them."""
    rows, columns = int(update.height), int(update.width)
    x0, y0 = int(update.x), int(update.y)
    if rows * columns != len(update.data) or x0 < 0 or y0 < 0:
        return
    window = costs[y0 : y0 + rows, x0 : x0 + columns]
    data = np.asarray(update.data, np.int8).reshape(rows, columns)
    window[:] = data[: window.shape[0], : window.shape[1]]
