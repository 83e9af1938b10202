"""Observations of one sensor, stacked for the kernels."""

from __future__ import annotations

import numpy as np
import pytest

from quad_nav.costmap.observation import Observation, ObservationBuffer, SourceParams
from quad_nav.costmap.observation_kernel import Ranges


def observation(stamp_s: float, count: int) -> Observation:
    points = np.full((count, 3), stamp_s, np.float32)
    return Observation(stamp_s, np.array([stamp_s, 0.0, 1.0]), lambda: points)


@pytest.mark.parametrize("persistence_s", [0.0, 0.25, 1.0])
def test_the_stack_holds_what_is_kept_newest_first(persistence_s):
    buffer = ObservationBuffer(SourceParams("scan", observation_persistence_s=persistence_s))
    random = np.random.default_rng(1)
    for step in range(200):
        now_s = 0.1 * step
        # Now and then one comes late, or too late.
        stamp_s = now_s - random.choice([0.0, 0.0, 0.0, 0.15, 2.0])
        buffer.add(observation(stamp_s, int(random.integers(0, 20))), now_s)
        if random.random() < 0.3:
            continue  # costmaps are updated less often than messages come
        ranges = Ranges(6.0, 100.0, 100.0 if step < 150 else 12.0)
        stack, newest, count = buffer.stack(ranges)
        assert count == len(buffer.observations)
        for k, kept in enumerate(buffer.observations):
            slot = (newest - k) % len(stack.sensors)
            rays, marks = stack.counts[slot]
            np.testing.assert_array_equal(stack.sensors[slot], kept.sensor)
            np.testing.assert_array_equal(stack.ends[slot, :rays], kept.points[:, :2])
            low = kept.points[kept.points[:, 2] <= ranges.max_height_m]
            np.testing.assert_array_equal(stack.marks[slot, :marks], low[:, :2])
    # 20 points at most in each of 11 observations, and half as many when they move.
    assert len(stack.sectors) <= 16 and stack.sectors.shape[1] <= 20


@pytest.mark.parametrize("late", [0.0, 0.3])
def test_observations_up_to_the_first_expired_one_are_kept(late):
    """The rule written out, with stamps in order and with some of messages that came late."""
    rng = np.random.default_rng(6)
    buffer = ObservationBuffer(SourceParams("scan", observation_persistence_s=0.5))
    kept, dropped = [], 0
    for k in range(200):
        now_s = 0.1 * k
        stamp_s = now_s - (float(rng.uniform(0.0, 0.8)) if rng.random() < late else 0.0)
        observation = Observation(stamp_s, np.zeros(3), lambda: np.zeros((1, 3), np.float32))

        buffer.add(observation, now_s)

        kept.insert(0, observation)
        expired = [round(1e9 * (now_s - one.stamp_s)) > 500_000_000 for one in kept]
        if any(expired):
            dropped += len(kept) - expired.index(True)
            del kept[expired.index(True) :]
        assert buffer.observations == kept
    assert dropped > 100
