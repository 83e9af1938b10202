"""Recovery ``clear_costmap_recovery/ClearCostmapRecovery``: clear obstacle layers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Iterable, Optional, Tuple

from quad_nav.costmap.cost_grid import Square
from quad_nav.costmap.layer import Redraw
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.parameter import deviation, fixed_flag, fixed_number, fixed_text
from quad_nav.recovery.recovery import OneStepRecovery, RecoveryContext, Step

# The layers that upstream clears by default. No layer has this name there either: the
# default obstacle layer is called "obstacle_layer".
UPSTREAM_LAYER_NAMES = ("obstacles",)


@dataclass(frozen=True)
class ClearCostmapParams:
    """Parameters of ``clear_costmap_recovery/ClearCostmapRecovery``.

    Attributes:
        layer_names: The layers to clear, None for the default.
        clear_any_obstacle_layer: By default clear every obstacle layer; False restores
            upstream behaviour, which clears layers called "obstacles" only.
        redraw_cleared_costmaps: The robot waits until the costmaps are drawn again; False
            restores upstream behaviour.
    """

    reset_distance_m: float = fixed_number(
        "reset_distance", 3.0, "metres", "Side of the square outside of which costs are cleared."
    )
    invert_area_to_clear: bool = fixed_flag(
        "invert_area_to_clear", False, "Clear the inside of the square instead."
    )
    force_updating: bool = fixed_flag(
        "force_updating", False, "Update the costmaps after clearing."
    )
    affected_maps: str = fixed_text(
        "affected_maps", "both", "local, global or both", "Which costmaps are cleared."
    )
    layer_names: Optional[Tuple[str, ...]] = None
    clear_any_obstacle_layer: bool = deviation()
    redraw_cleared_costmaps: bool = deviation()


class ClearCostmap(OneStepRecovery):
    """Clears obstacles outside of a square around the robot.

    The square has sides of ``reset_distance_m``; ``invert_area_to_clear`` clears its inside.
    """

    params: ClearCostmapParams

    def step(self, context: RecoveryContext) -> Step:
        """Clear the costmaps in one step, and update them if ``force_updating`` is set."""
        params = self.params
        redraw = Redraw.BEFORE_MOVING if params.redraw_cleared_costmaps else Redraw.NEXT_UPDATE
        skipped = []
        for name, costmap, pose in context.costmaps:
            if params.affected_maps not in (name, "both"):
                continue
            if pose is None:
                skipped.append(name)
                continue
            square = Square(pose.x_m, pose.y_m, params.reset_distance_m)
            costmap.clear_area(
                self._names(costmap), square, not params.invert_area_to_clear, redraw
            )
            if params.force_updating:
                costmap.update(context.now_s, pose)
        message = ""
        if skipped:
            message = f"{' and '.join(skipped)} costmap not cleared: robot pose unknown"
        return Step(done=True, message=message)

    def _names(self, costmap: LayeredCostmap) -> Iterable[str]:
        if self.params.layer_names is not None:
            return self.params.layer_names
        if not self.params.clear_any_obstacle_layer:
            return UPSTREAM_LAYER_NAMES
        return costmap.obstacle_layers
