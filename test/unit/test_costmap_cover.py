"""Global costmaps that end within the arena are named before the flight."""

from __future__ import annotations

import pytest

from quad_nav import config
from quad_nav.scenario.costmap_cover import uncovered
from quad_nav.sim.scene import Scene, Walls

SCENE = Scene("s", 12.0, 8.0, 1.0, Walls(), (), (), origin_x_m=-6.0)
HELD = {"origin_x": -6.0, "origin_y": 0.0, "width": 12.0, "height": 8.0, "static_map": False}


def warnings(**changes) -> list:
    tree = {"global_costmap": {**HELD, **changes}, "local_costmap": {"rolling_window": True}}
    return uncovered(SCENE, {"move_base0": config.load(tree)})


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"origin_x": -7.0, "width": 14.0},
        {"origin_x": -5.96, "width": 13.0},
        {"rolling_window": True, "width": 3.0},
        {"static_map": True, "width": 3.0},
    ],
)
def test_costmaps_that_hold_the_arena_or_follow(changes):
    assert warnings(**changes) == []


@pytest.mark.parametrize(
    "changes",
    [
        {"origin_x": 0.0},
        {"origin_y": 0.2},
        {"width": 11.0},
        {"height": 7.0},
    ],
)
def test_costmaps_that_end_within(changes):
    assert len(warnings(**changes)) == 1


def test_the_message_says_both_areas():
    assert warnings(origin_x=0.0) == [
        "/move_base0: global_costmap covers x 0 to 12 m, y 0 to 8 m, but the arena is "
        "x -6 to 6 m, y 0 to 8 m: there are no plans beyond the costmap; "
        "expected origin_x, origin_y, width and height to hold it"
    ]
