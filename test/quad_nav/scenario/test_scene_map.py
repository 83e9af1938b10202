"""The map that static layers get offline."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from quad_nav.geometry import Pose2D
from quad_nav.offline.run import fly
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.scenario.scene_map import scene_map
from quad_nav.sim.obstacles import Box, Cylinder
from quad_nav.sim.scene import Scene, Walls

ROOT = Path(__file__).resolve().parents[3]


def test_walls_and_what_stands_at_the_flying_altitude_are_occupied():
    scene = Scene(
        "three",
        3.0,
        2.0,
        1.0,
        Walls(thickness_m=0.5),
        (
            Box("block", 1.0, 1.0, 1.0, 1.0, 2.0),
            Box("low", 2.5, 1.0, 1.0, 1.0, 0.5),
            Cylinder("hanging", 2.25, 1.75, 0.2, 0.4, bottom_m=0.8),
        ),
        (Pose2D(0.2, 0.2),),
    )
    grid = scene_map(scene, 0.5)
    assert (grid.spec.origin_x_m, grid.spec.origin_y_m) == (-0.5, -0.5)
    assert ["".join("#" if cell else "." for cell in row) for row in grid.occupancy[::-1]] == [
        "########",
        "#....#.#",
        "#.##...#",
        "#.##...#",
        "#......#",
        "########",
    ]


def test_a_configuration_with_a_static_map_flies():
    static = (("global_costmap/static_map", True),)
    options = FlightOptions(
        ROOT / "scenes" / "arena.yaml", ROOT / "goals", "tutorial", static, robots=1
    )
    summary = fly(read_setup(replace(options, time_limit_s=6.0)))
    assert summary.robots[0].path_length_m > 0.5
