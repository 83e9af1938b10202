"""Headings along paths, each mode by hand."""

from __future__ import annotations

import numpy as np
import pytest

from quad_nav.plan.orientations import OrientationMode, with_headings

# Two metres east, two metres north; the goal looks west.
CORNER = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [2, 2, np.pi]], dtype=float)
NORTH, WEST = np.pi / 2, np.pi


def yaws(mode, window=1, plan=CORNER, turns_from_bend=True) -> np.ndarray:
    return with_headings(plan, 0.1, mode, window, turns_from_bend)[:, 2]


@pytest.mark.parametrize(
    "mode, turned_rad",
    [
        (OrientationMode.FORWARD, 0.0),
        (OrientationMode.BACKWARD, np.pi),
        (OrientationMode.LEFTWARD, -np.pi / 2),
        (OrientationMode.RIGHTWARD, np.pi / 2),
    ],
)
def test_modes_along_the_path(mode, turned_rad):
    expected = np.array([0, 0, np.pi / 4, NORTH]) + turned_rad
    np.testing.assert_allclose(np.cos(yaws(mode)[:-1] - expected), 1.0)
    assert yaws(mode)[-1] == WEST


def test_interpolation_takes_the_short_way():
    plan = CORNER.copy()
    plan[-1, 2] = -3.0
    turned = with_headings(plan, 3.0, OrientationMode.INTERPOLATE, 1, True)[:, 2]
    half_rad = np.pi - 3.0
    np.testing.assert_allclose(turned, 3.0 + half_rad * np.arange(5) / 2)


@pytest.mark.parametrize(
    "turns_from_bend, blended",
    [(True, [0.0, 0.8 / 3, 1.6 / 3, 0.8]), (False, [0.8, 3.2 / 3, 4.0 / 3, 1.6])],
)
def test_forward_then_interpolate_blends_on_the_last_straight(turns_from_bend, blended):
    plan = np.vstack([[[0, -2, 0], [0, -1, 0]], np.zeros((5, 3))])
    plan[2:, 0] = np.arange(5)
    plan[-1, 2] = 0.8
    np.testing.assert_allclose(
        yaws(OrientationMode.FORWARD_THEN_INTERPOLATE, plan=plan, turns_from_bend=turns_from_bend),
        [0.1, NORTH, np.pi / 4, *blended],
        atol=1e-12,
    )
