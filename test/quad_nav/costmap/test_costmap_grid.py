from __future__ import annotations

import numpy as np
from costmap_maps import costs_of, drawn, picture

from quad_nav.costmap.cost_grid import CostGrid, merge_maximum
from quad_nav.grid import UNKNOWN, GridSpec


def grid_of(text, resolution_m=1.0, origin=(0.0, 0.0), default_cost=0):
    costs = costs_of(text)
    grid = CostGrid(GridSpec(costs.shape[1], costs.shape[0], resolution_m, *origin), default_cost)
    grid.costs[...] = costs
    return grid


def test_centre_on_keeps_what_still_fits():
    grid = grid_of("""..#.
                      .#..
                      #...
                      ....""")
    # Half of (4 - 1/2) cells to the left of the point: origin (1.25, 0.25), cut to (1, 0).
    grid.centre_on(3.0, 2.0)
    assert (grid.spec.origin_x_m, grid.spec.origin_y_m) == (1.0, 0.0)
    assert picture(grid.costs) == drawn(""".#..
                                   #...
                                   ....
                                   ....""")


def test_centre_on_cuts_towards_zero_when_moving_back():
    grid = grid_of(
        """....
                      ....
                      #...
                      ....""",
        origin=(1.0, 0.0),
    )
    grid.centre_on(1.8, 0.8)  # the origin should be (0.05, -0.95): less than a cell away
    assert (grid.spec.origin_x_m, grid.spec.origin_y_m) == (1.0, 0.0)
    grid.centre_on(1.7, 0.7)  # (-0.05, -1.05): one whole cell each way
    assert (grid.spec.origin_x_m, grid.spec.origin_y_m) == (0.0, -1.0)
    assert picture(grid.costs) == drawn("""....
                                           .#..
                                           ....
                                           ....""")


def test_fill_polygon_includes_its_outline():
    grid = CostGrid(GridSpec(7, 5, 1.0), UNKNOWN)
    # Bresenham's lines depend on their direction, so a symmetric triangle is not filled
    # symmetrically: right side (5, 0) (4, 1) (4, 2) (3, 3) (3, 4), left side (2, 3) (2, 2) (1, 1).
    assert grid.fill_polygon(np.array([(1.5, 0.5), (5.5, 0.5), (3.5, 4.5)]), 0)
    assert picture(grid.costs) == drawn("""???.???
                                   ??..???
                                   ??...??
                                   ?....??
                                   ?.....?""")


def test_merge_maximum_takes_unknown_for_the_lowest():
    below = np.array([[0, 10, 254], [255, 255, 100]], dtype=np.uint8)
    merge_maximum(below, np.array([[255, 9, 253], [0, 255, 101]], dtype=np.uint8))
    assert below.tolist() == [[0, 10, 254], [0, 255, 101]]
