"""Tracks of moving obstacles: prediction and change of frame."""

from __future__ import annotations

import math

import numpy as np

from quad_nav.costmap.tracks import Tracks
from quad_nav.geometry import Pose2D


def one_track() -> Tracks:
    return Tracks(
        10.0,
        np.array([7]),
        np.array([[1.0, 2.0, 0.5, -1.0]]),
        np.diag([0.01, 0.04, 0.09, 0.16])[np.newaxis],
        np.array([0.3]),
        np.array([0.0]),
        np.array([[3.0, 4.0, 0.0, 0.1, 0.25]]),
    )


def test_prediction_moves_the_obstacle_and_grows_its_uncertainty():
    later = one_track().at(12.0)
    assert later.time_s == 12.0
    assert np.allclose(later.states, [[2.0, 0.0, 0.5, -1.0]])
    # var(x + 2 vx) = 0.01 + 4 * 0.09; var(y + 2 vy) = 0.04 + 4 * 0.16
    assert np.allclose(np.diag(later.covariances[0]), [0.37, 0.68, 0.09, 0.16])
    assert np.isclose(later.covariances[0, 0, 2], 2 * 0.09)
    assert np.allclose(later.suspects, [[3.0, 4.2, 0.0, 0.1, 0.25]])


def test_a_quarter_turn_swaps_the_axes():
    turned = one_track().transformed(Pose2D(10.0, 0.0, math.pi / 2))
    assert np.allclose(turned.states, [[8.0, 1.0, 1.0, 0.5]])
    assert np.allclose(turned.covariances[0], np.diag([0.04, 0.01, 0.16, 0.09]))
    assert np.allclose(turned.suspects, [[6.0, 3.0, -0.1, 0.0, 0.25]])
    assert turned.numbers.tolist() == [7] and turned.radii_m.tolist() == [0.3]
