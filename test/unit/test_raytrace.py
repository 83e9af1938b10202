"""Clearing skips lines that have nothing to clear; the outcome is that of all lines."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.kernels.cost_grid import CostmapView
from quad_nav.kernels.obstructed_cells import MAX_OBSTRUCTED, SECTORS, find_obstructed, sector_of
from quad_nav.kernels.raytrace import ObservationStack, clear_all_rays, clear_rays

RESOLUTION_M = 0.05
NOWHERE = (1e30, 1e30, -1e30, -1e30)


def scans(random, count, size_m):
    """Sensors near the middle and points all around, some of them far outside the grid."""
    sensors = size_m / 2 + random.uniform(-0.3, 0.3, (count, 3))
    directions = np.linspace(-math.pi, math.pi, 128, endpoint=False) + random.uniform(0, 1)
    clouds = []
    for sensor in sensors:
        ranges = random.uniform(0.05, size_m, len(directions))
        clouds.append(
            sensor
            + np.stack(
                [ranges * np.cos(directions), ranges * np.sin(directions), 0 * ranges], axis=1
            )
        )
    return sensors, np.concatenate(clouds).astype(np.float32), len(directions)


def cleared_by_all_lines(costs, sensors, points, per_scan, range_m):
    bounds = np.array(NOWHERE)
    for k, sensor in enumerate(sensors):
        clear_rays(
            CostmapView(costs, -1.0, 2.0, RESOLUTION_M),
            sensor[0],
            sensor[1],
            points[k * per_scan : (k + 1) * per_scan],
            range_m,
            np.ones(SECTORS, bool),
            np.empty(0, np.int64),
            bounds,
        )
    return bounds


@pytest.mark.parametrize("obstructed", [0, 3, 40, 400, 5000])
@pytest.mark.parametrize("range_m", [1.0, 10.0])
def test_the_outcome_is_that_of_all_lines(obstructed, range_m):
    random = np.random.default_rng([obstructed, int(range_m)])
    for _ in range(10):
        costs = np.zeros((80, 90), np.uint8)
        filled = random.permutation(costs.size)[:obstructed]
        costs.reshape(-1)[filled] = random.choice([1, 254, 255])
        sensors, points, per_scan = scans(random, 6, 4.0)
        sensors += (-1.0, 2.0, 0.0)
        points += np.array((-1.0, 2.0, 0.0), np.float32)
        expected = costs.copy()
        expected_bounds = cleared_by_all_lines(expected, sensors, points, per_scan, range_m)
        ends = per_scan * np.arange(1, len(sensors) + 1)
        bounds = np.array(NOWHERE)
        before = np.count_nonzero(costs)
        seen = ObservationStack(sensors, points, ends - per_scan, ends)
        clear_all_rays(CostmapView(costs, -1.0, 2.0, RESOLUTION_M), seen, range_m, bounds)
        np.testing.assert_array_equal(costs, expected)
        # The last millimetre before the grid's border is in the same cell.
        np.testing.assert_allclose(bounds, expected_bounds, atol=1.01e-3)
        assert obstructed < 40 or np.count_nonzero(costs) < before


def test_sectors_go_round_once():
    sectors = [
        sector_of(math.cos(angle), math.sin(angle))
        for angle in np.linspace(0.0, 2 * math.pi, 5000, endpoint=False)
    ]
    assert sectors[0] == 0 and sectors[-1] == SECTORS - 1
    assert set(np.diff(sectors)) == {0, 1}
    assert [sector_of(0.0, 2.0), sector_of(-1.0, 0.0), sector_of(0.0, -3.0)] == [
        SECTORS // 4,
        SECTORS // 2,
        3 * SECTORS // 4,
    ]


@pytest.mark.parametrize(
    "direction", [(0.0, 0.0), (math.nan, 1.0), (math.inf, 1.0), (1.0, -1e-300)]
)
def test_every_direction_has_a_sector(direction):
    assert 0 <= sector_of(*direction) < SECTORS


def test_obstructed_cells_of_a_window():
    costs = np.zeros((4, 5), np.uint8)
    costs[1, 2], costs[2, 3], costs[3, 4] = 254, 255, 1
    found = np.zeros(3, np.int64)
    assert find_obstructed(costs, (0, 4, 0, 4), found) == 2
    assert found.tolist() == [7, 13, 0]
    assert find_obstructed(costs, (0, 5, 0, 4), found) == 3
    assert find_obstructed(costs, (0, 5, 0, 4), found[:2]) == 3
    assert MAX_OBSTRUCTED > 0
