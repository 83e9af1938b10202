"""The edge of a global costmap, which plans keep away from.

Walls at the edge of a costmap, or just beyond it, are not on it, and no costs are inflated from
there. A plan along the edge leads the robot into them.
"""

from __future__ import annotations

from contextlib import contextmanager
from typing import Any, Iterator, List

from numpy.typing import NDArray

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.geometry import Pose2D
from quad_nav.grid import LETHAL, GridSpec


@contextmanager
def closed_edge(
    costmap: LayeredCostmap, start: Pose2D, goal: Pose2D, closes: bool = True
) -> Iterator[None]:
    """Mark the cells at the edge of a costmap as obstacles, for the search of a plan.

    These are the cells whose centres are nearer to the edge than the robot's inscribed radius. At
    the end they have their costs again. Nothing is marked without ``closes``
    (``NavigatorParams.plan_inside_map``), in a costmap that rolls with the robot, and if start or
    goal, in the costmap's frame, are that near to the edge or off the costmap.
    """
    spec, cells = costmap.spec, _edge_cells(costmap)
    if (
        not closes
        or cells == 0
        or costmap.params.rolling_window
        or not all(_is_inside(spec, pose, cells) for pose in (start, goal))
    ):
        yield
        return
    strips = edge_strips(costmap.costs, costmap)
    open_costs = [strip.copy() for strip in strips]
    for strip in strips:
        strip[...] = LETHAL
    try:
        yield
    finally:
        for strip, before in zip(strips, open_costs):
            strip[...] = before


def edge_strips(cells: NDArray[Any], costmap: LayeredCostmap) -> List[NDArray[Any]]:
    """Return the four strips at the edge of an array [H, W] of a costmap's cells."""
    count = _edge_cells(costmap)
    return [cells[:count], cells[-count:], cells[:, :count], cells[:, -count:]] if count else []


def _edge_cells(costmap: LayeredCostmap) -> int:
    return int(costmap.inscribed_radius_m / costmap.spec.resolution_m + 0.5)


def _is_inside(spec: GridSpec, pose: Pose2D, cells: int) -> bool:
    """Return whether a pose is on a grid and at least so many cells from its edge."""
    cell = spec.cell_of(pose.x_m, pose.y_m)
    return cell is not None and all(
        cells <= at < size - cells for at, size in zip(cell, (spec.size_x, spec.size_y))
    )
