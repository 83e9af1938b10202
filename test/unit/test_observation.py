"""Observations of one sensor, stacked for the kernels."""

from __future__ import annotations

import numpy as np
import pytest

from quad_nav.costmap.observation import Observation, ObservationBuffer, SourceParams


def observation(stamp_s: float, count: int) -> Observation:
    return Observation(
        stamp_s, np.array([stamp_s, 0.0, 1.0]), np.full((count, 3), stamp_s, np.float32)
    )


@pytest.mark.parametrize("persistence_s", [0.0, 0.25, 1.0])
def test_the_stack_holds_what_is_kept_newest_first(persistence_s):
    buffer = ObservationBuffer(SourceParams("scan", observation_persistence_s=persistence_s))
    random = np.random.default_rng(1)
    for step in range(200):
        now_s = 0.1 * step
        # Now and then one comes late, or too late.
        stamp_s = now_s - random.choice([0.0, 0.0, 0.0, 0.15, 2.0])
        buffer.add(observation(stamp_s, int(random.integers(0, 20))), now_s)
        stack = buffer.stack
        assert len(stack.begins) == len(stack.ends) == len(buffer.observations)
        for k, kept in enumerate(buffer.observations):
            np.testing.assert_array_equal(stack.sensors[k], kept.sensor)
            np.testing.assert_array_equal(
                stack.points[stack.begins[k] : stack.ends[k]], kept.points
            )
    # 20 points at most in each of 11 observations, and twice that when they move.
    assert len(stack.points) <= 2 * 11 * 20


def test_an_observation_that_is_too_old_leaves_nothing():
    buffer = ObservationBuffer(SourceParams("scan", observation_persistence_s=1.0))
    buffer.add(observation(0.0, 5), 1.5)
    assert buffer.observations == []
    assert buffer.stack.sensors.shape == (0, 3)
