"""The planner ``global_planner/GlobalPlanner``: NavFn's successor, with choices.

Dijkstra's search spreads NavFn's wavefront (``navfn``) from the robot to the goal. A* visits cells
in the order of potential + neutral cost * city block distance to the goal, and computes each cell's
potential only once. A cell's potential is that of a planar wave (``use_quadratic``), or its
cheapest neighbour's plus its own cost. The path follows the gradient down from the goal in
half-cell steps, or goes from cell to lowest neighbour (``use_grid_path``).

Costs of cells:

    Dijkstra    neutral + factor * cost, at most lethal - 1; an obstacle from lethal - 1 on
    A*          (neutral + cost) mod 256, in one byte as upstream computes it;
                an obstacle from lethal on

Unless ``old_navfn_behavior``, positions are real numbers: start and goal are half a cell less than
cell coordinates, so that whole numbers are the centres of cells. Dijkstra's wave then begins in
the four cells around the robot, but A* and grid paths cut the coordinates to whole cells: a point
in the lower or left half of a cell belongs to the neighbour, and when that is an obstacle there is
no plan. For the gradient every cell within two cells of the goal then gets a potential, obstacles
included: near the goal a path may cut a corner of an obstacle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import GoalOutsideMap, StartOutsideMap
from quad_nav.geometry import Pose2D
from quad_nav.grid import FREE, LETHAL, UNKNOWN, GridSpec
from quad_nav.parameter import (
    POSITIVE,
    choice,
    deviation,
    fixed_flag,
    fixed_whole,
    flag,
    signed,
    whole,
)
from quad_nav.plan import global_planner_kernel as kernel
from quad_nav.plan import wavefront_kernel as wavefront
from quad_nav.plan.navfn import cell_on_map, no_path
from quad_nav.plan.orientations import ORIENTATIONS, with_headings
from quad_nav.plan.wavefront import Wavefront

Point = Tuple[float, float]
_MARGIN = 1  # cells around a map that is not outlined, so that no search leaves it


@dataclass(frozen=True)
class SearchPlannerParams:
    """Parameters of ``global_planner/GlobalPlanner``.

    Attributes:
        orientation_mode: One of ``OrientationMode``.
        turns_from_bend: See ``plan.orientations.with_headings``.
    """

    lethal_cost: int = whole("lethal_cost", 253, "", 1, 255, "Cost of an obstacle.")
    neutral_cost: int = whole("neutral_cost", 50, "", 1, 255, "Cost of a free cell.")
    cost_factor: float = signed("cost_factor", 3.0, "", 0.01, 5.0, "Factor of the costmap's costs.")
    publish_potential: bool = flag("publish_potential", True, "Publish the potential.")
    orientation_mode: int = choice(
        "orientation_mode", 1, ORIENTATIONS, "Heading of the points of a path.", low=0, high=6
    )
    orientation_window_size: int = whole(
        "orientation_window_size", 1, "", 1, 255, "Points over which a direction is taken."
    )
    outline_map: bool = flag(
        "outline_map", True, "Make the outermost cells obstacles; false for a rolling costmap."
    )

    use_dijkstra: bool = fixed_flag("use_dijkstra", True, "Dijkstra's search; A* when false.")
    use_quadratic: bool = fixed_flag(
        "use_quadratic", True, "Potentials of a planar wave; from one neighbour when false."
    )
    use_grid_path: bool = fixed_flag(
        "use_grid_path", False, "Path from cell to cell; down the gradient when false."
    )
    old_navfn_behavior: bool = fixed_flag(
        "old_navfn_behavior", False, "Paths as NavfnROS has them, between corners of cells."
    )
    allow_unknown: bool = fixed_flag("allow_unknown", True, "Plans may cross unknown space.")
    publish_scale: int = fixed_whole(
        "publish_scale", 100, "Highest published potential.", low=1, high=127, domain=POSITIVE
    )
    turns_from_bend: bool = deviation()


class SearchPlanner:
    """The planner ``global_planner/GlobalPlanner``.

    Attributes:
        params: Parameters.
        potential: Potential of the last plan, float32[H, W], 1e10 where the search did not
            come; None before the first plan. The next plan overwrites it.
        wave: Working memory. Planners that one thread runs may share it: each plan overwrites the
            potential of the last one.
    """

    def __init__(self, params: SearchPlannerParams = SearchPlannerParams()) -> None:
        self.params = params
        self.potential: Optional[NDArray[np.float32]] = None
        self.wave = Wavefront()

    def make_plan(
        self, spec: GridSpec, costs: NDArray[np.uint8], start: Pose2D, goal: Pose2D
    ) -> NDArray[np.float64]:
        """Plan a path; see ``GlobalPlanner.make_plan``.

        The start's cell of ``costs`` is set to FREE and, with ``outline_map``, the outermost cells
        to LETHAL. The last row of the plan is the goal.
        """
        start_cell = cell_on_map(spec, start, "robot", StartOutsideMap)
        goal_cell = cell_on_map(spec, goal, "goal", GoalOutsideMap)
        costs[start_cell[1], start_cell[0]] = FREE
        if self.params.outline_map:
            _outline(costs)
            path = self._path(costs, self._point(spec, start), self._point(spec, goal), goal_cell)
        else:
            path = self._path_to_the_border(spec, costs, start, goal, goal_cell)
        if not len(path):
            raise no_path(start, goal)
        plan = np.zeros((len(path) + self._goals_appended, 3))
        plan[: len(path), :2] = (
            path[::-1].astype(np.float64) + self._offset
        ) * spec.resolution_m + (spec.origin_x_m, spec.origin_y_m)
        plan[len(path) :] = goal.x_m, goal.y_m, goal.yaw_rad
        return with_headings(
            plan,
            start.yaw_rad,
            self.params.orientation_mode,
            self.params.orientation_window_size,
            self.params.turns_from_bend,
        )

    @property
    def _offset(self) -> float:
        """Offset from a path's cell coordinates to real ones, in cells."""
        return 0.0 if self.params.old_navfn_behavior else 0.5

    @property
    def _goals_appended(self) -> int:
        """Number of times the goal's pose follows the path; NavFn appends it on its own."""
        return 2 if self.params.old_navfn_behavior else 1

    def _point(self, spec: GridSpec, pose: Pose2D) -> Point:
        """Convert a position to the path's cell coordinates."""
        x = (pose.x_m - spec.origin_x_m) / spec.resolution_m
        y = (pose.y_m - spec.origin_y_m) / spec.resolution_m
        if self.params.old_navfn_behavior:
            return float(int(x)), float(int(y))
        return x - self._offset, y - self._offset

    def _path_to_the_border(
        self,
        spec: GridSpec,
        costs: NDArray[np.uint8],
        start: Pose2D,
        goal: Pose2D,
        goal_cell: Tuple[int, int],
    ) -> NDArray[np.float32]:
        """Find a path on a map whose outermost cells may be used, with obstacles around them."""
        padded = np.pad(costs, _MARGIN, constant_values=LETHAL)
        start_x, start_y = self._point(spec, start)
        goal_x, goal_y = self._point(spec, goal)
        path = self._path(
            padded,
            (start_x + _MARGIN, start_y + _MARGIN),
            (goal_x + _MARGIN, goal_y + _MARGIN),
            (goal_cell[0] + _MARGIN, goal_cell[1] + _MARGIN),
        )
        assert self.potential is not None
        self.potential = self.potential[_MARGIN:-_MARGIN, _MARGIN:-_MARGIN]
        return path - _MARGIN

    def _path(
        self, costs: NDArray[np.uint8], start: Point, goal: Point, goal_cell: Tuple[int, int]
    ) -> NDArray[np.float32]:
        """Return points float32[n, 2], goal to start, in cell coordinates; none without a path."""
        params, size_x = self.params, costs.shape[1]
        if params.use_dijkstra:
            potential, arrived = self._dijkstra(costs, start, goal)
        else:
            potential, arrived = self._a_star(costs, start, goal)
        if not params.old_navfn_behavior:
            goal_flat = _flat(goal_cell, size_x)
            kernel.fill_around(
                byte_costs(costs, params),
                potential,
                size_x,
                goal_flat,
                params.use_quadratic,
            )
            self.wave.note_change(goal_flat, 2)
        self.potential = potential.reshape(costs.shape)
        path = np.empty((4 * costs.size, 2), dtype=np.float32)
        if not arrived:
            return path[:0]
        descend = kernel.grid_path if params.use_grid_path else kernel.gradient_path
        return path[: descend(potential, size_x, *start, *goal, path)]

    def _dijkstra(
        self, costs: NDArray[np.uint8], start: Point, goal: Point
    ) -> Tuple[NDArray[np.float32], bool]:
        params, size_x = self.params, costs.shape[1]
        source = _flat(start, size_x)
        potential = self.wave.begin((costs.shape[0], size_x)).ravel()
        if params.old_navfn_behavior:
            front = wavefront.start_at_cell(potential, source, size_x)
        else:
            front = wavefront.start_between_cells(
                potential,
                source,
                size_x,
                _hundredths(start[0]),
                _hundredths(start[1]),
                params.neutral_cost,
            )
        arrived = self.wave.spread(
            costs, front, wave_params(params), source, _flat(goal, size_x), 2 * costs.size
        )
        return potential, arrived

    def _a_star(
        self, costs: NDArray[np.uint8], start: Point, goal: Point
    ) -> Tuple[NDArray[np.float32], bool]:
        params, size_x = self.params, costs.shape[1]
        potential = self.wave.begin((costs.shape[0], size_x)).ravel()
        self.wave.note_change(0, costs.size)
        arrived = kernel.a_star(
            byte_costs(costs, params),
            _enterable(costs, params),
            potential,
            size_x,
            _flat(start, size_x),
            _flat(goal, size_x),
            params.neutral_cost,
            params.use_quadratic,
            2 * costs.size,
        )
        return potential, arrived


def wave_params(params: SearchPlannerParams) -> wavefront.WaveParams:
    """Return the parameters of Dijkstra's search, and its costs of cells."""
    lethal = params.lethal_cost
    costs = np.arange(256, dtype=np.float32)
    table = costs * np.float32(params.cost_factor) + np.float32(params.neutral_cost)
    table = np.minimum(table, np.float32(lethal - 1))
    passable = np.arange(256) < lethal - 1
    passable[UNKNOWN] |= params.allow_unknown
    table = np.where(passable, table, lethal).astype(np.float32)
    return wavefront.WaveParams(
        price=np.trunc(table),  # potentials are made of whole costs, as upstream's
        crossing=wavefront.crossings(table, lethal),
        obstacle=lethal,
        neutral=params.neutral_cost,
        planar=params.use_quadratic,
        stop_at_target=True,
        heuristic=False,
    )


def byte_costs(costs: NDArray[np.uint8], params: SearchPlannerParams) -> NDArray[np.uint8]:
    """Convert costs, uint8[H, W], to A*'s costs of a step to each cell, flat uint8[n]."""
    return (costs + np.uint8(params.neutral_cost)).ravel()


def _enterable(costs: NDArray[np.uint8], params: SearchPlannerParams) -> NDArray[np.bool_]:
    """Return True for cells that A* may visit, flat bool[n]."""
    enterable = costs < params.lethal_cost
    if params.allow_unknown:
        enterable |= costs == UNKNOWN
    _outline(enterable, False)
    return enterable.ravel()


def _outline(grid: NDArray[Any], value: int = LETHAL) -> None:
    """Set the outermost ring of cells."""
    grid[[0, -1], :] = value
    grid[:, [0, -1]] = value


def _hundredths(coordinate: float) -> float:
    """Return a coordinate's fraction, rounded as upstream does."""
    fraction = coordinate - int(coordinate)
    return float(np.floor(np.float32(fraction * 100 + 0.5)) / np.float32(100))


def _flat(point: Point, size_x: int) -> int:
    return int(point[1]) * size_x + int(point[0])
