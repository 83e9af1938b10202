"""Motions: poses of moving obstacles as a function of time."""

import numpy as np
import pytest

from quad_nav.sim.motion import SPLINE, Motion
from quad_nav.sim.movers import Motions, phases_s

POINTS = ((0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (4.0, 2.0, 1.0))


def motion(points=POINTS, times_s=(0.0, 2.0, 3.0), **given):
    return Motion(times_s, points, **given)


def poses(one, *times_s, phase_s=0.0):
    return Motions([one], [phase_s]).poses(np.array(times_s))[:, 0].tolist()


def test_straight_lines_at_constant_speed():
    assert poses(motion(loop=False), 0.0, 0.5, 2.0, 2.5, 3.0, 9.0) == [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [4.0, 0.0, 0.0],
        [4.0, 1.0, 0.5],
        [4.0, 2.0, 1.0],
        [4.0, 2.0, 1.0],
    ]


def test_a_loop_jumps_from_its_last_keyframe_to_its_first():
    before, at, after = poses(motion(), 3.0 - 1e-9, 3.0, 3.5)
    assert before == pytest.approx([4.0, 2.0, 1.0], abs=1e-6)
    assert at == [0.0, 0.0, 0.0]
    assert after == [1.0, 0.0, 0.0]
    assert poses(motion(), 0.5, phase_s=3.0) == [after]
    assert poses(motion(), 0.0, phase_s=-2.5) == [after]


def test_a_body_waits_for_its_first_keyframe_in_every_loop():
    late = motion(times_s=(1.0, 2.0, 3.0))
    assert [x for x, _, _ in poses(late, 0.0, 1.0, 1.5, 3.5, 4.5)] == [0.0, 0.0, 2.0, 0.0, 2.0]


def test_the_spline_in_the_middle_of_each_segment():
    """At u = 0.5: (P[i] + P[i+1]) / 2 + (M[i] - M[i+1]) / 8, whatever the times are.

    M = (2, 0), (2, 1), (0, 1) and for the yaw 0, 0.5, 0.5.
    """
    first, second = poses(motion(interpolation=SPLINE), 1.0, 2.5)
    assert first == pytest.approx([2.0, -1.0 / 8.0, -0.5 / 8.0])
    assert second == pytest.approx([4.0 + 2.0 / 8.0, 1.0, 0.5])


def test_a_closed_spline_has_equal_tangents_at_its_ends():
    square = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.0))
    closed = motion(square, (0.0, 1.0, 2.0, 3.0, 4.0), interpolation=SPLINE)
    tangents = closed.tangents()[:, :2].tolist()
    assert tangents[0] == tangents[-1] == [0.5, -0.5]
    assert tangents[1] == [0.5, 0.5]
    assert not motion(square, (0.0, 1.0, 2.0, 3.0, 4.0), tension=1.0).tangents().any()


def test_a_common_random_phase_is_a_part_of_the_longest_loop():
    motions = [motion(), motion(times_s=(0.0, 20.0, 30.0))]
    drawn = [phases_s(motions, None, seed) for seed in range(200)]
    assert all(first == second for first, second in drawn)
    firsts = np.array(drawn)[:, 0]
    assert 0.0 <= firsts.min() < 3.0 and 27.0 < firsts.max() < 30.0
