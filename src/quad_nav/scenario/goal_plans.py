"""Plans from goal to goal over the whole scene, before a mission flies."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.config import Configuration
from quad_nav.config.plugins import Plugin
from quad_nav.costmap.inflation import InflationLayerParams
from quad_nav.costmap.layered import CostmapParams, LayeredCostmap
from quad_nav.costmap.map_edge import closed_edge, edge_strips
from quad_nav.costmap.static import StaticLayerParams, StaticMap
from quad_nav.errors import GoalOutsideMap, PlanningError
from quad_nav.geometry import Pose2D
from quad_nav.grid import INSCRIBED
from quad_nav.mission.goal_file import GoalSequence
from quad_nav.plan.global_planner import SearchPlannerParams
from quad_nav.plan.navfn import NavfnParams
from quad_nav.scenario.assembly import build_global_planner
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.scenario.goal_checks import bounds_of
from quad_nav.scenario.scene_map import scene_map, scene_map_problem, scene_occupancy
from quad_nav.sim.scene import Scene
from quad_nav.sim.scene_cells import parts_of

_ROUNDING_M = 1e-9
NO_PLAN: NDArray[np.float64] = np.empty((0, 2))


def unreachable_goals(setup: FlightSetup) -> List[str]:
    """Return a line for each goal of a flight to which no plan leads."""
    plans = GoalPlans(setup.scene, dict(enumerate(setup.configurations)))
    if any(isinstance(one.global_planner, Plugin) for one in setup.configurations):
        return []  # a user's class is called in the flight alone, where its mistakes are told
    found = []
    for number, (robot, start) in enumerate(zip(setup.robots, setup.scene.starts)):
        if plans.surely_connect(number, [start, *(one.pose for one in robot.sequence.goals)]):
            continue
        faults = [""] * len(robot.sequence.goals)
        found += plans.plans(number, start, robot.sequence, faults)[1]
    return found


class GoalPlans:
    """Global costmaps as if the robots had seen the whole scene, and plans over them."""

    def __init__(
        self, scene: Optional[Scene], configurations: Mapping[int, Optional[Configuration]]
    ) -> None:
        """Plan in a scene with the configurations of robots, by their numbers."""
        self.scene, self._configurations = scene, configurations
        self._costmaps: Dict[CostmapParams, LayeredCostmap] = {}
        self._parts: Dict[Tuple[CostmapParams, int], NDArray[np.int32]] = {}

    def surely_connect(self, number: int, poses: Sequence[Pose2D]) -> bool:
        """Return whether all poses are in one part of the free cells of a robot's costmap.

        Planners that search the whole costmap then find plans between them; there is no need to try
        each one. It is False for other planners.
        """
        costmap, configuration = self.costmap(number), self._configurations.get(number)
        planner = configuration.global_planner if configuration else None
        if (
            costmap is None
            or configuration is None
            or not isinstance(planner, (NavfnParams, SearchPlannerParams))
            or any(map(partial(_is_off_window, configuration.global_costmap), poses, poses[1:]))
        ):
            return False
        lethal = min(getattr(planner, "lethal_cost", INSCRIBED), INSCRIBED)
        if (costmap.params, lethal) not in self._parts:
            free = costmap.costs < lethal - 1
            for strip in edge_strips(free, costmap):
                strip[...] = False
            self._parts[costmap.params, lethal] = parts_of(free)
        parts = self._parts[costmap.params, lethal]
        cells = [costmap.spec.cell_of(pose.x_m, pose.y_m) for pose in poses]
        found = {int(parts[cell[::-1]]) if cell else 0 for cell in cells}
        return len(found) == 1 and 0 not in found

    def plans(
        self,
        number: int,
        start: Optional[Pose2D],
        sequence: GoalSequence,
        faults: Sequence[str],
    ) -> Tuple[List[NDArray[np.float64]], List[str]]:
        """Plan from goal to goal; faulty goals, and those without a plan, are left out.

        Returns:
            A plan for each goal, float64[n, 2], empty without one; a line for each goal to which
            no plan leads.
        """
        plans = [NO_PLAN for _ in sequence.goals]
        warnings: List[str] = []
        costmap, configuration = self.costmap(number), self._configurations.get(number)
        if costmap is None and configuration is not None and self.scene is not None:
            warnings.append(f"quad{number}: no costmap and no plans: the scene has too many cells")
        if costmap is None or configuration is None or start is None:
            return plans, warnings
        planner = build_global_planner(configuration.global_planner, costmap.footprint)
        here, name = start, "the start"
        for index, (goal, fault) in enumerate(zip(sequence.goals, faults)):
            if fault:
                continue
            goal_name = f"goal {index + 1}"
            try:
                if _is_off_window(configuration.global_costmap, here, goal.pose):
                    raise GoalOutsideMap("it rolls with the robot and ends before the goal")
                with closed_edge(costmap, here, goal.pose, configuration.navigator.plan_inside_map):
                    plan = planner.make_plan(costmap.spec, costmap.costs.copy(), here, goal.pose)
            except PlanningError as error:
                warnings.append(
                    f"quad{number}: {goal_name} ({goal.x_m:g}, {goal.y_m:g}): no path from {name}"
                    f" over the global costmap of the whole scene: {error}"
                )
                continue
            plans[index] = plan[:, :2]
            here, name = goal.pose, goal_name
        return plans, warnings

    def costmap(self, number: int) -> Optional[LayeredCostmap]:
        """Return a robot's global costmap as if it had seen the whole scene; None if unknown."""
        configuration = self._configurations.get(number)
        if configuration is None or self.scene is None:
            return None
        params = _without_sensors(configuration.global_costmap)
        has_no_place = bounds_of(configuration.global_costmap) is None
        if has_no_place and scene_map_problem(self.scene, params):
            return None  # a scene of kilometres in cells of centimetres
        if params not in self._costmaps:
            self._costmaps[params] = _costmap(params, self.scene, has_no_place)
        return self._costmaps[params]


def _is_off_window(params: CostmapParams, here: Pose2D, goal: Pose2D) -> bool:
    """Return whether a goal is off a costmap that rolls with a robot, which is here."""
    x_m, y_m = abs(goal.x_m - here.x_m), abs(goal.y_m - here.y_m)
    return params.rolling_window and (x_m >= params.width_m / 2 or y_m >= params.height_m / 2)


def _without_sensors(params: CostmapParams) -> CostmapParams:
    """Put one map of the scene in the place of maps and sensors; the same for equal robots."""
    inflation = [
        (name, layer)
        for name, layer in params.layers
        if isinstance(layer, InflationLayerParams) and layer.enabled
    ]
    return replace(
        params,
        global_frame="map",
        robot_base_frame="base_link",
        rolling_window=False,
        layers=(("scene", StaticLayerParams()), *inflation),
    )


def _costmap(params: CostmapParams, scene: Scene, covers_scene: bool) -> LayeredCostmap:
    costmap = LayeredCostmap(params)
    if covers_scene:
        costmap.set_map(scene_map(scene, params.resolution_m))
    else:
        # A LIDAR marks the cells that surfaces lie in, also those of walls that end at the costmap.
        seen = scene_occupancy(scene, params.spec, 0.5 * params.resolution_m + _ROUNDING_M)
        costmap.set_map(StaticMap(seen, params.spec))
    costmap.update(0.0, Pose2D(0.0, 0.0))
    return costmap
