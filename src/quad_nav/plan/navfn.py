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
from typing import Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import GoalOutsideMap, NoPath, StartOutsideMap
from quad_nav.geometry import Pose2D
from quad_nav.grid import FREE, INSCRIBED, UNKNOWN, GridSpec
from quad_nav.kernels import descent as kernel
from quad_nav.kernels import wave as wavefront

Cell = Tuple[int, int]
NOT_REACHED = float(wavefront.NOT_REACHED)  # potential of cells that the wave did not reach


@dataclass(frozen=True)
class NavfnParams:
    """Parameters of ``navfn/NavfnROS``."""

    allow_unknown: bool = True
    default_tolerance_m: float = 0.0
    visualize_potential: bool = False
    planner_window_x_m: float = 0.0  # upstream reads it and never uses it, either
    planner_window_y_m: float = 0.0


class Navfn:
    """The planner ``navfn/NavfnROS``.

    Attributes:
        params: Parameters.
        potential: Potential of the last plan, float32[H, W], ``NOT_REACHED`` (1e10) where the
            wave did not come; None before the first plan.
    """

    def __init__(self, params: NavfnParams = NavfnParams()) -> None:
        self.params = params
        self.potential: Optional[NDArray[np.float32]] = None

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
        start_cell = start_cell_of(spec, start)
        costs[start_cell[1], start_cell[0]] = FREE
        if self.params.default_tolerance_m <= 0.0:
            goal_cell = goal_cell_of(spec, goal)
        else:  # a border cell is never reached, so the wave covers the map
            goal_cell = spec.cell_of(goal.x_m, goal.y_m) or (0, 0)
        self.potential = potential_from(
            navigation_costs(costs, self.params.allow_unknown),
            source=start_cell,
            target=goal_cell,
            stop_at_target=True,
        )
        end = self._reached_pose_near(spec, goal)
        if end is None:
            raise NoPath(
                f"no path from ({start.x_m:.2f}, {start.y_m:.2f}) to "
                f"({goal.x_m:.2f}, {goal.y_m:.2f}) m on the global costmap"
            )
        return self._plan_to(spec, start_cell, end)

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
        assert self.potential is not None
        return cell is not None and bool(self.potential[cell[1], cell[0]] < NOT_REACHED)

    def _plan_to(self, spec: GridSpec, start_cell: Cell, end: Pose2D) -> NDArray[np.float64]:
        end_cell = spec.cell_of(end.x_m, end.y_m)
        assert self.potential is not None and end_cell is not None
        path, _ = path_from(self.potential, end_cell, start_cell)
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
    table = np.full(256, kernel.OBSTACLE, dtype=np.uint8)
    table[:INSCRIBED] = np.minimum(kernel.NEUTRAL + 0.8 * np.arange(INSCRIBED), kernel.OBSTACLE - 1)
    if allow_unknown:
        table[UNKNOWN] = kernel.OBSTACLE - 1
    nav_costs = table[costs]
    nav_costs[[0, -1], :] = kernel.OBSTACLE
    nav_costs[:, [0, -1]] = kernel.OBSTACLE
    return nav_costs


def potential_from(
    nav_costs: NDArray[np.uint8],
    source: Cell,
    target: Cell,
    stop_at_target: bool,
    heuristic: bool = False,
) -> NDArray[np.float32]:
    """Spread a wave from a cell.

    Args:
        nav_costs: uint8[H, W], see ``navigation_costs``.
        source: Cell (x, y) where the wave begins.
        target: Cell (x, y) to reach.
        stop_at_target: Stop at the front that reaches the target.
        heuristic: Take cells in A*'s order.

    Returns:
        The potential, float32[H, W].
    """
    size_y, size_x = nav_costs.shape
    cells = size_x * size_y
    source_cell, target_cell = _flat(source, size_x), _flat(target, size_x)
    potential = np.full(cells, NOT_REACHED, dtype=np.float32)
    first_front = wavefront.start_at_cell(potential, source_cell, size_x)
    wavefront.propagate(
        nav_costs.ravel(),
        potential,
        first_front,
        wavefront.WaveParams(
            kernel.OBSTACLE, kernel.NEUTRAL, True, bool(stop_at_target), bool(heuristic)
        ),
        source_cell,
        target_cell,
        size_x,
        max(cells // 20, size_x + size_y),
    )
    return potential.reshape(nav_costs.shape)


def path_from(
    potential: NDArray[np.float32], start: Cell, source: Cell
) -> Tuple[NDArray[np.float32], bool]:
    """Descend from a cell to the wave's source.

    Args:
        potential: float32[H, W].
        start: Cell (x, y) where the descent begins.
        source: Cell (x, y) where the wave began.

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


def start_cell_of(spec: GridSpec, start: Pose2D) -> Cell:
    """Return the robot's cell (x, y).

    Raises:
        StartOutsideMap: The robot is off the costmap.
    """
    cell = spec.cell_of(start.x_m, start.y_m)
    if cell is None:
        raise StartOutsideMap(
            f"the robot at ({start.x_m:.2f}, {start.y_m:.2f}) m is not on "
            f"the global costmap, {spec.extent}"
        )
    return cell


def goal_cell_of(spec: GridSpec, goal: Pose2D) -> Cell:
    """Return the goal's cell (x, y).

    Raises:
        GoalOutsideMap: The goal is off the costmap.
    """
    cell = spec.cell_of(goal.x_m, goal.y_m)
    if cell is None:
        raise GoalOutsideMap(
            f"the goal at ({goal.x_m:.2f}, {goal.y_m:.2f}) m is not on "
            f"the global costmap, {spec.extent}"
        )
    return cell
