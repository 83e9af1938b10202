"""Cells that a scene's solids take, and the parts that they leave."""

from __future__ import annotations

import numpy as np
import pytest

from quad_nav.grid import GridSpec
from quad_nav.sim.obstacles import Box, Cylinder, Sphere
from quad_nav.sim.scene import Scene, Walls
from quad_nav.sim.scene_cells import parts_of, touched_cells


@pytest.mark.parametrize("margin_m", [0.0, 0.35])
def test_touched_cells_are_those_within_the_margin(margin_m):
    random = np.random.default_rng(5)
    solids = [
        Box(f"b{k}", *random.uniform(-1.0, 9.0, 2), *random.uniform(0.1, 2.0, 3), yaw_rad=k)
        for k in range(12)
    ]
    solids += [Cylinder("tree", 3.0, 3.0, 0.4, 2.0), Sphere("ball", 6.0, 2.0, 0.9, 0.5)]
    scene = Scene("s", 8.0, 6.0, 1.0, Walls(), tuple(solids), ())
    spec = GridSpec(97, 61, 0.1, -0.5, 0.2)  # the walls are partly on it
    rows, columns = np.mgrid[:61, :97]
    centres = np.stack([-0.5 + (columns + 0.5) * 0.1, 0.2 + (rows + 0.5) * 0.1], axis=-1)
    expected = scene.flight_surface_distances_m(centres) <= margin_m
    touched = touched_cells(scene, spec, margin_m)
    assert 0.05 < touched.mean() < 0.95
    assert (touched == expected).all()


def test_parts_hang_together_by_sides_not_by_corners():
    drawing = [".#..", "#..#", ".###", ".#.."]
    parts = parts_of(np.array([[cell == "." for cell in row] for row in drawing]))
    assert parts.tolist() == [[1, 0, 2, 2], [0, 2, 2, 0], [3, 0, 0, 0], [3, 0, 4, 4]]
