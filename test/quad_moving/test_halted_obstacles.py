"""Halted obstacles: followed where they stopped, until they walk on or are gone."""

from __future__ import annotations

import math

import numpy as np
import pytest
from test_tracking import ON, PILLARS, pose_at, times, track

RADIUS_M = 0.3


def stops(now_s, then_mps=0.0, then_s=2.0):
    """It walks to (3, 0) in 2 s, and goes on after a while at another speed."""
    y_m = -2.0 + min(now_s, 2.0) + then_mps * max(now_s - then_s, 0.0)
    return ((3.0, y_m, RADIUS_M),)


def last(discs_at, until_s, params=ON):
    """Return the tracks after the last scan."""
    *_, (_, _, tracker) = track(discs_at, times(until_s), params=params)
    return tracker.known


def test_who_has_stopped_is_a_suspect():
    tracks = last(stops, 6.0)
    assert len(tracks) == 0
    np.testing.assert_allclose(tracks.suspects, [(3.0, 0.0, 0.0, 0.0, RADIUS_M)], atol=0.05)


def test_what_moves_for_the_first_time_is_a_suspect_before_it_is_a_track():
    first = {}
    for now_s, _, tracker in track(
        lambda t: ((3.0, max(t - 1.0, 0.0), RADIUS_M),), times(2.0), params=ON
    ):
        for kind, rows in (("suspect", tracker.known.suspects), ("track", tracker.known.states)):
            if len(rows):
                first.setdefault(kind, now_s)
    assert 1.0 < first["suspect"] < first["track"] < 2.0


@pytest.mark.parametrize("noise_m", [0.0, 0.02])
def test_what_has_always_stood_is_no_suspect(noise_m):
    """Something walks about as well, so that every scan is compared with all earlier ones."""

    def discs_at(t):
        return (*PILLARS, (0.5 * t - 3.0, 4.5, 0.25))

    def pose_of(t):
        return pose_at(-1.0 + 0.3 * t, 0.5 * math.sin(t), 0.6 * math.sin(0.7 * t))

    times_s = times(10.0, 20.0)
    for now_s, _, tracker in track(discs_at, times_s, pose_of, ON, noise_m):
        suspects, walker = tracker.known.suspects, discs_at(now_s)[-1][:2]
        assert (np.hypot(*(suspects[:, :2] - walker).T) < 0.5).all()


def test_who_vanishes_in_sight_is_forgotten():
    assert len(last(lambda t: stops(t) if t < 6.0 else (), 6.2).suspects) == 1
    assert len(last(lambda t: stops(t) if t < 6.0 else (), 6.6).suspects) == 0


@pytest.mark.parametrize("until_s, known", [(21.0, 1), (23.0, 0)])
def test_who_is_hidden_is_known_as_long_as_earlier_scans(until_s, known):
    """A standing thing of 0.5 m stands before it from 6 s on, for more or less than 16 s."""
    tracks = last(lambda t: (*stops(t), *(((1.5, 0.0, 0.5),) if t > 6.0 else ())), until_s)
    near = np.hypot(*(tracks.suspects[:, :2] - (3.0, 0.0)).T) < 0.1
    assert near.sum() == known
