"""Inflation layer: costs that fall with the distance to the nearest obstacle.

At distance d from a lethal cell the cost is 254 for d = 0, 253 up to the inscribed radius r (a
robot with its centre there touches the obstacle), and 252 exp(-k (d - r)) beyond it, with k the
cost scaling factor, cut to a whole number. Beyond the inflation radius it is 0.

Obstacles just outside of a window reach into it. Seeds are therefore taken from one inflation
radius around the window, and cells up to two radii away can change.

Each update spreads all costs of the window again. A new or lost seed changes more than its own
radius: a cell passes on one seed only, so a cell that it wins no longer passes on the former one,
and so on from cell to cell. Only regions that are not connected are independent of each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.cost_grid import EVERYWHERE, Bounds, CostGrid, Window
from quad_nav.costmap.layer import Layer, LayerParams
from quad_nav.files.kernel_cache import njit
from quad_nav.geometry import Pose2D
from quad_nav.grid import FREE, INSCRIBED, LETHAL, UNKNOWN, GridSpec
from quad_nav.parameter import flag, number

_VISITED = -1  # a state below all others
_LEFT, _LOWER, _RIGHT, _UPPER = 1, 2, 4, 8  # steps that lead away from the seed
_STEP_BITS = 4
_PART = 64  # cells of a row that are searched for seeds at once


@dataclass(frozen=True)
class InflationLayerParams(LayerParams):
    """Parameters of ``costmap_2d::InflationLayer``."""

    cost_scaling_factor: float = number(
        "cost_scaling_factor", 10.0, "1/m", 0, 100, "Decay of costs beyond the inscribed radius."
    )
    inflation_radius_m: float = number(
        "inflation_radius", 0.55, "metres", 0, 50, "Distance to which obstacles are inflated."
    )
    inflate_unknown: bool = flag("inflate_unknown", False, "Inflate unknown cells, too.")

    def make_layer(self, spec: GridSpec, rolling_window: bool, default_cost: int) -> InflationLayer:
        """Make an inflation layer."""
        return InflationLayer(self, spec.resolution_m)


class Ranks(NamedTuple):
    """Distances from a seed, ranked, of those that have a cost.

    A cell's state is one number: the rank of its distance above ``shift`` bits, then its place
    in the table, then the steps that lead away from its seed. States compare as ranks do.
    """

    costs: NDArray[np.uint8]
    """uint8[ranks], cost at each rank"""
    states: NDArray[np.signedinteger[Any]]
    """int32 or int64[radius + 2, radius + 2], the highest state of the rank at (abs(dx), abs(dy))
    cells; of rank ``ranks`` where there is no cost"""
    shift: int


class InflationLayer(Layer):
    """Costs around the obstacles of the layers before it.

    Attributes:
        radius_cells: Inflation radius in cells, rounded up.
        cost_table: uint8[radius_cells + 2, radius_cells + 2], cost at (abs(dx), abs(dy)) cells.
    """

    params: InflationLayerParams

    def __init__(
        self, params: InflationLayerParams, resolution_m: float, inscribed_radius_m: float = 0.0
    ) -> None:
        super().__init__(params)
        self._resolution_m = resolution_m
        self._inscribed_radius_m = inscribed_radius_m
        self._last_bounds = EVERYWHERE
        self._redo_everything = True
        self._make_tables()

    def reconfigure(self, params: InflationLayerParams) -> None:
        """Take other parameters and write all costs again at the next update."""
        if params != self.params:
            self.params = params
            self._redo_everything = True
            self._make_tables()

    def resize(self, spec: GridSpec) -> None:
        """Follow the master grid to another resolution; the layers before it ask for updates."""
        self._resolution_m = spec.resolution_m
        self._make_tables()

    def set_footprint(self, footprint: NDArray[np.float64], inscribed_radius_m: float) -> None:
        """Take another inscribed radius, and write all costs again at the next update."""
        self._inscribed_radius_m = inscribed_radius_m
        self._redo_everything = True
        self._make_tables()

    def reset(self, now_s: float) -> None:
        """Cancel a full update; the layer collects nothing."""
        self._redo_everything = False

    def update_bounds(self, robot: Pose2D, now_s: float, bounds: Bounds) -> Bounds:
        """Return what changed now or in the last update, grown by the inflation radius."""
        last, self._last_bounds = self._last_bounds, bounds
        if self._redo_everything:
            self._redo_everything = False
            return EVERYWHERE
        return bounds.union(last).grown(self.params.inflation_radius_m)

    def update_costs(self, master: CostGrid, window: Window) -> None:
        """Spread costs from the lethal cells in and around the window."""
        if self.radius_cells == 0:
            return
        reach, spec = self.radius_cells, master.spec
        _inflate(
            master.costs,
            max(0, window.x0 - reach),
            min(spec.size_x, window.xn + reach),
            max(0, window.y0 - reach),
            min(spec.size_y, window.yn + reach),
            self._ranks,
            self.params.inflate_unknown,
        )

    def _make_tables(self) -> None:
        params = self.params
        self.radius_cells, self.cost_table, self._ranks = _tables(
            params.inflation_radius_m,
            params.cost_scaling_factor,
            self._resolution_m,
            self._inscribed_radius_m,
        )


@lru_cache(maxsize=64)  # the robots of a fleet have the same
def _tables(
    inflation_radius_m: float,
    cost_scaling_factor: float,
    resolution_m: float,
    inscribed_radius_m: float,
) -> Tuple[int, NDArray[np.uint8], Ranks]:
    """Return the radius in cells, the costs at distances and their ranks, all read-only."""
    radius_cells = int(max(0.0, math.ceil(inflation_radius_m / resolution_m)))

    def cost_at(distance_cells: float) -> int:
        if distance_cells == 0.0:
            return LETHAL
        beyond_m = distance_cells * resolution_m - inscribed_radius_m
        if distance_cells * resolution_m <= inscribed_radius_m:
            return INSCRIBED
        return int((INSCRIBED - 1) * math.exp(-1.0 * cost_scaling_factor * beyond_m))

    n = radius_cells + 2
    squared = np.array([[dx * dx + dy * dy for dx in range(n)] for dy in range(n)])
    cost_table = np.array([[cost_at(math.sqrt(d)) for d in row] for row in squared], dtype=np.uint8)
    return radius_cells, cost_table, _ranked(squared, cost_table, radius_cells)


def _ranked(squared: NDArray[np.int64], cost_table: NDArray[np.uint8], radius_cells: int) -> Ranks:
    """Rank the distances up to the radius that have a cost.

    Their squares in cells are int64[n, n], their costs uint8[n, n].
    """
    distances, ranks = np.unique(squared.ravel(), return_inverse=True)
    costs = np.zeros(len(distances), np.uint8)
    costs[ranks] = cost_table.ravel()
    costs = np.trim_zeros(costs[distances <= radius_cells**2], "b")
    shift = _STEP_BITS + squared.size.bit_length()
    fits = shift + len(costs).bit_length() < 32
    ranks = np.minimum(ranks, len(costs)).reshape(squared.shape)
    states = ((ranks + 1) << shift) - 1
    return Ranks(costs, states.astype(np.int32 if fits else np.int64), shift)


@njit(cache=True, nogil=True)
def _inflate(
    costs: NDArray[np.uint8],
    x0: int,
    xn: int,
    y0: int,
    yn: int,
    ranks: Ranks,
    inflate_unknown: bool,
) -> None:
    """Spread costs, uint8[H, W], from the lethal cells of a window.

    The window has columns x0..xn-1 and rows y0..yn-1. Cells are visited by rank, first in first out
    within one, and pass their seed on to their left, lower, right and upper neighbour. A cell keeps
    the first seed that reaches it, so this is close to the exact Euclidean transform and not equal
    to it.

    Four short cuts change nothing. Only the rectangle within reach of the seeds is looked at. A
    neighbour that already waits at the same or a lower rank is not queued again: it would find
    itself visited. A step back towards the seed is not tried: its rank is lower, so that the
    neighbour has been visited. Ranks without a cost are not visited.
    """
    shift, beyond, side = ranks.shift, ranks.costs.shape[0], ranks.states.shape[0]
    reach = side - 2
    seeds = _seeds(costs, x0, xn, y0, yn)
    if len(seeds) == 0:
        return
    rows, columns = seeds[:, 0], seeds[:, 1]
    low_x, low_y = max(0, columns.min() - reach), max(0, rows[0] - reach)
    high_x = min(costs.shape[1], columns.max() + 1 + reach)
    high_y = min(costs.shape[0], rows[-1] + 1 + reach)
    # Copies with a border of visited cells save the test for the grid's end.
    height, pitch = high_y - low_y + 2, high_x - low_x + 2
    near_2d = np.zeros((height, pitch), np.uint8)
    states_2d = np.full((height, pitch), _VISITED, ranks.states.dtype)
    unreached = ranks.states[side - 1, side - 1]
    for y in range(1, height - 1):
        _copy(costs[low_y + y - 1, low_x:high_x], near_2d[y, 1 : pitch - 1])
        states_2d[y, 1 : pitch - 1] = unreached
    near, states, table = near_2d.reshape(-1), states_2d.reshape(-1), ranks.states.reshape(-1)
    # Next and cell; the first entries are heads of the ranks' lists. Memory is taken from the
    # system as far as it is written to.
    most = len(seeds) + 4 * min(near.size, len(seeds) * (2 * reach + 1) ** 2)
    queue = np.empty((beyond + most, 2), np.int32)
    last = np.empty(beyond, np.int32)
    for rank in range(beyond):
        queue[rank, 0], last[rank] = -1, rank
    end = beyond
    for k in range(len(seeds)):
        cell = (rows[k] - low_y + 1) * pitch + columns[k] - low_x + 1
        states[cell] = _LEFT | _LOWER | _RIGHT | _UPPER
        end = _append(queue, last, end, 0, cell)
    payload = (1 << shift) - 1
    # Unsigned indices save the test for a negative one.
    one, row, column = np.uint64(1), np.uint64(pitch), np.uint64(side)
    for rank in range(beyond):
        cost = ranks.costs[rank]
        into_unknown = cost >= INSCRIBED or (inflate_unknown and cost > FREE)
        entry = queue[rank, 0]
        while entry >= 0:
            cell = np.uint64(queue[np.uint64(entry), 1])
            entry = queue[np.uint64(entry), 0]
            state = states[cell]
            if state >> shift == rank:
                states[cell] = _VISITED
                if near[cell] == UNKNOWN:
                    if into_unknown:
                        near[cell] = cost
                elif cost > near[cell]:
                    near[cell] = cost
                place = np.uint64((state & payload) >> _STEP_BITS)
                limit_x, limit_y = table[place + column], table[place + one]
                state_x = limit_x - payload + (np.int64(place + column) << _STEP_BITS)
                state_y = limit_y - payload + (np.int64(place + one) << _STEP_BITS)
                if state & _LEFT and limit_x < states[cell - one]:
                    states[cell - one] = state_x | (state & (_LEFT | _LOWER | _UPPER))
                    end = _append(queue, last, end, limit_x >> shift, cell - one)
                if state & _LOWER and limit_y < states[cell - row]:
                    states[cell - row] = state_y | (state & (_LEFT | _LOWER | _RIGHT))
                    end = _append(queue, last, end, limit_y >> shift, cell - row)
                if state & _RIGHT and limit_x < states[cell + one]:
                    states[cell + one] = state_x | (state & (_LOWER | _RIGHT | _UPPER))
                    end = _append(queue, last, end, limit_x >> shift, cell + one)
                if state & _UPPER and limit_y < states[cell + row]:
                    states[cell + row] = state_y | (state & (_LEFT | _RIGHT | _UPPER))
                    end = _append(queue, last, end, limit_y >> shift, cell + row)
    for y in range(1, height - 1):
        _copy(near_2d[y, 1 : pitch - 1], costs[low_y + y - 1, low_x:high_x])


@njit(cache=True, nogil=True)
def _copy(source: NDArray[np.uint8], target: NDArray[np.uint8]) -> None:
    for k in range(source.size):  # faster than an assignment of slices
        target[k] = source[k]


@njit(cache=True, nogil=True)
def _seeds(costs: NDArray[np.uint8], x0: int, xn: int, y0: int, yn: int) -> NDArray[np.int64]:
    """Return row and column, int64[s, 2], of a window's lethal cells, in row order."""
    in_row = np.zeros(yn - y0, np.int64)
    for y in range(y0, yn):
        in_row[y - y0] = _count_lethal(costs[y, x0:xn])
    seeds = np.empty((in_row.sum(), 2), np.int64)
    count = 0
    for y in range(y0, yn):
        if in_row[y - y0] == 0:
            continue
        for begin in range(x0, xn, _PART):
            part = costs[y, begin : min(begin + _PART, xn)]
            if _count_lethal(part) == 0:
                continue
            for x in range(part.size):
                if part[x] == LETHAL:
                    seeds[count, 0], seeds[count, 1] = y, begin + x
                    count += 1
    return seeds


@njit(cache=True, nogil=True)
def _count_lethal(costs: NDArray[np.uint8]) -> int:
    count = 0
    for x in range(costs.size):  # a loop that the compiler makes vectors of
        count += costs[x] == LETHAL
    return count


@njit(cache=True, nogil=True, inline="always")
def _append(
    queue: NDArray[np.int32], last: NDArray[np.int32], end: int, rank: int, cell: int
) -> int:
    """Append a cell to a rank's list; return the end of the entries."""
    entry, index = np.uint64(end), np.uint64(rank)
    queue[entry, 0] = -1
    queue[entry, 1] = cell
    queue[np.uint64(last[index]), 0] = end
    last[index] = end
    return end + 1
