"""Recovery ``move_slow_and_clear/MoveSlowAndClear``: clear nearby obstacles, then fly slowly.

Cleared obstacles may be real: the robot can hit them, but only at low speed. The next
observation that shows them marks them again.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Tuple

from quad_nav.costmap.cost_grid import Square
from quad_nav.costmap.layer import Redraw
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.parameter import POSITIVE, deviation, fixed_number, fixed_text
from quad_nav.recovery.recovery import OneStepRecovery, ParameterLimit, RecoveryContext, Step

# Upstream clears the layers whose names have this word in them.
UPSTREAM_LAYER_WORD = "obstacles"
_UPSTREAM_CHECK_PERIOD_S = 0.1  # of upstream's timer, of the distance


@dataclass(frozen=True)
class MoveSlowAndClearParams:
    """Parameters of ``move_slow_and_clear/MoveSlowAndClear``.

    Attributes:
        translation_fields: Fields of the local planner's parameters that
            ``limited_trans_speed_mps`` limits.
        rotation_fields: Fields that ``limited_rot_speed_radps`` limits.
        named_translation_field: The field that upstream sets, "" for none.
        named_rotation_field: The field that upstream sets, "" for none.
        clear_any_obstacle_layer: Clear every obstacle layer; False restores upstream
            behaviour, which clears layers with "obstacles" in their names only.
        redraw_cleared_costmaps: The robot waits until the costmaps are drawn again; False
            restores upstream behaviour, which draws them where updates happen to pass.
        limit_all_speeds: Limit all speeds of the local planner; False restores upstream
            behaviour, which sets two named parameters, even to more than they are.
    """

    clearing_distance_m: float = fixed_number(
        "clearing_distance", 0.5, "metres", "Distance within which obstacles are cleared."
    )
    limited_trans_speed_mps: float = fixed_number(
        "limited_trans_speed", 0.25, "m/s", "Largest speed after clearing.", POSITIVE
    )
    limited_rot_speed_radps: float = fixed_number(
        "limited_rot_speed", 0.45, "rad/s", "Largest rotational speed after clearing.", POSITIVE
    )
    limited_distance_m: float = fixed_number(
        "limited_distance", 0.3, "metres", "The limits end when the robot has moved this far."
    )
    planner_namespace: str = fixed_text(
        "planner_namespace", "", "a planner's namespace", "Planner whose speeds upstream sets."
    )
    max_trans_param_name: str = fixed_text(
        "max_trans_param_name", "", "a parameter's name", "Another speed that is limited."
    )
    max_rot_param_name: str = fixed_text(
        "max_rot_param_name", "", "a parameter's name", "Another rotational speed that is limited."
    )
    translation_fields: Tuple[str, ...] = ()
    rotation_fields: Tuple[str, ...] = ()
    named_translation_field: str = ""
    named_rotation_field: str = ""
    clear_any_obstacle_layer: bool = deviation()
    redraw_cleared_costmaps: bool = deviation()
    limit_all_speeds: bool = deviation()

    @property
    def limit(self) -> ParameterLimit:
        """The limit of both speeds."""
        if not self.limit_all_speeds:
            named = (
                (self.named_translation_field, self.limited_trans_speed_mps),
                (self.named_rotation_field, self.limited_rot_speed_radps),
            )
            return ParameterLimit(
                tuple((field, speed) for field, speed in named if field),
                self.limited_distance_m,
                raises=True,
                check_period_s=_UPSTREAM_CHECK_PERIOD_S,
            )
        greatest = [(field, self.limited_trans_speed_mps) for field in self.translation_fields]
        greatest += [(field, self.limited_rot_speed_radps) for field in self.rotation_fields]
        return ParameterLimit(tuple(greatest), self.limited_distance_m)


class MoveSlowAndClear(OneStepRecovery):
    """Clears obstacles around the robot and limits its speed.

    The cleared square reaches ``clearing_distance_m`` to each side of the robot. The limit ends
    when the robot has moved ``limited_distance_m``.
    """

    params: MoveSlowAndClearParams

    def step(self, context: RecoveryContext) -> Step:
        """Clear the costmaps and limit the speed in one step."""
        params = self.params
        redraw = Redraw.BEFORE_MOVING if params.redraw_cleared_costmaps else Redraw.BY_CHANCE
        messages = []
        for name, costmap, pose in context.costmaps:
            if pose is None:
                messages.append(f"{name} costmap not cleared: robot pose unknown")
            elif not costmap.free_layers(
                self._names(costmap),
                Square(pose.x_m, pose.y_m, 2.0 * params.clearing_distance_m),
                redraw,
            ):
                messages.append(
                    f"{name} costmap not cleared: it has no obstacle layer or"
                    f" ends within {params.clearing_distance_m:g} m of the robot"
                )
        limit = params.limit
        if context.pose_in_global is None or not limit.greatest:
            return Step(done=True, message="; ".join(messages))
        messages.append(
            f"limiting speed to {params.limited_trans_speed_mps:g} m/s and"
            f" {params.limited_rot_speed_radps:g} rad/s for the next"
            f" {params.limited_distance_m:g} m"
        )
        return Step(done=True, message="; ".join(messages), limit=limit)

    def _names(self, costmap: LayeredCostmap) -> List[str]:
        if self.params.clear_any_obstacle_layer:
            return costmap.obstacle_layers
        return [name for name in costmap.layers if UPSTREAM_LAYER_WORD in name]
