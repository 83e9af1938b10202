"""A planner's wave over the costmap, in working memory that the next plan reuses."""

from __future__ import annotations

from typing import List, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.grid import LETHAL
from quad_nav.plan import wavefront_kernel as kernel

NOT_REACHED = float(kernel.NOT_REACHED)  # potential of cells that the wave did not reach


class Wavefront:
    """Wave of one planner.

    A plan near the robot changes few cells of a large map: only those are reset for the next one.
    """

    def __init__(self) -> None:
        """Reserve no memory yet."""
        self._potential = np.zeros((0, 0), dtype=np.float32)
        self._states = np.zeros((0, 0), dtype=np.uint8)
        self._changed: List[Tuple[slice, slice]] = []

    def begin(self, shape: Tuple[int, int]) -> NDArray[np.float32]:
        """Return the potential, float32[H, W], all NOT_REACHED. It ends the wave before."""
        if self._potential.shape == shape:
            for square in self._changed:
                self._potential[square] = NOT_REACHED
        else:
            self._potential = np.full(shape, NOT_REACHED, dtype=np.float32)
            self._states = np.full(shape, LETHAL, dtype=np.uint8)
        self._changed = []
        return self._potential

    def note_change(self, cell: int, reach: int) -> None:
        """Note that up to ``reach`` columns and rows from a flat cell potentials have changed."""
        size_x = self._potential.shape[1]
        y, x = divmod(cell, size_x)
        # Beyond the last column the first one of the next row follows, where waves can begin, too.
        columns = slice(max(0, x - reach), x + reach + 1) if x + reach < size_x else slice(None)
        self._changed.append((slice(max(0, y - reach), max(0, y + reach + 2)), columns))

    def spread(
        self,
        costs: NDArray[np.uint8],
        first_front: NDArray[np.int64],
        params: kernel.WaveParams,
        source: int,
        target: int,
        max_fronts: int,
    ) -> bool:
        """Spread the potential that has begun at a source; return whether it stopped at the target.

        The wave never enters the outermost ring of cells. The first front is of flat cells,
        int64[k], at most two columns and rows from the source; see
        ``plan.wavefront_kernel.propagate``.
        """
        arrived, fronts = kernel.propagate(
            np.ascontiguousarray(costs).ravel(),
            self._potential.ravel(),
            self._states.ravel(),
            first_front,
            params,
            source,
            target,
            costs.shape[1],
            max_fronts,
        )
        self.note_change(source, 2 + fronts)
        return bool(arrived)
