"""The voxel layer on 1 m voxels, drawn from the side: x to the right, z upwards."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from costmap_maps import costs_of, drawn, picture

from quad_nav.costmap.cost_grid import NOWHERE, Bounds, CostGrid, Window
from quad_nav.costmap.layered import CostmapParams, LayeredCostmap
from quad_nav.costmap.observation import SourceParams
from quad_nav.costmap.voxel import VoxelLayerParams
from quad_nav.costmap.voxel_kernel import VoxelGrid, clear_voxel_line
from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.grid import UNKNOWN, GridSpec

ROW = 2  # everything happens in the row with y from 2 to 3 m
SOURCE = SourceParams(
    name="cloud",
    clearing=True,
    obstacle_range_m=10.0,
    raytrace_range_m=10.0,
    min_obstacle_height_m=-9.0,
    max_obstacle_height_m=9.0,
)
EYE = (0.5, 2.5, 0.5)
ROBOT = Pose2D(0.5, 2.5)


def grid_of(voxels, costs):
    return VoxelGrid(voxels, costs, np.zeros(3), np.ones(3), unknown_threshold=15, mark_threshold=0)


def layer_of(source=SOURCE, rolling=False, **params):
    params = {
        "z_voxels": 3,
        "z_resolution_m": 1.0,
        "max_obstacle_height_m": 9.0,
        "track_unknown_space": True,
        **params,
    }
    return VoxelLayerParams(sources=(source,), **params).make_layer(
        GridSpec(6, 5, 1.0), rolling_window=rolling, default_cost=0
    )


def see(layer, *points, eye=EYE, at_s=0.0):
    """An update with a cloud of points (x, z) in the row."""
    cloud = np.array([(x, 2.5, z) for x, z in points], dtype=np.float32)
    layer.add_cloud("cloud", cloud, Pose3D(0.0, 0.0, 0.0), at_s, at_s, Pose3D(*eye))
    return layer.update_bounds(ROBOT, at_s, NOWHERE)


def side(layer):
    return picture(layer.voxels[ROW].T)


def row(layer):
    return picture(layer.grid.costs[ROW : ROW + 1])


def test_a_ray_clears_until_two_cells_before_the_voxel_that_is_marked():
    layer = layer_of()
    see(layer, (4.5, 0.5))
    assert side(layer) == drawn("""??????
                                   ??????
                                   ...?#?""")
    assert row(layer) == "...?#?"
    assert (np.delete(layer.voxels, ROW, axis=0) == UNKNOWN).all()


def test_a_ray_above_an_obstacle_does_not_clear_it():
    layer = layer_of()
    see(layer, (2.5, 0.5))
    see(layer, (5.5, 2.5), eye=(0.5, 2.5, 2.5), at_s=1.0)
    assert side(layer) == drawn("""....?#
                                   ??????
                                   .?#???""")
    assert row(layer) == "..#.?#"


def test_a_ray_through_an_obstacle_clears_it():
    layer = layer_of()
    see(layer, (2.5, 0.5))
    see(layer, (5.5, 0.5), at_s=1.0)
    assert row(layer) == "....?#"


def test_a_slanting_line():
    voxels, costs = np.full((1, 6, 3), UNKNOWN, np.uint8), np.full((1, 6), UNKNOWN, np.uint8)
    clear_voxel_line(grid_of(voxels, costs), (0.5, 0.5, 0.5), (4.5, 0.5, 2.5), 10.0)
    assert picture(voxels[0].T) == drawn("""???..?
                                            ?..???
                                            .?????""")
    assert picture(costs) == ".....?"


def test_a_line_is_cut_to_its_range_along_the_slope():
    voxels, costs = np.full((1, 6, 3), UNKNOWN, np.uint8), np.full((1, 6), UNKNOWN, np.uint8)
    # 4 steps for a length of 4.47 voxels: 2 / 4.47 of them is one and the end of it.
    clear_voxel_line(grid_of(voxels, costs), (0.5, 0.5, 0.5), (4.5, 0.5, 2.5), 2.0)
    assert picture(voxels[0].T) == drawn("""??????
                                            ?.????
                                            .?????""")


def test_a_steep_line_steps_downwards():
    voxels, costs = np.full((1, 2, 4), UNKNOWN, np.uint8), np.full((1, 2), UNKNOWN, np.uint8)
    clear_voxel_line(grid_of(voxels, costs), (0.9, 0.5, 3.1), (1.1, 0.5, 0.2), 10.0)
    assert picture(voxels[0].T) == drawn(""".?
                                            .?
                                            ?.
                                            ?.""")


def test_a_ray_stops_at_the_height_of_obstacles():
    layer = layer_of(max_obstacle_height_m=2.0)
    # Two cells short it ends at 3.09 m in x and z; at z = 1.99 m it is at x = 1.99 m.
    see(layer, (4.5, 4.5))
    assert side(layer) == drawn("""??????
                                   ?.????
                                   .?????""")
    assert row(layer) == "..????"


def test_a_ray_downwards_stops_on_the_lowest_voxels():
    layer = layer_of()
    # 6 m down on 5 m along: 2.5 m down, at z = 0, it is at x = 2.58 m.
    see(layer, (5.5, -3.5), eye=(0.5, 2.5, 2.5))
    assert side(layer) == drawn(""".?????
                                   ?.????
                                   ??.??#""")


def test_rays_stop_half_a_cell_before_the_far_border():
    layer = layer_of()
    see(layer, (15.5, 0.5))
    assert side(layer).splitlines()[-1] == "......"
    bounds = see(layer, (9.5, 0.5), at_s=1.0)
    assert bounds == Bounds(0.5, 2.5, 5.5, 2.5)


def test_a_sensor_outside_the_voxels_marks_and_does_not_clear():
    layer = layer_of()
    see(layer, (4.5, 0.5), eye=(0.5, 2.5, 3.5))
    assert row(layer) == "????#?"


def test_a_point_at_the_sensor_clears_and_marks_its_voxel():
    layer = layer_of()
    see(layer, EYE[::2])
    assert row(layer) == "#?????"


@pytest.mark.parametrize("threshold, expected", [(0, "?????#"), (1, "?..??#"), (2, "....?#")])
def test_unknown_threshold(threshold, expected):
    layer = layer_of(unknown_threshold=threshold)
    see(layer, (3.5, 1.5), (5.5, 0.5), eye=(0.5, 2.5, 1.5))  # the first one clears x = 0, 1
    assert side(layer).splitlines()[1] == "..?#??"
    layer.voxels[ROW, 1:3, 0] = 0
    layer.voxels[ROW, 3] = UNKNOWN
    see(layer, (5.5, 1.5), eye=(0.5, 2.5, 1.5), at_s=1.0)
    assert row(layer) == expected


@pytest.mark.parametrize("threshold, expected", [(0, "#"), (1, "#"), (2, "?")])
def test_mark_threshold(threshold, expected):
    layer = layer_of(mark_threshold=threshold)
    see(layer, (5.5, 0.5), (5.5, 2.5))
    assert row(layer)[-1] == expected


def test_a_column_with_few_marks_is_freed_by_a_ray():
    layer = layer_of(mark_threshold=1)
    layer.voxels[ROW, 1, 2] = 254
    see(layer, (5.5, 0.5))
    assert row(layer) == "....??"


@pytest.mark.parametrize("z_m, column", [(-1.0, "#??"), (0.0, "#??"), (2.99, "??#"), (3.0, "???")])
def test_heights_of_points(z_m, column):
    layer = layer_of(replace(SOURCE, clearing=False))
    see(layer, (4.5, z_m))
    assert picture(layer.voxels[ROW, 4:5]) == column


def test_points_above_the_height_or_out_of_range_are_not_marked():
    layer = layer_of(
        replace(SOURCE, clearing=False, obstacle_range_m=4.0), max_obstacle_height_m=1.0
    )
    see(layer, (2.5, 1.5), (4.5, 0.5), (4.4, 0.5))
    assert side(layer) == drawn("""??????
                                   ??????
                                   ????#?""")
    assert layer.marked_voxels().tolist() == [[4.5, 2.5, 0.5]]
    layer.reset(1.0)
    see(layer, (2.5, 1.5), (4.5, 0.5), at_s=2.0)
    assert row(layer) == "??????"


def test_voxels_stand_on_their_origin():
    layer = layer_of(replace(SOURCE, clearing=False), origin_z_m=-1.0, z_resolution_m=0.5)
    see(layer, (4.5, -0.75), (3.5, 0.25))
    assert side(layer) == drawn("""???#??
                                   ??????
                                   ????#?""")
    np.testing.assert_array_equal(layer.marked_voxels(), [[3.5, 2.5, 0.25], [4.5, 2.5, -0.75]])


def test_what_was_never_seen_is_free_unless_it_is_tracked():
    layer = layer_of(track_unknown_space=False)
    see(layer, (4.5, 0.5))
    assert row(layer) == "....#."


@pytest.mark.parametrize("method, expected", [(0, "...##."), (1, "#..##."), (99, "#..#..")])
def test_combination_with_the_layers_below(method, expected):
    layer = layer_of(combination_method=method)
    see(layer, (4.5, 0.5))  # ...?#?
    master = CostGrid(GridSpec(6, 5, 1.0))
    master.costs[ROW] = costs_of("#..#..")[0]
    layer.update_costs(master, Window(0, 6, ROW, ROW + 1))
    assert picture(master.costs[ROW : ROW + 1]) == expected


def test_the_footprint_frees_costs_and_leaves_voxels():
    layer = layer_of()
    see(layer, (2.5, 0.5))
    layer.set_footprint(np.array([(0.5, 0.4), (-0.5, 0.4), (-0.5, -0.4), (0.5, -0.4)]), 0.4)
    layer.update_bounds(Pose2D(2.5, 2.5), 0.0, NOWHERE)
    layer.update_costs(CostGrid(GridSpec(6, 5, 1.0)), Window(0, 6, 0, 5))
    assert row(layer) == ".?..??"
    assert side(layer).splitlines()[-1] == ".?#???"


def test_voxels_move_with_a_rolling_window():
    layer = layer_of(rolling=True)
    layer.add_cloud(
        "cloud",
        np.array([(4.5, 2.5, 0.5)], np.float32),
        Pose3D(0.0, 0.0, 0.0),
        0.0,
        0.0,
        Pose3D(*EYE),
    )
    layer.update_bounds(Pose2D(2.75, 2.25), 0.0, NOWHERE)  # the middle as it is
    assert side(layer).splitlines()[-1] == "...?#?"
    layer.buffers["cloud"].observations.clear()
    layer.update_bounds(Pose2D(4.75, 3.25), 1.0, NOWHERE)  # two cells in x, one in y
    assert picture(layer.voxels[ROW - 1].T) == drawn("""??????
                                                        ??????
                                                        .?#???""")
    assert (layer.voxels[ROW] == UNKNOWN).all()
    np.testing.assert_array_equal(layer.marked_voxels(), [[4.5, 2.5, 0.5]])


def test_reset_forgets_the_voxels():
    layer = layer_of()
    see(layer, (4.5, 0.5))
    layer.reset(1.0)
    assert (layer.voxels == UNKNOWN).all() and (layer.grid.costs == UNKNOWN).all()


def test_a_change_of_parameters_empties_the_layer_and_is_passed_on():
    layer = layer_of()
    see(layer, (4.5, 0.5))
    layer.reconfigure(layer.params)
    assert row(layer) == "...?#?"
    layer.reconfigure(replace(layer.params, z_voxels=2))
    assert layer.voxels.shape == (5, 6, 2)
    assert row(layer) == "??????"
    assert not layer.is_current(0.0)
    layer.buffers["cloud"].observations.clear()
    assert layer.update_bounds(ROBOT, 1.0, NOWHERE) == Bounds(0.0, 0.0, 6.0, 5.0)
    assert layer.is_current(1.0)


def test_in_a_costmap():
    voxels = VoxelLayerParams(sources=(SOURCE,), z_voxels=3, z_resolution_m=1.0)
    params = CostmapParams(
        width_m=6.0,
        height_m=5.0,
        resolution_m=1.0,
        robot_radius_m=0.2,
        layers=(("voxels", voxels),),
    )
    costmap = LayeredCostmap(params)
    costmap.layers["voxels"].add_cloud(
        "cloud",
        np.array([(4.5, 2.5, 1.5), (5.5, 1.5, 2.5)], np.float32),
        Pose3D(0.0, 0.0, 0.0),
        0.0,
        0.0,
        Pose3D(*EYE),
    )
    costmap.update(0.0, ROBOT)
    assert picture(costmap.costs) == drawn("""......
                                              ......
                                              ....#.
                                              ......
                                              ......""")
