"""When the two costmaps are updated, and whether one may drive by them."""

from __future__ import annotations

import math
from typing import Dict, Tuple

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.timing import Schedule


class CostmapUpdates:
    """Each costmap at its own frequency."""

    def __init__(self, global_costmap: LayeredCostmap, local_costmap: LayeredCostmap):
        self._local = local_costmap
        self._costmaps: Dict[str, Tuple[LayeredCostmap, Schedule]] = {
            "global": (global_costmap, Schedule(global_costmap.params.update_frequency_hz)),
            "local": (local_costmap, Schedule(local_costmap.params.update_frequency_hz)),
        }

    def start(self, now_s: float) -> None:
        """Both are due now."""
        for _, schedule in self._costmaps.values():
            schedule.start(now_s)

    @property
    def due_s(self) -> float:
        return min((schedule.due_s for _, schedule in self._costmaps.values()), default=math.inf)

    def update(self, tick: Tick, located: RobotPoses) -> None:
        """Updates what is due; the changed windows go into the tick."""
        poses = {"global": located.in_global, "local": located.in_local}
        for name, (costmap, schedule) in self._costmaps.items():
            schedule.set_frequency(costmap.params.update_frequency_hz, tick.now_s)
            if not schedule.pop(tick.now_s):
                continue
            pose = poses[name]
            if pose is None:
                tick.warnings.append(f"{name} costmap not updated: the robot's pose is unknown")
                continue
            tick.windows[name] = costmap.update(tick.now_s, pose)

    def out_of_date(self, now_s: float) -> str:
        """Why the local costmap is not to be driven by, "" when it is."""
        if self._local.is_current(now_s):
            return ""
        return self.silence(now_s) or "the local costmap is out of date"

    def silence(self, now_s: float) -> str:
        """Which of the local costmap's sensors say nothing, "" when all do."""
        return "; ".join(
            f"nothing from {name} for {age_s:.1f} s"
            for name, age_s in self._local.stale_sources(now_s)
        )
