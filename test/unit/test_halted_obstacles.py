"""Halted obstacles: remembered where they stopped, until they move or are gone."""

from __future__ import annotations

import numpy as np
import pytest

from quad_nav.control.halted_obstacles import HaltedObstacles
from quad_nav.geometry import Pose2D
from quad_nav.grid import LETHAL, GridSpec
from quad_nav.tracking.tracks import Tracks

SPEC = GridSpec(160, 160, 0.05, -4.0, -4.0)
HERE = Pose2D(0.0, 0.0)


def costs_with(x_m, y_m):
    costs = np.zeros(SPEC.shape, np.uint8)
    cell_x, cell_y = SPEC.cell_of(x_m, y_m)
    costs[cell_y, cell_x] = LETHAL
    return costs


NOTHING, MARKED = np.zeros(SPEC.shape, np.uint8), costs_with(0.8, 0.0)


def tracks(now_s, *rows):
    """Rows of number, x, y, vx and vy."""
    n = len(rows)
    values = np.array(rows, float).reshape(n, 5)
    numbers, states = values[:, 0].astype(np.int64), values[:, 1:]
    return Tracks(now_s, numbers, states, np.zeros((n, 4, 4)), np.full(n, 0.25))


def halted_at(x_m, speed_mps=0.1):
    """An obstacle whose track ended at 1 s."""
    halted = HaltedObstacles()
    halted.update(tracks(0.9, [7, x_m, 0.0, 0.0, speed_mps]), HERE, SPEC, MARKED)
    halted.update(tracks(1.0), HERE, SPEC, MARKED)
    return halted


def test_who_was_slow_when_the_track_ended_has_halted():
    np.testing.assert_array_equal(halted_at(1.0).discs, [[1.0, 0.0, 0.25]])


def test_who_was_fast_when_the_track_ended_has_not():
    assert not len(halted_at(1.0, speed_mps=0.4).discs)


@pytest.mark.parametrize("costs, remains", [(MARKED, True), (NOTHING, False)])
def test_who_is_not_in_the_costmap_after_a_second_is_gone(costs, remains):
    """The marked cell is 0.2 m from the middle."""
    halted = halted_at(1.0)
    halted.update(tracks(1.9), HERE, SPEC, NOTHING)
    assert len(halted.discs)
    halted.update(tracks(2.1), HERE, SPEC, costs)
    assert bool(len(halted.discs)) is remains


@pytest.mark.parametrize("x_m, remains", [(1.2, False), (1.3, True)])
def test_a_track_in_the_same_place_takes_over(x_m, remains):
    halted = halted_at(1.0)
    halted.update(tracks(2.0, [8, x_m, 0.0, 0.5, 0.0]), HERE, SPEC, MARKED)
    assert bool(len(halted.discs)) is remains


@pytest.mark.parametrize("robot_x_m, remains", [(-1.9, True), (-2.1, False)])
def test_none_is_remembered_far_away(robot_x_m, remains):
    """3 m are far."""
    halted = halted_at(1.0)
    halted.update(tracks(1.5), Pose2D(robot_x_m, 0.0), SPEC, MARKED)
    assert bool(len(halted.discs)) is remains
