"""Voronoi cells, predictions, priorities and holding points, with numbers computed by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.peers.peer import (
    HIGHEST_PRIORITY,
    IDLE_PRIORITY,
    Intention,
    Peer,
    assumed_intention,
    idle_priority,
    peer_at,
    priority_of,
)
from quad_nav.peers.right_of_way import Yield, find_conflict, places_reached

MIN_SEPARATION_M = 0.9
CRUISE_MPS = 0.3


def peer(x_m, y_m, vx_mps=0.0, vy_mps=0.0, priority=IDLE_PRIORITY, path=(), name="other"):
    return Peer(
        name,
        x_m,
        y_m,
        vx_mps,
        vy_mps,
        0.0,
        Intention(priority, np.array(path, dtype=np.float64).reshape(-1, 2)),
    )


# -- predicted positions ----------------------------------------------------------------


def test_velocities_are_rotated_into_the_map_and_extrapolated():
    seen = peer_at("a", Pose2D(1.0, 1.0, math.pi / 2), Twist2D(0.4), 10.0)
    assert (seen.vx_mps, seen.vy_mps) == pytest.approx((0.0, 0.4))
    later = seen.extrapolated(10.5)
    assert (later.x_m, later.y_m) == pytest.approx((1.0, 1.2))


def test_a_peer_without_an_intention_is_expected_straight_on_and_goes_first():
    assert assumed_intention(peer(0.0, 0.0, 0.01)).priority == IDLE_PRIORITY
    intention = assumed_intention(peer(1.0, 0.0, 0.2))
    assert intention.priority == HIGHEST_PRIORITY == 1.0
    np.testing.assert_allclose(intention.path, [[1.0, 0.0], [2.0, 0.0]])


# -- right of way -----------------------------------------------------------------------

EAST, WEST = [(0.0, 0.0), (6.0, 0.0)], [(6.0, 0.0), (0.0, 0.0)]


def decide(path, priority, others):
    found = find_conflict(
        np.array(path[0]), np.array(path), priority, others, MIN_SEPARATION_M, CRUISE_MPS
    )
    return None if found is None else (found[0].name, found[1])


@pytest.mark.parametrize(
    "one, other",
    [
        (EAST[:1] + [(3.0, 0.0)], [(3.5, 0.0), (0.0, 0.0)]),
        ([(1.0, 0.0), (6.0, 0.0)], [(3.0, -2.0), (3.0, 3.0)]),
    ],
)
def test_of_two_robots_exactly_one_yields(one, other):
    first, second = priority_of(0.0, 0), priority_of(0.0, 1)
    outcomes = [
        decide(one, first, [peer(*other[0], priority=second, path=other)]),
        decide(other, second, [peer(*one[0], priority=first, path=one)]),
    ]
    assert outcomes[0] is None and outcomes[1] is not None
    swapped = [
        decide(one, second, [peer(*other[0], priority=first, path=other)]),
        decide(other, first, [peer(*one[0], priority=second, path=one)]),
    ]
    assert swapped[0] is not None and swapped[1] is None


def test_the_older_goal_goes_first_and_then_the_lower_number():
    assert priority_of(10.0, 7) > priority_of(11.0, 0) > priority_of(11.0, 1) > idle_priority(0)


def test_no_robot_yields_to_a_parked_peer():
    assert decide(EAST, idle_priority(1), [peer(1.0, 0.0)]) is None


def test_a_robot_waits_beside_the_path_of_a_peer_and_makes_room_on_it():
    first = peer(1.0, 0.0, priority=HIGHEST_PRIORITY, path=[(1.0, 0.0), (6.0, 0.0)])
    assert decide([(2.5, -1.2), (2.5, 3.0)], -1.0, [first]) == ("other", Yield.WAIT)
    assert decide([(2.5, -0.5), (2.5, 3.0)], -1.0, [first]) == ("other", Yield.MAKE_ROOM)


def test_a_robot_on_the_path_of_a_peer_goes_on_if_that_leaves_it_in_time():
    """The peer gets within 0.4 m of (3, 0) in 7 s; by then the robot is 2.1 m from there."""
    first = peer(0.5, 0.0, priority=HIGHEST_PRIORITY, path=[(0.5, 0.0), (6.0, 0.0)])
    assert decide([(3.0, 0.0), (3.0, 3.0)], -1.0, [first]) is None
    assert decide([(3.0, 0.0), (3.0, 0.3)], -1.0, [first]) == ("other", Yield.MAKE_ROOM)


def test_only_places_that_the_robot_reaches_before_the_peer_has_passed_cost_more():
    """From (3, -3) it is 3.3, 2.5 and 2.1 m to within 0.9 m; it flies 0.45, 1.95 and 3.45 m."""
    places = np.array([[0.0, 0.0], [1.5, 0.0], [3.0, 0.0]])
    met = places_reached(places, np.array([0.0, 5.0, 10.0]), (3.0, -3.0), 0.9, 0.3, 1.5)
    assert met.tolist() == [[3.0, 0.0]]


def test_a_robot_does_not_wait_for_a_stationary_peer_but_makes_room_on_its_path():
    standing = peer(1.0, 0.0, priority=HIGHEST_PRIORITY, path=[(1.0, 0.0), (6.0, 0.0)])
    for at, action in ([(2.5, -1.2), None], [(2.5, -0.5), Yield.MAKE_ROOM], [(3.0, 0.0), None]):
        found = find_conflict(
            np.array(at),
            np.array([at, (2.5, 3.0)]),
            -1.0,
            [standing],
            MIN_SEPARATION_M,
            CRUISE_MPS,
            {"other"},
        )
        assert (found and found[1]) == action
