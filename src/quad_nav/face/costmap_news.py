"""What is to be told of a costmap, and when.

The rules are the original's: the full grid when the map moved or changed its size, else
only the window that changed, at the publish frequency.
"""
from __future__ import annotations

from typing import Optional

from quad_nav.costmap.cost_grid import NO_CELLS, Window
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.grid import GridSpec


class CostmapNews:
    """Gathers the windows that updates change until it is time to tell them."""

    def __init__(self, costmap: LayeredCostmap):
        self._costmap = costmap
        self._changed = NO_CELLS
        self._told: Optional[GridSpec] = None
        self._last_s = 0.0

    def note(self, now_s: float, window: Window) -> bool:
        """Take the window that an update changed; whether it is time to tell what changed.

        Never with a publish frequency of 0.
        """
        self._changed = self._changed.union(window)
        frequency_hz = self._costmap.params.publish_frequency_hz
        if frequency_hz <= 0.0 or now_s < self._last_s + 1.0 / frequency_hz - 1e-6:
            return False
        self._last_s = now_s
        return True

    def take(self) -> Window:
        """What has changed since it was last taken."""
        changed, self._changed = self._changed, NO_CELLS
        return changed

    def wants_full_grid(self) -> bool:
        """Whether the full grid is to be told now, which is then taken for told."""
        costmap = self._costmap
        wanted = costmap.params.always_send_full_costmap or costmap.spec != self._told
        self._told = costmap.spec
        return wanted
