"""The voxel layer on 1 m voxels, drawn from the side: x to the right, z upwards."""

from __future__ import annotations

import numpy as np
from costmap_maps import drawn, picture

from quad_nav.costmap.cost_grid import NOWHERE
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


def test_voxels_and_ends_of_rays_as_costmap_2d_publishes_them():
    """One ray ends two cells before its point, the other one in the middle of the last cell."""
    layer = layer_of()
    see(layer, (4.5, 0.5), (9.5, 0.5))
    packed = layer.packed_voxels()
    assert packed.dtype == np.uint32 and packed[0, 0] == 0xFFFF  # unknown
    assert [hex(column) for column in packed[ROW, [0, 4]]] == ["0xfffe", "0x1ffff"]
    ((stamp_s, ends),) = layer.clearing_ends()
    assert stamp_s == 0.0
    np.testing.assert_allclose(ends, [(2.5, 2.5, 0.5), (5.5, 2.5, 0.5)])
    see(layer, (4.5, 0.5), eye=(0.5, 2.5, 5.0))  # a sensor above the voxels clears nothing
    assert list(layer.clearing_ends()) == []


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


def test_a_slanting_line():
    voxels, costs = np.full((1, 6, 3), UNKNOWN, np.uint8), np.full((1, 6), UNKNOWN, np.uint8)
    clear_voxel_line(grid_of(voxels, costs), (0.5, 0.5, 0.5), (4.5, 0.5, 2.5), 10.0)
    assert picture(voxels[0].T) == drawn("""???..?
                                            ?..???
                                            .?????""")
    assert picture(costs) == ".....?"


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
