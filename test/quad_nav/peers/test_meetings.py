"""Where the straight ways of robots meet; all fly at 0.5 m/s, and meet within 1 m."""

from __future__ import annotations

import numpy as np
import pytest

from quad_nav.peers.meetings import find_meetings, reach_m

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


def test_a_peer_that_arrives_before_stays_where_nobody_counts_it():
    """It reaches (2, 2) after 2 s, when the robot is at (1, 0), 2.2 m away."""
    assert meetings((2, 3, 2, 2))[0] == []


def test_of_two_places_the_one_with_more_peers_counts():
    met, places = meetings(
        (2, -2, 2, 2), (6, -6, 6, 6), (2, 2, 2, -2), (6, 6, 6, -6), (12, 0, 0, 0)
    )
    assert met == [1, 3, 4]
    np.testing.assert_allclose(places, [(6.0, 0.0)] * 3)
    met, _ = meetings((2, -2, 2, 2), (6, -6, 6, 6), (2, 2, 2, -2))
    assert met == [0, 2]


def test_meetings_later_than_half_a_minute_do_not_count():
    far = 40.0  # two that fly towards each other at 0.5 m/s meet after 40 s
    met, _ = find_meetings(
        START, np.array([far, 0.0]), np.array([[far, 0.0]]), np.array([[0.0, 0.0]]), 0.5, 1.0
    )
    assert met.tolist() == []
    assert reach_m(0.5) == 30.0
