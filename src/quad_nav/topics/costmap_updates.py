"""What is to be told of a costmap, and when.

The rules are the original's: the full grid when the map moved or changed its size, else
only the window that changed, at the publish frequency.
"""

from __future__ import annotations

from typing import Optional

from quad_nav.costmap.cost_grid import NO_CELLS, Window
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.grid import GridSpec
from quad_nav.timing import Schedule

CLOCK_GRAIN_S = 1e-6  # a clock of whole nanoseconds may be this little early


class CostmapNews:
    """Gathers the windows that updates change until it is time to tell them."""

    def __init__(self, costmap: LayeredCostmap):
        self._costmap = costmap
        self._changed = NO_CELLS
        self._told: Optional[GridSpec] = None
        self._schedule = Schedule(costmap.params.publish_frequency_hz)
        self.restart(0.0)

    def restart(self, now_s: float) -> None:
        """For a clock that has jumped: it is time again after one period."""
        self._schedule.start(now_s)
        self._schedule.pop(now_s)

    def note(self, now_s: float, window: Window) -> bool:
        """Take the window that an update changed; whether it is time to tell what changed.

        Never with a publish frequency of 0. A late update does not delay those after it.
        """
        self._changed = self._changed.union(window)
        self._schedule.set_frequency(self._costmap.params.publish_frequency_hz, now_s)
        return self._schedule.pop(now_s + CLOCK_GRAIN_S)

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
