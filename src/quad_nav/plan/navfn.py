"""NavFn: a wavefront planner over the global costmap.

The potential of a cell is the cost of the cheapest path to it from the robot's cell. It solves the
eikonal equation |grad P| = cost in one upwind step per visit: with ``lower`` the lower and ``gap``
the difference of the two neighbours that a wave arrives over (one horizontal, one vertical),

    P = lower + cost                        where gap >= cost
    P = lower + cost * f(gap / cost)        else,  f(r) = -0.2301 r^2 + 0.5307 r + 0.7040

where the quadratic f approximates the exact (r + sqrt(2 - r^2)) / 2. Cells wait in buckets by
potential (100 wide), not in a sorted queue, so a cell may be visited again. The path is steepest
descent from the goal, half a cell a step, reversed. Source: K. Konolige, "A gradient method for
real-time robot navigation", IROS 2000, as ROS navigation implements it, limits included:

* the wave stops after ``max(size_x * size_y / 20, size_x + size_y)`` fronts;
* a path has at most ``4 * size_x`` points. A longer one is cut, and then begins somewhere between
  robot and goal.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple, Type

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import GoalOutsideMap, NoPath, PlanningError, StartOutsideMap
from quad_nav.geometry import Pose2D
from quad_nav.grid import FREE, INSCRIBED, UNKNOWN, GridSpec
from quad_nav.parameter import fixed_flag, fixed_number
from quad_nav.plan import descent as kernel
from quad_nav.plan import wavefront_kernel as wavefront
from quad_nav.plan.wavefront import NOT_REACHED, Wavefront

Cell = Tuple[int, int]


@dataclass(frozen=True)
class NavfnParams:
    """Parameters of ``navfn/NavfnROS``."""

    allow_unknown: bool = fixed_flag("allow_unknown", True, "Plans may cross unknown space.")
    default_tolerance_m: float = fixed_number(
        "default_tolerance", 0.0, "metres", "Largest distance from the end of a plan to the goal."
    )
    visualize_potential: bool = fixed_flag("visualize_potential", False, "Publish the potential.")
    planner_window_x_m: float = fixed_number("planner_window_x", 0.0, "metres", "Never used.")
    planner_window_y_m: float = fixed_number("planner_window_y", 0.0, "metres", "Never used.")


class Navfn:
    """The planner ``navfn/NavfnROS``.

    Attributes:
        params: Parameters.
        wave: Working memory. Planners that one thread runs may share it: each plan overwrites the
            potential of the last one.
    """

    def __init__(self, params: NavfnParams = NavfnParams()) -> None:
        self.params = params
        self._potential: Optional[NDArray[np.float32]] = None
        self.wave = Wavefront()
        self._not_spread: Optional[Tuple[NDArray[np.uint8], Cell, Cell]] = None

    @property
    def potential(self) -> Optional[NDArray[np.float32]]:
        """Potential of the last plan, float32[H, W], None before the first one.

        It is ``NOT_REACHED`` (1e10) where the wave did not come. The next plan overwrites it.
        """
        if self._not_spread is not None:
            self._potential = self._spread(*self._not_spread)
        return self._potential

    @potential.setter
    def potential(self, potential: Optional[NDArray[np.float32]]) -> None:
        """Replace the potential."""
        self._potential, self._not_spread = potential, None

    def make_plan(
        self, spec: GridSpec, costs: NDArray[np.uint8], start: Pose2D, goal: Pose2D
    ) -> NDArray[np.float64]:
        """Plan a path; see ``GlobalPlanner.make_plan``.

        The start's cell of ``costs`` is set to FREE. Points of the path have yaw 0. The last row
        is the goal, or the nearest reached point within ``default_tolerance_m`` of it, with the
        goal's yaw. The rows before it are the descended path, which upstream publishes first.

        Raises:
            StartOutsideMap: The robot is off the costmap.
            GoalOutsideMap: The goal is off the costmap and there is no tolerance.
            NoPath: The wave does not reach the goal.
        """
        start_cell = cell_on_map(spec, start, "robot", StartOutsideMap)
        costs[start_cell[1], start_cell[0]] = FREE
        if self.params.default_tolerance_m <= 0.0:
            goal_cell = cell_on_map(spec, goal, "goal", GoalOutsideMap)
        else:  # a border cell is never reached, so the wave covers the map
            goal_cell = spec.cell_of(goal.x_m, goal.y_m) or (0, 0)
        end = None
        if self._never_arrives(costs, start_cell, goal_cell):
            kept = self._not_spread[0] if self._not_spread is not None else costs[:0]
            if kept.shape != costs.shape:
                kept = np.empty_like(costs)
            kept[...] = costs
            self._not_spread = kept, start_cell, goal_cell
        else:
            self._potential = self._spread(costs, start_cell, goal_cell)
            end = self._reached_pose_near(spec, goal)
        if end is None:
            raise no_path(start, goal)
        return self._plan_to(spec, start_cell, end)

    def _never_arrives(self, costs: NDArray[np.uint8], start: Cell, goal: Cell) -> bool:
        """Return whether the goal is in an obstacle, so that the wave would run over the whole map.

        A robot whose goal is taken searches in every control cycle.
        """
        if self.params.default_tolerance_m > 0.0 or goal == start:
            return False
        y, x = goal[1], goal[0]
        is_border = x in (0, costs.shape[1] - 1) or y in (0, costs.shape[0] - 1)
        nav_costs = _NAVIGATION_COSTS[bool(self.params.allow_unknown)]
        return is_border or bool(nav_costs[costs[y, x]] >= kernel.OBSTACLE)

    def _spread(self, costs: NDArray[np.uint8], start: Cell, goal: Cell) -> NDArray[np.float32]:
        """Return the potential, float32[H, W], of a wave from a start to a goal."""
        self._not_spread = None
        return _spread(self.wave, costs, _WAVES[bool(self.params.allow_unknown)], start, goal)

    def _reached_pose_near(self, spec: GridSpec, goal: Pose2D) -> Optional[Pose2D]:
        """Return the reached point nearest to the goal, on a square lattice around it."""
        tolerance_m = self.params.default_tolerance_m
        best, best_distance2 = None, float("inf")
        y_m = goal.y_m - tolerance_m
        while y_m <= goal.y_m + tolerance_m:
            x_m = goal.x_m - tolerance_m
            while x_m <= goal.x_m + tolerance_m:
                distance2 = (x_m - goal.x_m) ** 2 + (y_m - goal.y_m) ** 2
                if distance2 < best_distance2 and self._is_reached(spec.cell_of(x_m, y_m)):
                    best, best_distance2 = Pose2D(x_m, y_m, goal.yaw_rad), distance2
                x_m += spec.resolution_m
            y_m += spec.resolution_m
        return best

    def _is_reached(self, cell: Optional[Cell]) -> bool:
        assert self._potential is not None
        return cell is not None and bool(self._potential[cell[1], cell[0]] < NOT_REACHED)

    def _plan_to(self, spec: GridSpec, start_cell: Cell, end: Pose2D) -> NDArray[np.float64]:
        end_cell = spec.cell_of(end.x_m, end.y_m)
        assert self._potential is not None and end_cell is not None
        path, _ = path_from(self._potential, end_cell, start_cell)
        if not len(path):
            raise NoPath(f"the potential has no descent from ({end.x_m:.2f}, {end.y_m:.2f}) m")
        plan = np.zeros((len(path) + 1, 3))
        # Upstream takes a path cell's lower left corner for its position, not its centre.
        plan[:-1, :2] = path[::-1].astype(np.float64) * spec.resolution_m + (
            spec.origin_x_m,
            spec.origin_y_m,
        )
        plan[-1] = end.x_m, end.y_m, end.yaw_rad
        return plan


def navigation_costs(costs: NDArray[np.uint8], allow_unknown: bool) -> NDArray[np.uint8]:
    """Convert costs, uint8[H, W], to NavFn's own: 50 for free cells to 254 for obstacles.

    A cost below INSCRIBED becomes 50 + 0.8 cost, at most 253; unknown cells are
    253 or obstacles; the outermost ring of cells is always an obstacle.
    """
    nav_costs: NDArray[np.uint8] = _NAVIGATION_COSTS[bool(allow_unknown)][costs]
    nav_costs[[0, -1], :] = kernel.OBSTACLE
    nav_costs[:, [0, -1]] = kernel.OBSTACLE
    return nav_costs


def _navigation_costs(allow_unknown: bool) -> NDArray[np.uint8]:
    """Return NavFn's cost, uint8[256], of a cell of each cost of the costmap."""
    table = np.full(256, kernel.OBSTACLE, dtype=np.uint8)
    table[:INSCRIBED] = np.minimum(kernel.NEUTRAL + 0.8 * np.arange(INSCRIBED), kernel.OBSTACLE - 1)
    if allow_unknown:
        table[UNKNOWN] = kernel.OBSTACLE - 1
    return table


def _wave_params(
    nav_costs: NDArray[np.uint8], stop_at_target: bool = True, heuristic: bool = False
) -> wavefront.WaveParams:
    """Return the parameters of a wave over cells with these costs, uint8[256], by their number."""
    return wavefront.WaveParams(
        price=nav_costs.astype(np.float32),
        crossing=wavefront.crossings(nav_costs, kernel.OBSTACLE),
        obstacle=kernel.OBSTACLE,
        neutral=kernel.NEUTRAL,
        planar=True,
        stop_at_target=stop_at_target,
        heuristic=heuristic,
    )


_NAVIGATION_COSTS = {allowed: _navigation_costs(allowed) for allowed in (False, True)}
_WAVES = {allowed: _wave_params(_NAVIGATION_COSTS[allowed]) for allowed in (False, True)}


def potential_from(
    nav_costs: NDArray[np.uint8],
    source: Cell,
    target: Cell,
    stop_at_target: bool,
    heuristic: bool = False,
) -> NDArray[np.float32]:
    """Return the potential, float32[H, W], of a wave from one cell (x, y) to another.

    Args:
        nav_costs: uint8[H, W], see ``navigation_costs``.
        source: Where the wave begins.
        target: Cell to reach.
        stop_at_target: Stop at the front that reaches the target.
        heuristic: Take cells in A*'s order.
    """
    own = np.arange(256, dtype=np.uint8)
    params = _wave_params(own, bool(stop_at_target), bool(heuristic))
    return _spread(Wavefront(), nav_costs, params, source, target)


def _spread(
    wave: Wavefront,
    costs: NDArray[np.uint8],
    params: wavefront.WaveParams,
    source: Cell,
    target: Cell,
) -> NDArray[np.float32]:
    """Return the potential, float32[H, W], that a wave has when it ends."""
    size_y, size_x = costs.shape
    potential = wave.begin((size_y, size_x))
    source_cell = _flat(source, size_x)
    first_front = wavefront.start_at_cell(potential.ravel(), source_cell, size_x)
    max_fronts = max(costs.size // 20, size_x + size_y)
    wave.spread(costs, first_front, params, source_cell, _flat(target, size_x), max_fronts)
    return potential


def path_from(
    potential: NDArray[np.float32], start: Cell, source: Cell
) -> Tuple[NDArray[np.float32], bool]:
    """Descend a potential, float32[H, W], from a cell (x, y) to the wave's source.

    Returns:
        The path, float32[n, 2] cells (x, y), and True if it reached the source. It ends
        elsewhere when it has no more points, at the map's border, or where the potential
        has no slope.
    """
    size_x = potential.shape[1]
    path = np.empty((4 * size_x, 2), dtype=np.float32)
    points, arrived = kernel.descend(
        potential.ravel(), size_x, _flat(start, size_x), _flat(source, size_x), path
    )
    return path[:points], bool(arrived)


def _flat(cell: Cell, size_x: int) -> int:
    return cell[1] * size_x + cell[0]


def cell_on_map(spec: GridSpec, pose: Pose2D, who: str, error: Type[PlanningError]) -> Cell:
    """Return the cell (x, y) of the robot or the goal; raise an error if it is off the costmap."""
    cell = spec.cell_of(pose.x_m, pose.y_m)
    if cell is None:
        place = f"({pose.x_m:.2f}, {pose.y_m:.2f}) m"
        raise error(f"the {who} at {place} is not on the global costmap, {spec.extent}")
    return cell


def no_path(start: Pose2D, goal: Pose2D) -> NoPath:
    """Return the error of a search that does not reach the goal."""
    ways = f"({start.x_m:.2f}, {start.y_m:.2f}) to ({goal.x_m:.2f}, {goal.y_m:.2f}) m"
    return NoPath(f"no path from {ways} on the global costmap")
