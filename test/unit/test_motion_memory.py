"""Memory of motion: what is recalled of obstacles that move as others did."""

from __future__ import annotations

import numpy as np
import pytest

from quad_nav.tracking.motion_memory import MotionMemory
from quad_nav.tracking.motion_memory_kernel import NONE, replay
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


def test_an_obstacle_seen_for_less_than_a_quarter_of_a_second_recalls_nothing():
    memory = watched()
    for k in range(3):
        memory.add(tracks(20.0 + 0.1 * k, 8, corner(2.0 + 0.1 * k)))
    assert memory.recall(8, TIMES).known == 0
    memory.add(tracks(20.3, 8, corner(2.3)))
    assert memory.recall(8, TIMES).known > 30


def test_an_obstacle_does_not_recall_itself():
    assert watched(4.0).recall(7, TIMES).known == 0


def test_a_clock_that_jumps_back_empties_the_memory():
    memory = watched()
    assert memory.span_s == pytest.approx(8.0)
    memory.add(tracks(1.0, 7, corner(1.0)))
    assert memory.span_s == 0.0


@pytest.mark.slow
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


def unsure(now_s, number, state, spread_m):
    seen = tracks(now_s, number, state)
    seen.covariances[0, 0, 0] = seen.covariances[0, 1, 1] = spread_m**2
    return seen


def test_what_is_predicted_of_a_hidden_obstacle_is_not_remembered():
    memory = MotionMemory()
    for k in range(41):
        memory.add(unsure(0.1 * k, 7, [0.1 * k, 0.0, 1.0, 0.0], 0.1 if k < 20 else 0.2))
    for k in range(21):
        memory.add(tracks(20.0 + 0.1 * k, 8, [0.1 * k - 0.5, 0.0, 1.0, 0.0]))
    recalled = memory.recall(8, TIMES)  # at (1.5, 0), and the other was seen until (1.9, 0)
    assert recalled.known == 6  # 0 to 0.4 s, and 0.1 s more for which it still counts


def test_a_track_that_goes_on_where_one_ended_continues_it():
    """It is hidden from 2.9 s to 4 s, at 1 m/s, and has another number then."""
    memory = MotionMemory()
    for k in [*range(30), *range(40, 81)]:
        memory.add(tracks(0.1 * k, 7 if k < 30 else 9, [0.1 * k, 0.0, 1.0, 0.0]))
    for k in range(21):
        memory.add(tracks(20.0 + 0.1 * k, 8, [0.1 * k, 0.0, 1.0, 0.0]))
    recalled = memory.recall(8, TIMES)
    assert recalled.known == 61
    np.testing.assert_allclose(recalled.moves, np.column_stack([TIMES, 0.0 * TIMES]), atol=1e-9)


def test_a_track_whose_states_do_not_follow_from_each_other_is_cut():
    """At 4 s it is 1 m to the side: another obstacle was taken for it."""
    memory = MotionMemory()
    for k in range(81):
        memory.add(tracks(0.1 * k, 7, [0.1 * k, 0.0 if k < 40 else 1.0, 1.0, 0.0]))
    for k in range(21):
        memory.add(tracks(20.0 + 0.1 * k, 8, [0.1 * k, 0.0, 1.0, 0.0]))
    recalled = memory.recall(8, TIMES)  # at (2, 0), and the other was there until (3.9, 0)
    assert recalled.known == 21
    np.testing.assert_allclose(recalled.moves[60], [6.0, 0.0], atol=1e-9)


def test_an_obstacle_that_leaves_the_path_of_the_other_recalls_it_no_more():
    memory = watched()
    for k in range(21):
        memory.add(tracks(20.0 + 0.1 * k, 8, corner(0.1 * k)))
    assert memory.recall(8, TIMES).known == 61
    for k in range(21, 31):
        memory.add(tracks(20.0 + 0.1 * k, 8, [0.1 * k, 0.06 * (k - 20), 1.0, 0.6]))
    assert memory.recall(8, TIMES).known == 0  # 0.6 m beside it, more than 0.2 m


def test_a_hidden_obstacle_stays_on_the_path_that_it_repeats():
    """It was seen up to the corner. Its track goes straight on, the other turned."""
    memory = watched()
    for k in range(41):
        memory.add(tracks(20.0 + 0.1 * k, 8, corner(0.1 * k)))
    assert memory.recall(8, TIMES).known > 30
    for k in range(41, 46):
        memory.add(unsure(20.0 + 0.1 * k, 8, [0.1 * k, 0.0, 1.0, 0.0], 0.3))
    recalled = memory.recall(8, TIMES)  # the track is at (4.5, 0), the other was at (4, 0.5)
    np.testing.assert_allclose(recalled.moves[0], [-0.5, 0.5], atol=0.06)
    np.testing.assert_allclose(recalled.moves[10], [-0.5, 1.5], atol=0.06)


def test_between_two_samples_the_motion_is_a_cubic():
    """From rest at (0, 0) to (2, 0) at 2 m/s in 2 s: x = u^2 (3 - 2u) 2 - u^2 (1 - u) 4 = 2 u^2."""
    samples = np.array([[0.0, 0.0, 0.0, 0.0, 0.0], [2.0, 2.0, 0.0, 2.0, 0.0]])
    places = np.empty((4, 2))
    known = replay(samples, np.array([1, NONE]), 0, np.array([0.0, 1.0, 2.0, 3.0]), places)
    np.testing.assert_allclose(places, [[0.0, 0.0], [0.5, 0.0], [2.0, 0.0], [4.0, 0.0]])
    assert known == 3
