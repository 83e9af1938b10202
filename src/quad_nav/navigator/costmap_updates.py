"""Costmap updates: each of the two costmaps at its own frequency."""

from __future__ import annotations

from typing import Dict, Tuple

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.timing import Schedule


class CostmapUpdates:
    """Updates the costmaps of one robot and checks that their sensor data is current."""

    def __init__(self, global_costmap: LayeredCostmap, local_costmap: LayeredCostmap) -> None:
        """Create schedules that have not started."""
        self._local = local_costmap
        self._costmaps: Dict[str, Tuple[LayeredCostmap, Schedule]] = {
            "global": (global_costmap, Schedule(global_costmap.params.update_frequency_hz)),
            "local": (local_costmap, Schedule(local_costmap.params.update_frequency_hz)),
        }

        self._rests = False

    def start(self, now_s: float) -> None:
        """Make both updates due now."""
        for _, schedule in self._costmaps.values():
            schedule.start(now_s)

    @property
    def due_s(self) -> float:
        """Time of the next update."""
        (_, of_global), (_, of_local) = self._costmaps["global"], self._costmaps["local"]
        return min(of_global.due_s, of_local.due_s)

    def update(self, tick: Tick, poses: RobotPoses, rests: bool) -> None:
        """Run the updates that are due, none if the costmaps rest; the windows go into the tick."""
        if self._rests and not rests:
            self.start(tick.now_s)  # plans need costmaps that are up to date
        self._rests = rests
        of_costmaps = {"global": poses.in_global, "local": poses.in_local}
        for name, (costmap, schedule) in self._costmaps.items():
            schedule.set_frequency(costmap.params.update_frequency_hz, tick.now_s)
            if not schedule.pop(tick.now_s):
                continue
            pose = of_costmaps[name]
            tick.windows[name] = None
            if rests:
                continue
            if pose is None:
                tick.warnings.append(f"{name} costmap not updated: robot pose unknown")
                continue
            tick.windows[name] = costmap.update(tick.now_s, pose)

    def outdated_reason(self, now_s: float) -> str:
        """Return why the local costmap is out of date, "" if it is current."""
        if self._local.is_current(now_s):
            return ""
        return self.missing_data(now_s) or "local costmap out of date"

    def missing_data(self, now_s: float) -> str:
        """Return which sensors of the local costmap have timed out, "" if none has."""
        return "; ".join(
            f"no data from {name} for {age_s:.1f} s"
            for name, age_s in self._local.stale_sources(now_s)
        )
