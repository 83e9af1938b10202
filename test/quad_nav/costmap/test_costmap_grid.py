from __future__ import annotations

import numpy as np
import pytest
from costmap_maps import costs_of, drawn, picture

from quad_nav.costmap.cost_grid import (
    NO_CELLS,
    NOWHERE,
    Bounds,
    CostGrid,
    Window,
    merge_known,
    merge_maximum,
    occupancy,
)
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


def test_centre_on_far_away_forgets_everything():
    grid = grid_of("##\n##", default_cost=UNKNOWN)
    before = grid.costs
    grid.centre_on(100.0, -100.0)
    assert grid.costs is before
    assert picture(grid.costs) == drawn("??\n??")


@pytest.mark.parametrize(
    "bounds, window",
    [
        (Bounds(1.5, 2.5, 3.5, 2.6), Window(1, 4, 2, 3)),
        (Bounds(-9.0, -9.0, 99.0, 99.0), Window(0, 5, 0, 4)),
        (Bounds(1.0, 1.0, 5.0, 4.0), Window(1, 5, 1, 4)),
    ],
)
def test_window_of_bounds(bounds, window):
    assert CostGrid(GridSpec(5, 4, 1.0)).window_of(bounds) == window


def test_no_bounds_no_window():
    assert CostGrid(GridSpec(5, 4, 1.0)).window_of(NOWHERE).is_empty


def test_bounds_combine():
    assert Bounds(0.0, 1.0, 2.0, 3.0).union(Bounds(-1.0, 2.0, 1.0, 5.0)) == Bounds(
        -1.0, 1.0, 2.0, 5.0
    )
    assert Bounds(0.0, 1.0, 2.0, 3.0).grown(0.5) == Bounds(-0.5, 0.5, 2.5, 3.5)
    assert NOWHERE.including(np.array([(1.0, 5.0), (3.0, 4.0)])) == Bounds(1.0, 4.0, 3.0, 5.0)


def test_windows_combine():
    assert Window(1, 2, 3, 9).union(Window(0, 2, 4, 5)) == Window(0, 2, 3, 9)
    assert NO_CELLS.union(Window(4, 5, 6, 7)) == Window(4, 5, 6, 7)
    assert Window(4, 5, 6, 7).union(Window(9, 3, 0, 0)) == Window(4, 5, 6, 7)


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


def test_fill_polygon_needs_all_vertices_on_the_grid():
    grid = CostGrid(GridSpec(3, 3, 1.0), UNKNOWN)
    assert not grid.fill_polygon(np.array([(0.5, 0.5), (3.5, 0.5), (0.5, 2.5)]), 0)
    assert (grid.costs == UNKNOWN).all()


def test_forget_area_outside_a_square():
    grid = grid_of("#####\n#####\n#####\n#####\n#####")
    # A square of 4 m around (2.5, 2.5): cells 0 and 4 are its border and count as outside.
    grid.forget_area(2.5, 2.5, 4.0, keep_inside=True)
    assert picture(grid.costs) == drawn("?????\n?###?\n?###?\n?###?\n?????")


def test_forget_area_inside_a_square_that_leaves_the_grid():
    grid = grid_of("####\n####\n####\n####")
    grid.forget_area(0.5, 0.5, 4.0, keep_inside=False)
    assert picture(grid.costs) == drawn("####\n####\n??##\n??##")
    grid.forget_area(-50.0, -50.0, 4.0, keep_inside=False)
    assert picture(grid.costs) == drawn("####\n####\n??##\n??##")


def test_merge_maximum_takes_unknown_for_the_lowest():
    below = np.array([[0, 10, 254], [255, 255, 100]], dtype=np.uint8)
    merge_maximum(below, np.array([[255, 9, 253], [0, 255, 101]], dtype=np.uint8))
    assert below.tolist() == [[0, 10, 254], [0, 255, 101]]


def test_merge_known_overwrites_downwards_too():
    below = np.array([0, 254, 254, 255], dtype=np.uint8)
    merge_known(below, np.array([7, 0, 255, 3], dtype=np.uint8))
    assert below.tolist() == [7, 0, 254, 3]


def test_occupancies():
    costs = np.array([[0, 1, 126], [252, 253, 254], [255, 0, 0]], dtype=np.uint8)
    assert occupancy(costs).tolist() == [[0, 1, 49], [98, 99, 100], [-1, 0, 0]]
    assert occupancy(costs).dtype == np.int8
