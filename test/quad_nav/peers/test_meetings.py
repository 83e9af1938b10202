"""Where the straight ways of robots meet; all fly at 0.5 m/s, and meet within 1 m."""

from __future__ import annotations

import numpy as np
import pytest

from quad_nav.peers.roundabout import find_meetings

START, GOAL = np.array([0.0, 0.0]), np.array([8.0, 0.0])


def meetings(*ways):
    """Return the numbers of the peers that are met, and where; a way is (x, y, x, y)."""
    ends = np.array(ways, float).reshape(-1, 4)
    met, places = find_meetings(START, GOAL, ends[:, :2], ends[:, 2:], 0.5, 1.0)
    return met.tolist(), places.tolist()


def test_robots_meet_half_way():
    head_on, from_the_right, from_the_left = (8, 0, 0, 0), (4, -4, 4, 4), (4, 4, 4, -4)
    met, places = meetings(head_on, from_the_right, from_the_left)
    assert met == [0, 1, 2]
    np.testing.assert_allclose(places, [(4.0, 0.0)] * 3)


def test_ways_that_cross_at_other_times_do_not_meet():
    """At 12 s the robot is at (6, 0) and the peer at (4, -2), 2.8 m away, their least distance."""
    assert meetings((4, -8, 4, 8)) == ([], [])


@pytest.mark.parametrize(
    "way",
    [
        pytest.param((0, 0.8, 8, 0.8), id="beside"),
        pytest.param((-0.9, 0, 8, 0), id="behind"),
        pytest.param((0, 0.8, 0, 8), id="parting"),
    ],
)
def test_robots_that_come_no_nearer_do_not_meet(way):
    assert meetings(way)[0] == []
