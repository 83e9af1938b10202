"""Odometry filter: single messages that no flight explains are dropped."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.mission.odometry_filter import OdometryFilter, OdometrySample


def at(stamp_s, x_m, y_m=0.0, frame="odom0"):
    return OdometrySample(stamp_s, frame, x_m, y_m)


def flying():
    """A filter that has accepted 0.5 m/s for half a second, to x = 0.25 m."""
    odometry = OdometryFilter()
    assert all(odometry.accepts(at(0.025 * k, 0.0125 * k)) for k in range(21))
    return odometry


@pytest.mark.parametrize(
    "elsewhere", [at(0.525, 1e5), at(0.525, 0.26, -0.3), at(0.525, 0.26, frame="odom1")]
)
def test_one_message_elsewhere_is_dropped(elsewhere):
    odometry = flying()
    assert not odometry.accepts(elsewhere)
    assert odometry.is_jumping
    assert odometry.accepts(at(0.55, 0.275))
    assert not odometry.is_jumping and not odometry.has_relocated


def test_another_publisher_beside_the_real_one_is_dropped_for_ever():
    odometry = flying()
    for k in range(21, 400):
        assert not odometry.accepts(at(0.025 * k, 1e5))
        assert odometry.accepts(at(0.025 * k, 0.0125 * k))


def test_odometry_that_stays_elsewhere_counts_after_a_second():
    odometry = flying()
    accepted = [odometry.accepts(at(0.625 + 0.125 * k, 50.0 + 0.0625 * k)) for k in range(10)]
    assert accepted == [False] * 8 + [True, True]
    assert not odometry.has_relocated  # the last one follows the one before


def test_odometry_that_jumps_all_the_time_never_counts():
    odometry = flying()
    assert not any(odometry.accepts(at(0.525 + 0.025 * k, 7.0 + k)) for k in range(200))


def test_the_message_that_ends_a_jump_tells_so():
    odometry = flying()
    assert not odometry.accepts(at(2.0, 20.0))
    assert odometry.accepts(at(3.0, 20.0)) and odometry.has_relocated
    assert odometry.accepts(at(3.025, 20.0)) and not odometry.has_relocated


def test_a_gap_of_seconds_allows_a_distance_of_metres():
    assert flying().accepts(at(2.5, 0.25 + 9.9))
    assert not flying().accepts(at(2.5, 0.25 + 10.1))


def test_not_a_number_is_a_jump():
    assert not flying().accepts(at(0.525, math.nan))


def test_a_track_is_filtered_as_its_samples_are():
    draw = np.random.default_rng(5)
    ends = 0
    for _ in range(300):
        single, whole = OdometryFilter(), OdometryFilter()
        stamp_s, x_m = 1.0, 0.0
        for _ in range(6):
            stamps_s, rows = [], []
            for _ in range(draw.integers(0, 25)):
                stamp_s += draw.choice([0.025, 0.025, 0.025, 0.3, -0.01])
                if draw.random() < 0.03:
                    x_m += draw.choice([3.0, -3.0])
                away_m = 50.0 if draw.random() < 0.03 else 0.0
                stamps_s.append(stamp_s)
                rows.append((x_m + away_m, 0.01 * len(rows)))
            frame = "odom0" if draw.random() < 0.9 else "map"
            expected = []
            for at_s, row in zip(stamps_s, rows):
                expected.append((single.accepts(at(at_s, *row, frame)), single.has_relocated))
            accepted, relocated = whole.accepts_track(
                np.array(stamps_s), frame, np.array(rows).reshape(-1, 2)
            )
            assert list(zip(accepted.tolist(), relocated.tolist())) == expected
            assert whole.is_jumping == single.is_jumping
            ends += relocated.sum()
    assert ends > 50
