"""Memory of motion: what is recalled of obstacles that move as others did."""

from __future__ import annotations

import numpy as np
import pytest

from quad_nav.tracking.motion_memory import MotionMemory
from quad_nav.tracking.tracks import Tracks

TIMES = np.arange(0.0, 6.05, 0.1)


def tracks(now_s, number, state):
    states = np.array([state], float)
    return Tracks(now_s, np.array([number]), states, np.zeros((1, 4, 4)), np.array([0.5]))


def corner(elapsed_s):
    """Return the state of an obstacle: 4 s at 1 m/s along x, then along y."""
    if elapsed_s < 4.0:
        return [elapsed_s, 0.0, 1.0, 0.0]
    return [4.0, elapsed_s - 4.0, 0.0, 1.0]


def watched(until_s=8.0):
    memory = MotionMemory()
    for k in range(int(until_s * 10) + 1):
        memory.add(tracks(0.1 * k, 7, corner(0.1 * k)))
    return memory


def test_an_obstacle_that_moves_as_one_did_turns_where_it_turned():
    memory = watched()
    for k in range(21):
        memory.add(tracks(20.0 + 0.1 * k, 8, corner(0.1 * k)))
    recalled = memory.recall(8, TIMES)  # it is at (2, 0)
    assert recalled.known == 61
    np.testing.assert_allclose(recalled.moves[10], [1.0, 0.0], atol=0.06)
    np.testing.assert_allclose(recalled.moves[40], [2.0, 2.0], atol=0.12)


def test_after_the_end_of_the_memory_the_velocity_stays():
    memory = watched(6.0)
    for k in range(21):
        memory.add(tracks(20.0 + 0.1 * k, 8, corner(0.1 * k)))
    recalled = memory.recall(8, TIMES)
    assert 40 <= recalled.known <= 42  # the other was seen for 4 s from there
    np.testing.assert_allclose(recalled.moves[60], [2.0, 4.0], atol=0.12)


@pytest.mark.parametrize(
    "shift, speed", [(0.6, 1.0), (0.0, 0.4)], ids=["another place", "another velocity"]
)
def test_an_obstacle_that_moves_otherwise_recalls_nothing(shift, speed):
    memory = watched()
    for k in range(21):
        memory.add(tracks(20.0 + 0.1 * k, 8, [speed * 0.1 * k, shift, speed, 0.0]))
    assert memory.recall(8, TIMES).known == 0


def test_an_obstacle_seen_for_less_than_half_a_second_recalls_nothing():
    memory = watched()
    for k in range(5):
        memory.add(tracks(20.0 + 0.1 * k, 8, corner(0.1 * k)))
    assert memory.recall(8, TIMES).known == 0


def test_an_obstacle_does_not_recall_itself():
    assert watched(4.0).recall(7, TIMES).known == 0


def test_a_clock_that_jumps_back_empties_the_memory():
    memory = watched()
    assert memory.span_s == pytest.approx(8.0)
    memory.add(tracks(1.0, 7, corner(1.0)))
    assert memory.span_s == 0.0


def test_the_older_half_is_dropped_when_the_memory_is_full():
    memory = MotionMemory()
    for k in range(45_000):
        memory.add(tracks(0.1 * k, 7, [0.1 * k, 0.0, 1.0, 0.0]))
    assert 2000.0 < memory.span_s < 4000.0
    assert memory.recall(7, TIMES).known == 0


def test_the_acceleration_is_that_of_the_last_half_second():
    memory = MotionMemory()
    for k in range(8):
        memory.add(tracks(0.1 * k, 7, [0.0, 0.0, 1.0, 0.1 * k]))
    np.testing.assert_allclose(memory.acceleration(7), [0.0, 1.0])
    np.testing.assert_allclose(memory.acceleration(8), [0.0, 0.0])
