"""The search for a plan to a point near a goal that cannot be reached."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.errors import NoPath
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec
from quad_nav.plan.planner import plan_near, ring_offsets

GOAL = Pose2D(5.0, 1.0, 0.0)


def test_rings_around_a_goal():
    first = list(ring_offsets(0.25, 0.75, 0.75))
    # The axis points once each, the corners with both signs: 8 points of one ring.
    assert len(first) == len(set(first)) == 8
    assert set(first) == {(x, y) for x in (-0.75, 0, 0.75) for y in (-0.75, 0, 0.75)} - {(0, 0)}


def test_rings_are_summed_in_single_precision():
    third, tenth = float(np.float32(0.3)), float(np.float32(0.1))
    two = list(ring_offsets(0.05, third, third))
    assert two[0] == (-0.15000000596046448, 0.0)
    assert two[8] == (-0.30000001192092896, 0.0)
    assert len(two) == 8 + 16
    assert list(ring_offsets(0.05, tenth, tenth))[0] == (-tenth, 0.0)
    assert list(ring_offsets(0.05, third, tenth)) == []
    assert list(ring_offsets(0.05, math.inf, math.nan)) == []


@pytest.mark.parametrize("place", [Pose2D(2.0, 2.0), Pose2D(50.0, 2.0), Pose2D(math.nan, 2.0)])
def test_a_search_without_end_stops_at_the_map(place):
    class Nowhere:
        def make_plan(self, *_):
            raise NoPath("nowhere")

    with pytest.raises(NoPath):
        plan_near(Nowhere(), GridSpec(9, 9, 0.5), np.zeros((9, 9)), GOAL, place, math.inf)
