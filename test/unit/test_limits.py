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
    free_starts,
    map_file,
    map_image,
    scene_file,
    world_file,
    xml_tree,
)
from quad_nav.topics import validation

TABLE = (Path(__file__).parents[2] / "docs" / "limits.md").read_text(encoding="utf-8")
ROWS = {
    "messages about one file": [errors.MOST_PROBLEMS],
    "goal file": [
        goal_file.MAX_BYTES,
        goal_file.MAX_GOALS,
        goal_file.MAX_COORDINATE_M,
        goal_file.MAX_TIMEOUT_S,
    ],
    "YAML: scenes, maps, parameters": [
        plain_yaml.MOST_BYTES,
        plain_yaml.MOST_NODES,
        plain_yaml.MOST_LEVELS,
        plain_yaml.MOST_DIGITS,
    ],
    "numbers in a scene": [document.LARGEST, scene_file.MAX_SIZE_M, document.LONGEST_TEXT],
    "starts in a scene": [scene_file.MAX_STARTS],
    "starts chosen by `quad`": [free_starts.MAX_LOOKS],
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
    "costmap": [workload.MOST_CELLS],
    "BARN worlds (`.npz`)": [worlds.MOST_BYTES],
    "recording that is read": [
        bag_trace.MOST_MEMORY_BYTES / 1e9,
        bag_trace.LONGEST_FLIGHT_S / 86400,
        bag_info.MOST_ROBOTS,
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
