"""Clearing skips lines that have nothing to clear; the outcome is that of all lines."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.costmap.cost_grid_kernel import CostmapView
from quad_nav.costmap.observation import _make_stack
from quad_nav.costmap.observation_kernel import Ranges, include_rays, store_observation
from quad_nav.costmap.obstructed_cells import SECTORS
from quad_nav.costmap.raytrace import clear_all_rays, clear_rays, mark_all_points

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


def view(costs, moved_cells=0):
    return CostmapView(costs, -1.0 + moved_cells * RESOLUTION_M, 2.0, RESOLUTION_M)


def stack_of(sensors, points, per_scan, range_m):
    """Put the observations into a ring so that the first is the newest."""
    seen = _make_stack(len(sensors) + 3, per_scan)
    for k, sensor in enumerate(sensors):
        own = points[k * per_scan : (k + 1) * per_scan]
        store_observation(seen, -2 - k, sensor, own, Ranges(range_m, 1.5, 1.0))
    return seen, len(sensors) + 1


def cleared_by_all_lines(costmap, seen, newest, count, range_m):
    """Trace every line, and include every ray."""
    bounds = np.array(NOWHERE)
    lines, everywhere = np.empty(0, np.int64), np.ones(SECTORS, bool)
    for k in range(count):
        slot = (newest - k) % len(seen.sensors)
        seen.drawn[slot] = np.nan  # else bounds of an earlier update count
        include_rays(costmap, seen, slot, range_m, bounds)
        clear_rays(costmap, seen, slot, range_m, everywhere, lines)
    return bounds


def test_bounds_hold_the_rays_up_to_the_range_and_no_more():
    random = np.random.default_rng(8)
    costs = np.zeros((400, 400), np.uint8)
    for range_m in (0.5, 2.0, 30.0):
        for width_rad in (0.3, 2.0, 6.2):
            angles = random.uniform(-3.0, 1.0) + np.linspace(0.0, width_rad, 100)
            lengths = random.uniform(0.0, 8.0, 100)
            sensor = np.array((20.0, 19.0, 0.0))
            steps = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(100)))
            points = (sensor + lengths[:, None] * steps).astype(np.float32)
            seen, newest = stack_of([sensor], points, 100, range_m)
            bounds = np.array(NOWHERE)
            include_rays(CostmapView(costs, 0.0, 0.0, 0.1), seen, newest, range_m, bounds)
            ends = [sensor[:2]]
            for x, y in points[:, :2].astype(float) - sensor[:2]:
                scale = min(1.0, range_m / math.hypot(x, y))
                ends.append(sensor[:2] + np.array((x, y)) * scale)
            expected = [*np.min(ends, axis=0), *np.max(ends, axis=0)]
            # Python 3.8 rounds hypot differently from the kernel, in the last place.
            np.testing.assert_allclose(bounds, expected, rtol=1e-14)


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
        seen, newest = stack_of(sensors, points, per_scan, range_m)
        # The third update finds the bounds of the second, the others another grid.
        for update, moved_cells in enumerate((0, 2, 2, 1)):
            before = np.count_nonzero(costs)
            expected, bounds = costs.copy(), np.array(NOWHERE)
            clear_all_rays(view(costs, moved_cells), seen, newest, len(sensors), range_m, bounds)
            expected_bounds = cleared_by_all_lines(
                view(expected, moved_cells),
                *stack_of(sensors, points, per_scan, range_m),
                len(sensors),
                range_m,
            )
            np.testing.assert_array_equal(costs, expected)
            # The last millimetre before the grid's border is in the same cell.
            np.testing.assert_allclose(bounds, expected_bounds, atol=1.01e-3)
            assert update or obstructed < 40 or np.count_nonzero(costs) < before
            costs.reshape(-1)[filled] = random.choice([1, 254, 255])


def test_points_within_range_and_height_mark():
    points = np.array(
        [[0.5, 2.5, 0.2], [0.51, 2.5, 0.2], [0.5, 3.5, 0.2], [0.0, 2.5, 1.5], [-2.0, 2.0, 0.2]],
        np.float32,
    )
    seen, newest = stack_of(np.array([[0.0, 2.0, 0.2]]), points, 5, 10.0)
    costs, bounds = np.zeros((80, 90), np.uint8), np.array(NOWHERE)
    mark_all_points(view(costs), seen, newest, 1, bounds)
    # The third is 1.58 m away, the fourth too high; the last is off the map and 2 m away.
    assert list(zip(*np.nonzero(costs))) == [(10, 30)]
    np.testing.assert_allclose(bounds, [0.5, 2.5, 0.51, 2.5], atol=1e-6)
