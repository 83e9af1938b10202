"""Grids over the plane: cells, world coordinates and cell costs.

A grid is ``uint8[row, column]`` = ``[y, x]``. Row 0 has the lowest y and column 0 the lowest x;
``origin`` is the world position of the lower left corner of cell (0, 0). Cell coordinates are
written (cell_x, cell_y).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

FREE = 0
INSCRIBED = 253
LETHAL = 254
UNKNOWN = 255


@dataclass(frozen=True)
class GridSpec:
    """Size, resolution and position of a grid.

    Attributes:
        size_x: Number of columns.
        size_y: Number of rows.
        resolution_m: Size of a cell.
        origin_x_m: x of the lower left corner of cell (0, 0) in the grid's frame.
        origin_y_m: y of that corner.
    """

    size_x: int
    size_y: int
    resolution_m: float
    origin_x_m: float = 0.0
    origin_y_m: float = 0.0

    @property
    def shape(self) -> Tuple[int, int]:
        """(rows, columns), as numpy has it."""
        return (self.size_y, self.size_x)

    @property
    def extent(self) -> str:
        """Extent of the grid, for messages."""
        return (
            f"x {self.origin_x_m:.2f} to "
            f"{self.origin_x_m + self.size_x * self.resolution_m:.2f}, "
            f"y {self.origin_y_m:.2f} to "
            f"{self.origin_y_m + self.size_y * self.resolution_m:.2f} m"
        )

    def contains_cell(self, cell_x: int, cell_y: int) -> bool:
        """Tell whether a cell is inside the grid."""
        return 0 <= cell_x < self.size_x and 0 <= cell_y < self.size_y

    def cell_of(self, x_m: float, y_m: float) -> Optional[Tuple[int, int]]:
        """Return the cell (x, y) that holds a world point, None outside the grid."""
        if x_m < self.origin_x_m or y_m < self.origin_y_m:
            return None
        cell = (
            int((x_m - self.origin_x_m) / self.resolution_m),
            int((y_m - self.origin_y_m) / self.resolution_m),
        )
        return cell if self.contains_cell(*cell) else None

    def centre_of(self, cell_x: int, cell_y: int) -> Tuple[float, float]:
        """Return the world coordinates (x, y) of a cell's centre."""
        return (
            self.origin_x_m + (cell_x + 0.5) * self.resolution_m,
            self.origin_y_m + (cell_y + 0.5) * self.resolution_m,
        )
