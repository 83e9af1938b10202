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
    resample,
)
from quad_nav.peers.peer_costs import places_met
from quad_nav.peers.predicted_paths import nearest_in_time
from quad_nav.peers.right_of_way import (
    Yield,
    YieldDecision,
    approaches,
    find_conflict,
    meets,
    predict_positions,
)

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


def test_a_predicted_robot_follows_its_path_at_constant_speed_and_stays_at_the_end():
    path = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    ahead = predict_positions(np.array([0.0, 0.0]), path, 0.5, np.array([0.0, 1.0, 3.0, 9.0]))
    np.testing.assert_allclose(ahead, [[0.0, 0.0], [0.5, 0.0], [1.0, 0.5], [1.0, 1.0]])


def test_the_part_of_the_path_behind_a_robot_is_skipped():
    path = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]])
    ahead = predict_positions(np.array([2.0, 0.1]), path, 1.0, np.array([1.0]))
    assert ahead[0, 0] > 2.9


def test_a_peer_without_a_path_stays():
    ahead = predict_positions(np.array([1.0, 2.0]), np.zeros((0, 2)), 0.5, np.array([0.0, 5.0]))
    np.testing.assert_array_equal(ahead, [[1.0, 2.0], [1.0, 2.0]])


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


def test_a_resampled_path_keeps_its_ends():
    path = np.column_stack((np.linspace(0.0, 1.0, 41), np.zeros(41)))
    thin = resample(path, 0.25)
    assert len(thin) == 6
    np.testing.assert_allclose(thin[[0, -1]], path[[0, -1]])


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


def test_a_robot_waits_beside_the_path_of_a_peer_and_makes_room_on_it():
    first = peer(1.0, 0.0, priority=HIGHEST_PRIORITY, path=[(1.0, 0.0), (6.0, 0.0)])
    assert decide([(2.5, -1.2), (2.5, 3.0)], -1.0, [first]) == ("other", Yield.WAIT)
    assert decide([(2.5, -0.5), (2.5, 3.0)], -1.0, [first]) == ("other", Yield.MAKE_ROOM)


def test_a_robot_on_the_path_of_a_peer_goes_on_if_that_leaves_it_in_time():
    """The peer gets within 0.4 m of (3, 0) in 7 s; by then the robot is 2.1 m from there."""
    first = peer(0.5, 0.0, priority=HIGHEST_PRIORITY, path=[(0.5, 0.0), (6.0, 0.0)])
    assert decide([(3.0, 0.0), (3.0, 3.0)], -1.0, [first]) is None
    assert decide([(3.0, 0.0), (3.0, 0.3)], -1.0, [first]) == ("other", Yield.MAKE_ROOM)


def test_a_robot_resumes_its_goal_when_that_meets_the_peer_no_more():
    first = peer(1.0, 0.0, priority=HIGHEST_PRIORITY, path=[(1.0, 0.0), (6.0, 0.0)])
    pose = Pose2D(2.5, -0.5)
    assert not meets(pose, np.array([[2.5, -3.0]]), first, MIN_SEPARATION_M, CRUISE_MPS)
    assert meets(pose, np.array([[2.5, 3.0]]), first, MIN_SEPARATION_M, CRUISE_MPS)


def test_only_places_that_the_robot_reaches_before_the_peer_has_passed_cost_more():
    """From (3, -3) it is 3.3, 2.5 and 2.1 m to within 0.9 m; it flies 0.45, 1.95 and 3.45 m."""
    places = np.array([[0.0, 0.0], [1.5, 0.0], [3.0, 0.0]])
    met = places_met(places, np.array([0.0, 5.0, 10.0]), Pose2D(3.0, -3.0), 0.9, 0.3)
    assert met.tolist() == [[3.0, 0.0]]


@pytest.mark.parametrize(
    "decision, text",
    [
        (YieldDecision("quad1", Yield.WAIT), "waiting for quad1 (higher priority) to pass"),
        (
            YieldDecision("quad1", Yield.MAKE_ROOM, Pose2D(1.0, 2.5)),
            "making room for quad1 (higher priority) at (1.00, 2.50)",
        ),
    ],
)
def test_log_lines_of_decisions(decision, text):
    assert str(decision) == text


def test_passing_at_another_time_is_no_conflict():
    """The one has left the crossing when the other gets there: 0.9 m / 0.3 m/s = 3 s."""
    crossing = [(3.0, -2.2), (3.0, 3.0)]
    late = peer(-1.0, 0.0, priority=HIGHEST_PRIORITY, path=[(-1.0, 0.0), (6.0, 0.0)])
    assert decide([(3.0, 0.5), (3.0, 3.0)], -1.0, [late]) is None
    on_time = peer(1.0, 0.0, priority=HIGHEST_PRIORITY, path=[(1.0, 0.0), (6.0, 0.0)])
    assert decide(crossing, -1.0, [on_time]) == ("other", Yield.WAIT)


def test_following_a_peer_is_no_conflict():
    ahead = peer(1.5, 0.0, 0.3, priority=HIGHEST_PRIORITY, path=[(1.5, 0.0), (6.0, 0.0)])
    assert decide(EAST, -1.0, [ahead]) is None


def test_no_robot_yields_to_a_parked_peer():
    assert decide(EAST, idle_priority(1), [peer(1.0, 0.0)]) is None


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


def test_a_track_that_leads_away_does_not_approach():
    place = np.array([0.0, 0.0])
    away = np.column_stack((np.linspace(0.5, 3.0, 11), np.zeros(11)))
    assert not approaches(place, away, MIN_SEPARATION_M)
    assert approaches(place, away[::-1], MIN_SEPARATION_M)


def test_positions_on_the_path_of_a_peer():
    """From (1, 1) it goes on to the point after the nearest one, then along the path to its end."""
    path = np.array([(0.0, 0.0), (1.0, 0.0), (4.0, 5.0), (4.0, 7.0)])
    ahead = predict_positions(
        np.array([1.0, 1.0]), path, 0.5, np.array([0.0, 5.0, 10.0, 12.0, 99.0])
    )
    np.testing.assert_allclose(ahead, [(1.0, 1.0), (2.5, 3.0), (4.0, 5.0), (4.0, 6.0), (4.0, 7.0)])
    stays = predict_positions(np.array([1.0, 1.0]), np.empty((0, 2)), 0.5, np.array([0.0, 9.0]))
    assert stays.tolist() == [[1.0, 1.0], [1.0, 1.0]]


def test_nearest_distance_in_time_is_that_of_all_pairs():
    rng = np.random.default_rng(5)
    for _ in range(20):
        one, other = rng.normal(size=(2, 29, 2))
        distances = np.hypot(*np.moveaxis(one[:, None] - other[None], 2, 0))
        apart = np.abs(np.subtract.outer(np.arange(29), np.arange(29)))
        for steps in (0, 6, 29):
            assert nearest_in_time(one, other, steps) == distances[apart <= steps].min()
