"""``docs/limits.md`` says what the code does."""

from __future__ import annotations

from pathlib import Path

import pytest

from quad_nav import errors
from quad_nav.barn import worlds
from quad_nav.config import workload
from quad_nav.files import document, plain_yaml
from quad_nav.mission import goal_file
from quad_nav.recording import bag_info, bag_trace
from quad_nav.sim import (
    imported_scene,
    map_file,
    map_image,
    scene_file,
    world_file,
    xml_tree,
)
from quad_nav.topics import validation

TABLE = (Path(__file__).parents[2] / "docs" / "limits.md").read_text(encoding="utf-8")
ROWS = {
    "messages about one file": [errors.MAX_PROBLEMS],
    "goal file": [
        goal_file.MAX_BYTES,
        goal_file.MAX_GOALS,
        goal_file.MAX_COORDINATE_M,
        goal_file.MAX_TIMEOUT_S,
    ],
    "YAML: scenes, maps, parameters": [
        plain_yaml.MAX_BYTES,
        plain_yaml.MAX_NODES,
        plain_yaml.MAX_LEVELS,
        plain_yaml.MAX_DIGITS,
    ],
    "numbers in a scene": [document.MAX_MAGNITUDE, scene_file.MAX_SIZE_M, document.MAX_TEXT_LENGTH],
    "starts in a scene": [scene_file.MAX_STARTS],
    "starts chosen by `quad`": [imported_scene.MAX_CANDIDATES],
    "Gazebo world": [
        xml_tree.MAX_BYTES,
        xml_tree.MAX_ELEMENTS,
        xml_tree.MAX_DEPTH,
        world_file.MAX_BYTES,
        world_file.MAX_INCLUDES,
    ],
    "models, links and collisions": [world_file.MAX_PARTS, world_file.MAX_OBSTACLES],
    "image of a map": [map_image.MAX_BYTES, map_image.MAX_CELLS],
    "cells of a map": [map_file.MIN_RESOLUTION_M, map_file.MAX_RESOLUTION_M, map_file.MAX_BOXES],
    "costmap": [workload.MAX_CELLS],
    "BARN worlds (`.npz`)": [worlds.MAX_BYTES],
    "recording that is read": [
        bag_trace.MAX_MEMORY_BYTES / 1e9,
        bag_trace.LONGEST_FLIGHT_S / 86400,
        bag_info.MAX_ROBOTS,
    ],
    "scan": [validation.MAX_BEAMS],
    "point cloud": [validation.MAX_POINTS],
    "odometry, commands, goals": [validation.MAX_MAGNITUDE],
    "intention of a peer": [validation.MAX_POSES],
    "map on a topic": [validation.MAX_CELLS],
}


def spellings(number):
    return {str(number), f"{number:g}", f"{number:g}".replace("e+0", "e"), f"{number:.0f}"}


@pytest.mark.parametrize("row", ROWS)
def test_the_table_has_the_limits_in_force(row):
    (line,) = [line for line in TABLE.splitlines() if line.startswith(f"| {row} |")]
    words = set(line.replace(",", " ").replace(";", " ").split())
    for number in ROWS[row]:
        assert spellings(number) & words, number
