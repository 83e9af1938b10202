"""A grid of costs that can move, and the parts of it that change."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.cost_grid_kernel import CostmapView, fill_polygon, raise_to, reset_to
from quad_nav.grid import FREE, INSCRIBED, LETHAL, UNKNOWN, GridSpec


@dataclass(frozen=True)
class Window:
    """Cells of columns x0..xn-1 and rows y0..yn-1."""

    x0: int
    xn: int
    y0: int
    yn: int

    @property
    def is_empty(self) -> bool:
        """True if the window has no cells."""
        return self.xn <= self.x0 or self.yn <= self.y0

    def union(self, other: Window) -> Window:
        """Return the smallest window that holds both; an empty one adds nothing."""
        if self.is_empty or other.is_empty:
            return other if self.is_empty else self
        return Window(
            min(self.x0, other.x0),
            max(self.xn, other.xn),
            min(self.y0, other.y0),
            max(self.yn, other.yn),
        )

    def intersection(self, other: Window) -> Window:
        """Return the cells that are in both."""
        return Window(
            max(self.x0, other.x0),
            min(self.xn, other.xn),
            max(self.y0, other.y0),
            min(self.yn, other.yn),
        )

    @property
    def slices(self) -> Tuple[slice, slice]:
        """Index of the window in ``[y, x]`` arrays."""
        return slice(self.y0, self.yn), slice(self.x0, self.xn)


NO_CELLS = Window(0, 0, 0, 0)


@dataclass(frozen=True)
class Bounds:
    """Rectangle in metres, in the global frame; empty with a minimum above its maximum."""

    min_x_m: float
    min_y_m: float
    max_x_m: float
    max_y_m: float

    def union(self, other: Bounds) -> Bounds:
        """Return the smallest rectangle that holds both."""
        return Bounds(
            min(self.min_x_m, other.min_x_m),
            min(self.min_y_m, other.min_y_m),
            max(self.max_x_m, other.max_x_m),
            max(self.max_y_m, other.max_y_m),
        )

    def grown(self, margin_m: float) -> Bounds:
        """Return the rectangle with a margin on each side."""
        return Bounds(
            self.min_x_m - margin_m,
            self.min_y_m - margin_m,
            self.max_x_m + margin_m,
            self.max_y_m + margin_m,
        )

    def including(self, points: NDArray[np.float64]) -> Bounds:
        """Return the smallest rectangle that also holds points, float64[n, 2]."""
        return self.union(Bounds(*points.min(axis=0).tolist(), *points.max(axis=0).tolist()))


NOWHERE = Bounds(1e30, 1e30, -1e30, -1e30)
_FLOAT_MAX = float(np.finfo(np.float32).max)
EVERYWHERE = Bounds(-_FLOAT_MAX, -_FLOAT_MAX, _FLOAT_MAX, _FLOAT_MAX)


class Square(NamedTuple):
    """Square around a point, metres in the global frame."""

    x_m: float
    y_m: float
    side_m: float

    @property
    def corners(self) -> NDArray[np.float64]:
        """Corners, float64[4, 2]."""
        half_m = 0.5 * self.side_m
        around = [[-half_m, -half_m], [-half_m, half_m], [half_m, half_m], [half_m, -half_m]]
        return np.array(around) + (self.x_m, self.y_m)


class CostGrid:
    """Grid of costs that can move.

    Attributes:
        spec: Size, resolution and position.
        costs: uint8[H, W]; stays the same array until ``resize``.
        default_cost: Cost of new cells.
    """

    def __init__(self, spec: GridSpec, default_cost: int = FREE) -> None:
        self.default_cost = default_cost
        self.resize(spec)

    @property
    def view(self) -> CostmapView:
        """The grid as kernels take it; ``costs`` is shared."""
        return costmap_view(self.spec, self.costs)

    def resize(self, spec: GridSpec) -> None:
        """Take another size, resolution or position, and forget all costs."""
        self.spec = spec
        if self.default_cost == FREE:
            self.costs = np.zeros(spec.shape, np.uint8)  # memory from the system, when written to
        else:
            self.costs = np.full(spec.shape, self.default_cost, np.uint8)

    def reset(self, window: Optional[Window] = None) -> None:
        """Give the window, or everything, the default cost."""
        reset_to(self.costs[window.slices] if window else self.costs, self.default_cost)

    def centre_on(self, x_m: float, y_m: float) -> Tuple[int, int]:
        """Move the grid by whole cells so that a point is in its middle; keep what still fits.

        As in costmap_2d, the middle is half of (size - 1/2) cells, and the number of cells to
        move is cut towards zero.

        Returns:
            The number of cells moved in x and in y.
        """
        spec = self.spec
        res = spec.resolution_m
        move_x = int((x_m - (spec.size_x - 1 + 0.5) * res / 2 - spec.origin_x_m) / res)
        move_y = int((y_m - (spec.size_y - 1 + 0.5) * res / 2 - spec.origin_y_m) / res)
        if move_x == 0 and move_y == 0:
            return 0, 0
        shift(self.costs, move_x, move_y, self.default_cost)
        origin_x_m, origin_y_m = spec.origin_x_m + move_x * res, spec.origin_y_m + move_y * res
        self.spec = GridSpec(spec.size_x, spec.size_y, res, origin_x_m, origin_y_m)
        return move_x, move_y

    def window_of(self, bounds: Bounds) -> Window:
        """Return the cells that bounds touch; the cell of each border is inside."""
        spec = self.spec
        x0 = _clamped_cell(bounds.min_x_m, spec.origin_x_m, spec.resolution_m, spec.size_x)
        xn = _clamped_cell(bounds.max_x_m, spec.origin_x_m, spec.resolution_m, spec.size_x)
        y0 = _clamped_cell(bounds.min_y_m, spec.origin_y_m, spec.resolution_m, spec.size_y)
        yn = _clamped_cell(bounds.max_y_m, spec.origin_y_m, spec.resolution_m, spec.size_y)
        return Window(x0, min(spec.size_x, xn + 1), y0, min(spec.size_y, yn + 1))

    def fill_polygon(self, vertices: NDArray[np.float64], cost: int) -> bool:
        """Set the cells of a convex polygon, float64[n, 2], metres in the grid's frame.

        Returns:
            False if a vertex is off the grid and nothing was set.
        """
        return bool(fill_polygon(self.view, vertices, cost))

    def forget_area(self, square: Square, keep_inside: bool) -> None:
        """Make all cells outside a square unknown (``keep_inside``), or those inside.

        The cells of the square's border count as outside.
        """
        spec, side_m = self.spec, square.side_m
        low_x_m, low_y_m = square.x_m - side_m / 2, square.y_m - side_m / 2
        low_x = _cell(low_x_m, spec.origin_x_m, spec.resolution_m)
        low_y = _cell(low_y_m, spec.origin_y_m, spec.resolution_m)
        high_x = _cell(low_x_m + side_m, spec.origin_x_m, spec.resolution_m)
        high_y = _cell(low_y_m + side_m, spec.origin_y_m, spec.resolution_m)
        inside = np.zeros(spec.shape, dtype=bool)
        inside[max(0, low_y + 1) : max(0, high_y), max(0, low_x + 1) : max(0, high_x)] = True
        self.costs[~inside if keep_inside else inside] = UNKNOWN


def costmap_view(spec: GridSpec, costs: NDArray[np.uint8]) -> CostmapView:
    """Return costs, uint8[H, W] on ``spec``, as kernels take them."""
    origin_m = float(spec.origin_x_m), float(spec.origin_y_m)
    return CostmapView(np.ascontiguousarray(costs), *origin_m, float(spec.resolution_m))


def shift(cells: NDArray[np.uint8], move_x: int, move_y: int, empty: int) -> None:
    """Move the grid below ``cells``, [y, x, ...], in place; new cells are ``empty``."""
    size_y, size_x = cells.shape[:2]
    kept = cells[_kept(move_y, size_y), _kept(move_x, size_x)].copy()
    cells[...] = empty
    cells[_kept(-move_y, size_y), _kept(-move_x, size_x)] = kept


def merge_maximum(below: NDArray[np.uint8], above: NDArray[np.uint8]) -> None:
    """Keep the higher cost of each cell in ``below``; unknown is lower than free."""
    raise_to(below, above)


def merge_known(below: NDArray[np.uint8], above: NDArray[np.uint8]) -> None:
    """Overwrite ``below`` wherever ``above`` is not unknown."""
    np.copyto(below, above, where=above != UNKNOWN)


def _kept(move: int, size: int) -> slice:
    """Return the cells of the old grid that are still inside after moving by ``move`` cells."""
    return slice(min(max(move, 0), size), min(max(move + size, 0), size))


def _cell(world_m: float, origin_m: float, resolution_m: float) -> int:
    return int((world_m - origin_m) / resolution_m)


def _clamped_cell(world_m: float, origin_m: float, resolution_m: float, size: int) -> int:
    if world_m < origin_m:
        return 0
    if world_m > resolution_m * size + origin_m:
        return size - 1
    return _cell(world_m, origin_m, resolution_m)


def _occupancy_table() -> NDArray[np.int8]:
    """Return int8[256]: free 0, inflated 1..98, inscribed 99, lethal 100, unknown -1."""
    table = np.empty(256, dtype=np.int8)
    inflated = np.arange(1, INSCRIBED)
    table[1:INSCRIBED] = 1 + 97 * (inflated - 1) // 251
    table[FREE], table[INSCRIBED], table[LETHAL], table[UNKNOWN] = 0, 99, 100, -1
    return table


OCCUPANCY_OF_COST = _occupancy_table()


def occupancy(costs: NDArray[np.uint8]) -> NDArray[np.int8]:
    """Convert costs, uint8 of any shape, to those of ``nav_msgs/OccupancyGrid``, int8."""
    return OCCUPANCY_OF_COST[costs]
