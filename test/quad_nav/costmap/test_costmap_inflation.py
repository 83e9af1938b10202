"""Costs by hand: 1 m cells, inscribed radius 1 m, and a factor of ln 2, half per metre."""

from __future__ import annotations

import math

import numpy as np
import pytest
from costmap_maps import costs_of

from quad_nav.costmap.cost_grid import EVERYWHERE, Bounds, CostGrid, Window
from quad_nav.costmap.inflation import InflationLayer, InflationLayerParams
from quad_nav.geometry import Pose2D
from quad_nav.grid import FREE, INSCRIBED, LETHAL, UNKNOWN, GridSpec

ROBOT = Pose2D(0.0, 0.0)
HALF_PER_METRE = InflationLayerParams(inflation_radius_m=3.0, cost_scaling_factor=math.log(2.0))


def inflated(text, params=HALF_PER_METRE, inscribed_m=1.0, window=None):
    costs = costs_of(text)
    height, width = costs.shape
    master = CostGrid(GridSpec(width, height, 1.0))
    master.costs[...] = costs
    layer = InflationLayer(params, 1.0, inscribed_m)
    layer.update_costs(master, window or Window(0, width, 0, height))
    return master.costs


def test_costs_around_a_single_obstacle():
    costs = inflated("""....
                        ....
                        ....
                        #...""")
    # 252 / 2^(d - 1) at d = 1.414, 2, 2.236, 2.828, 3; cut, not rounded. (3, 1) is too far.
    assert costs[0].tolist() == [254, 253, 126, 63]
    assert costs[1].tolist() == [253, 189, 106, 0]
    assert costs[2].tolist() == [126, 106, 70, 0]
    assert costs[3].tolist() == [63, 0, 0, 0]


def test_new_parameters_or_footprint_redo_everything():
    layer = InflationLayer(HALF_PER_METRE, 1.0, 1.0)
    small = Bounds(1.0, 1.0, 2.0, 2.0)
    layer.update_bounds(ROBOT, 0.0, small)
    layer.reconfigure(HALF_PER_METRE)
    assert layer.update_bounds(ROBOT, 1.0, small) != EVERYWHERE
    layer.reconfigure(InflationLayerParams(inflation_radius_m=2.0))
    assert layer.update_bounds(ROBOT, 2.0, small) == EVERYWHERE
    layer.set_footprint(np.zeros((0, 2)), 2.0)
    assert layer.cost_table[0, 2] == 253
    assert layer.update_bounds(ROBOT, 3.0, small) == EVERYWHERE


def by_brushfire(costs, window, layer):
    """Inflate as the original does: bins by distance, every neighbour queued, no short cuts."""
    costs = costs.copy()
    reach, (height, width) = layer.radius_cells, costs.shape
    bins = {0: []}
    for y in range(max(0, window.y0 - reach), min(height, window.yn + reach)):
        for x in range(max(0, window.x0 - reach), min(width, window.xn + reach)):
            if costs[y, x] == LETHAL:
                bins[0].append((x, y, x, y))
    seen = np.zeros(costs.shape, bool)
    for squared in range(reach * reach + 1):
        for x, y, seed_x, seed_y in bins.get(squared, ()):  # grows at its end
            if seen[y, x]:
                continue
            seen[y, x] = True
            cost, old = layer.cost_table[abs(y - seed_y), abs(x - seed_x)], costs[y, x]
            raises = cost >= INSCRIBED or (layer.params.inflate_unknown and cost > FREE)
            if raises if old == UNKNOWN else cost > old:
                costs[y, x] = cost
            for to_x, to_y in ((x - 1, y), (x, y - 1), (x + 1, y), (x, y + 1)):
                if 0 <= to_x < width and 0 <= to_y < height and not seen[to_y, to_x]:
                    distance2 = (to_x - seed_x) ** 2 + (to_y - seed_y) ** 2
                    bins.setdefault(distance2, []).append((to_x, to_y, seed_x, seed_y))
    return costs


@pytest.mark.parametrize("seed", range(12))
def test_inflation_equals_the_original_brushfire(seed):
    random = np.random.default_rng(seed)
    for _ in range(8):
        height, width = random.integers(3, 60, 2).tolist()
        costs = random.choice(
            np.array([FREE, 50, 128, INSCRIBED, LETHAL, UNKNOWN], np.uint8),
            (height, width),
            p=[0.7, 0.05, 0.03, 0.02, 0.0, 0.2],
        )
        for _ in range(random.integers(0, 4)):  # walls, dense and with gaps
            y, x = random.integers(0, height), random.integers(0, width)
            wall = costs[y, x:] if random.random() < 0.5 else costs[y:, x]
            wall[random.random(wall.size) < random.choice([0.3, 1.0])] = LETHAL
        costs[random.random(costs.shape) < random.choice([0.0, 0.02, 0.3])] = LETHAL
        params = InflationLayerParams(
            inflation_radius_m=float(random.choice([0.5, 2.0, 5.0, 11.0])),
            cost_scaling_factor=float(random.choice([0.3, 2.0])),
            inflate_unknown=bool(random.random() < 0.5),
        )
        layer = InflationLayer(params, 1.0, float(random.choice([0.0, 1.5])))
        (x0, xn), (y0, yn) = (
            sorted(random.integers(0, n + 1, 2).tolist()) for n in (width, height)
        )
        window = Window(x0, xn, y0, yn)
        master = CostGrid(GridSpec(width, height, 1.0))
        master.costs[...] = costs
        layer.update_costs(master, window)
        np.testing.assert_array_equal(master.costs, by_brushfire(costs, window, layer))


def test_distances_that_do_not_fit_into_32_bits_inflate_alike():
    master = CostGrid(GridSpec(400, 3, 1.0))
    master.costs[1, 0] = LETHAL
    layer = InflationLayer(
        InflationLayerParams(inflation_radius_m=200.0, cost_scaling_factor=0.001), 1.0, 0.5
    )
    assert layer._ranks.states.dtype == np.int64
    layer.update_costs(master, Window(0, 400, 0, 3))
    assert master.costs[1, :201].tolist() == layer.cost_table[0, :201].tolist()
    assert layer.cost_table[0, 200] > 0
    assert not master.costs[1, 201:].any()
