"""Escape from a collision, on maps with costs computed by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.control.escape import SPEED_MPS, TURN_RADPS, escape, is_round
from quad_nav.footprint import circle
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import LETHAL, GridSpec

SPEC = GridSpec(40, 40, 0.05)
HERE = 1.0
FOOTPRINT = circle(0.35)


def slope() -> np.ndarray:
    """Costs fall to the right, by 6 in each cell; the robot at x = 1 m stands at 253 - 120."""
    return np.tile(np.arange(253, 13, -6, dtype=np.uint8), (40, 1))


@pytest.mark.parametrize(
    "yaw_rad, command",
    [
        (0.0, Twist2D(SPEED_MPS)),
        (0.2, Twist2D(SPEED_MPS)),
        (1.4, Twist2D(0.0, 0.0, -TURN_RADPS)),
        (-1.4, Twist2D(0.0, 0.0, TURN_RADPS)),
        (math.pi, Twist2D(-SPEED_MPS)),
        (2.0, Twist2D(0.0, 0.0, TURN_RADPS)),  # its back is nearer
    ],
)
def test_it_turns_to_where_costs_fall_and_goes_there_forwards_or_backwards(yaw_rad, command):
    assert escape(SPEC, slope(), FOOTPRINT, Pose2D(HERE, HERE, yaw_rad)) == command


def test_between_obstacles_it_leaves_through_the_gap():
    costs = np.full(SPEC.shape, LETHAL, dtype=np.uint8)
    costs[20:, 20] = 0  # a gap one cell wide, upwards
    costs[20, 20] = 253
    here = Pose2D(1.025, 1.025, math.pi / 2)
    assert escape(SPEC, costs, FOOTPRINT, here) == Twist2D(SPEED_MPS)


@pytest.mark.parametrize(
    "costs", [np.full(SPEC.shape, 50, dtype=np.uint8), np.full(SPEC.shape, LETHAL, dtype=np.uint8)]
)
def test_where_nothing_is_better_there_is_no_way_out(costs):
    assert escape(SPEC, costs, FOOTPRINT, Pose2D(HERE, HERE)) is None


def test_one_that_is_not_round_has_none():
    oblong = np.array([[0.4, 0.2], [-0.4, 0.2], [-0.4, -0.2], [0.4, -0.2]])
    assert not is_round(oblong) and is_round(FOOTPRINT) and is_round(np.zeros((0, 2)))
    assert escape(SPEC, slope(), oblong, Pose2D(HERE, HERE)) is None
