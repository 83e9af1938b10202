"""Gaps between quadcopters, and to things, that can be worked out by hand."""

import numpy as np
import pytest

from quad_nav.mission.gap_log import BLOCK_S, GapLog

RADIUS_M = 0.3


def to_wall(positions_m):
    """A wall along x = 0: the clearance of a centre is its x."""
    return positions_m[:, 0]


def logged(tracks, **options):
    """Poses in the order of their stamps, as they come."""
    log = GapLog(list(tracks), RADIUS_M, **options)
    for stamp_s, name, x_m, y_m in sorted(
        (sample[0], name, *sample[1:]) for name, track in tracks.items() for sample in track
    ):
        log.add(name, stamp_s, x_m, y_m)
    return log


def test_gaps_are_between_hulls():
    log = GapLog(["quad0", "quad1", "quad2"], RADIUS_M, to_wall)
    log.add("quad0", 0.0, 2.0, 0.0)
    log.add("quad0", 1.0, 1.0, 0.0)
    log.add("quad0", 2.0, 4.0, 0.0)
    log.add("quad1", 1.0, 4.0, 4.0)
    assert log.clearance_m("quad0") == pytest.approx(0.7)
    # 3-4-5 triangle at 1 s; at 2 s quad0 would be nearer, but quad1 has not told where it is.
    assert log.separation_m("quad0") == pytest.approx(5.0 - 0.6)
    assert log.separation_m("quad1") == pytest.approx(5.0 - 0.6)
    log.add("quad1", 2.0, 4.0, 1.0)
    assert log.separation_m("quad0") == pytest.approx(1.0 - 0.6)
    assert log.separation_m("quad2") is None


def test_between_two_poses_a_quadcopter_is_on_the_straight_line():
    log = logged({"quad0": [(0.0, 0.0, 0.0), (2.0, 4.0, 0.0)], "quad1": [(1.0, 2.0, 3.0)]})
    assert log.separation_m("quad0") == pytest.approx(3.0 - 0.6)


def test_nothing_is_guessed_before_the_first_and_after_the_last_pose():
    log = logged({"quad0": [(0.0, 0.0, 0.0), (1.0, 1.0, 0.0)], "quad1": [(1.5, 1.0, 0.1)]})
    assert log.separation_m("quad0") is None
    assert log.clearance_m("quad0") is None


def test_blocks_miss_nothing():
    """Two fly along lines 1 m apart and are side by side once, wherever a block ends."""
    stamps_s = np.arange(0.0, 3.2 * BLOCK_S, 0.25)
    for meeting_s in (0.0, BLOCK_S, BLOCK_S + 0.25, 1.7 * BLOCK_S, 3.0 * BLOCK_S):
        log = logged(
            {
                "quad0": [(t, t, 0.0) for t in stamps_s],
                "quad1": [(t + 0.125, 2 * meeting_s - (t + 0.125), 1.0) for t in stamps_s],
            }
        )
        expected = np.hypot(0.25, 1.0) if meeting_s == 0.0 else 1.0
        assert log.separation_m("quad1") == pytest.approx(expected - 0.6, abs=1e-9)


def test_a_pair_that_comes_near_last_is_found_after_others_were_nearer():
    log = logged(
        {
            "quad0": [(0.0, 0.0, 0.0), (20.0, 0.0, 0.0)],
            "quad1": [(0.0, 1.0, 0.0), (20.0, 9.0, 0.0)],
            "quad2": [(0.0, 20.0, 0.0), (20.0, 0.9, 0.0)],
        }
    )
    assert log.separation_m("quad2") == pytest.approx(0.9 - 0.6)
    assert log.separation_m("quad0") == pytest.approx(0.9 - 0.6)
    # quad1 passes quad2 on the same line: 1 + 0.4 t = 20 - 0.955 t.
    assert log.separation_m("quad1") == pytest.approx(1.0 - 0.6)
