"""Voronoi cells, predictions, priorities and holding points, with numbers computed by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.costmap.cost_grid import NOWHERE, CostGrid
from quad_nav.costmap.peer_layer import PeerArea, PeerLayer
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import FREE, LETHAL, UNKNOWN, GridSpec
from quad_nav.kernels.peers import nearest_cell, raise_discs
from quad_nav.peers.holding_point import COMFORTABLE, find_holding_point, is_reachable
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
from quad_nav.peers.right_of_way import (
    Yield,
    YieldDecision,
    approaches,
    find_conflict,
    predict_positions,
)
from quad_nav.peers.voronoi_cell import COASTING_S, limit_to_cell

SAFETY_RADIUS_M = 0.4
MIN_SEPARATION_M = 0.9
CRUISE_MPS = 0.3
STANDING = Twist2D()


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


# -- Voronoi cells ----------------------------------------------------------------------


def test_a_command_ends_at_the_border_of_the_cell():
    # 1.2 m apart: 0.6 m to the middle, less 0.4 m, leaves 0.2 m of the 0.4 m in 1 s.
    limited = limit_to_cell(
        Pose2D(0.0, 0.0), STANDING, Twist2D(0.4), [peer(1.2, 0.0)], SAFETY_RADIUS_M, 1.0
    )
    assert limited.limited_by == "other"
    assert limited.command.vx_mps == pytest.approx(0.2)


def test_the_coasting_distance_counts():
    speed = Twist2D(0.1 / COASTING_S)  # carries 0.1 m
    limited = limit_to_cell(
        Pose2D(0.0, 0.0), speed, Twist2D(0.4), [peer(1.2, 0.0)], SAFETY_RADIUS_M, 1.0
    )
    assert limited.command.vx_mps == pytest.approx(0.1)


@pytest.mark.parametrize(
    "yaw_rad, other",
    [
        (math.pi, (1.2, 0.0)),  # away from it
        (math.pi / 2, (1.2, 0.0)),  # past it
        (0.0, (1.6, 0.0)),  # towards it, but no farther than the own half
    ],
)
def test_a_command_inside_the_cell_is_not_limited(yaw_rad, other):
    command = Twist2D(0.4)
    limited = limit_to_cell(
        Pose2D(0.0, 0.0, yaw_rad), STANDING, command, [peer(*other)], SAFETY_RADIUS_M, 1.0
    )
    assert limited.command == command and limited.limited_by == ""


def test_the_path_stays_the_same_when_it_is_flown_more_slowly():
    command = Twist2D(0.4, 0.0, 0.5)
    limited = limit_to_cell(
        Pose2D(0.0, 0.0), STANDING, command, [peer(1.2, 0.0)], SAFETY_RADIUS_M, 1.0
    )
    assert 0.0 < limited.command.vx_mps < 0.4
    assert limited.command.vyaw_radps / limited.command.vx_mps == pytest.approx(0.5 / 0.4)


def test_too_near_a_robot_turns_in_place():
    limited = limit_to_cell(
        Pose2D(0.0, 0.0), STANDING, Twist2D(0.4, 0.0, 0.5), [peer(0.7, 0.0)], SAFETY_RADIUS_M, 1.0
    )
    assert limited.command == Twist2D(0.0, 0.0, 0.5)


@pytest.mark.parametrize(
    "yaw_rad, vx_mps, turn_radps",
    [
        (0.0, 0.4, -0.4),  # head-on: to the right
        (0.8, 0.4, 0.4),
        (-0.8, 0.4, -0.4),  # the peer is to the right, to the left
        (math.pi + 0.8, -0.4, 0.4),
    ],
)  # it backs, with the peer to the right of its course
def test_too_near_and_straight_a_robot_turns_away(yaw_rad, vx_mps, turn_radps):
    limited = limit_to_cell(
        Pose2D(0.0, 0.0, yaw_rad), STANDING, Twist2D(vx_mps), [peer(0.7, 0.0)], SAFETY_RADIUS_M, 1.0
    )
    assert limited.command == Twist2D(0.0, 0.0, turn_radps)


def test_the_nearest_of_several_peers_decides():
    peers = [
        peer(2.0, 0.0, name="far"),
        peer(1.2, 0.0, name="near"),
        peer(-0.9, 0.0, name="behind"),
    ]
    limited = limit_to_cell(Pose2D(0.0, 0.0), STANDING, Twist2D(0.4), peers, SAFETY_RADIUS_M, 1.0)
    assert limited.limited_by == "near"


@pytest.mark.parametrize("stagger, lost_m", [(0, 0.0), (5, 0.025)])
@pytest.mark.parametrize("seed", range(3))
def test_point_masses_inside_their_cells_never_collide(seed, stagger, lost_m):
    """Four that all want to the middle, each commanded once a second.

    Commanded at different times they see each other's cells turn, and lose up to
    ``lost_m`` of the 0.4 m: that is for the margin.
    """
    random = np.random.default_rng(seed)
    at = np.array([[2.0, 0.0], [-2.0, 0.1], [0.0, 2.0], [0.1, -2.0]])
    at += random.normal(0, 0.1, (4, 2))
    velocity = np.zeros((4, 2))
    for step in range(400):
        seen = [peer(*at[k], *velocity[k]) for k in range(4)]
        for k in range(4):
            if step % 20 == stagger * k:
                yaw = math.atan2(-at[k, 1], -at[k, 0])
                command = limit_to_cell(
                    Pose2D(*at[k], yaw),
                    STANDING,
                    Twist2D(0.5),
                    seen[:k] + seen[k + 1 :],
                    SAFETY_RADIUS_M,
                    1.0,
                ).command
                velocity[k] = command.vx_mps * np.array([math.cos(yaw), math.sin(yaw)])
        at += 0.05 * velocity
        gaps = [np.hypot(*(at[i] - at[j])) for i in range(4) for j in range(i)]
        assert min(gaps) >= 2 * (SAFETY_RADIUS_M - lost_m) - 1e-6
    assert min(gaps) < 1.0  # they did come as near as they may


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
    assert intention.priority == HIGHEST_PRIORITY == 0.0
    np.testing.assert_allclose(intention.path, [[1.0, 0.0], [2.0, 0.0]])


def test_a_resampled_path_keeps_its_ends():
    path = np.column_stack((np.linspace(0.0, 1.0, 41), np.zeros(41)))
    thin = resample(path, 0.25)
    assert len(thin) == 6
    np.testing.assert_allclose(thin[[0, -1]], path[[0, -1]])


# -- right of path -----------------------------------------------------------------------

EAST, WEST = [(0.0, 0.0), (6.0, 0.0)], [(6.0, 0.0), (0.0, 0.0)]
NORTH = [(3.0, -3.0), (3.0, 3.0)]


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


# -- discs, holding points, the layer ----------------------------------------------------------

SPEC = GridSpec(40, 40, 0.1)


def test_a_disc_is_as_wide_as_it_should_be():
    cells = np.zeros((9, 9), dtype=np.uint8)
    raise_discs(cells, 0.0, 0.0, 1.0, np.array([[4.5, 4.5]]), 2.0, 7)
    assert [int((row > 0).sum()) for row in cells] == [0, 0, 1, 3, 5, 3, 1, 0, 0]


def test_a_disc_leaves_what_is_higher_and_what_is_off_the_grid():
    cells = np.full((4, 4), 9, dtype=np.uint8)
    cells[0, 0] = 1
    raise_discs(cells, 0.0, 0.0, 1.0, np.array([[-0.5, -0.5]]), 2.0, 7)
    assert cells[0, 0] == 7 and (cells.ravel()[1:] == 9).all()


def test_the_nearest_cell_is_found_round_a_wall():
    blocked = np.zeros((5, 5), dtype=np.uint8)
    blocked[0:4, 2] = 1
    unwanted = np.zeros((5, 5), dtype=np.uint8)
    unwanted[:, :3] = 1
    assert tuple(nearest_cell(blocked, unwanted, 0, 0)) == (3, 4)
    blocked[4, 2] = 1
    assert tuple(nearest_cell(blocked, unwanted, 0, 0)) == (-1, -1)


def test_a_holding_point_is_beside_the_path():
    costs = np.zeros(SPEC.shape, dtype=np.uint8)
    path = np.array([[0.5, 2.0], [3.5, 2.0]])
    holding_point = find_holding_point(
        SPEC, costs, Pose2D(2.5, 2.2), [path], np.array([[0.5, 2.0]]), MIN_SEPARATION_M
    )
    assert holding_point is not None
    assert holding_point.x_m == pytest.approx(2.5, abs=0.11)
    assert holding_point.y_m == pytest.approx(2.0 + MIN_SEPARATION_M, abs=0.11)


def test_in_a_corridor_the_holding_point_is_beyond_its_end():
    costs = np.full(SPEC.shape, LETHAL, dtype=np.uint8)
    costs[19:22, :] = FREE  # the corridor along x ...
    costs[:, 34:38] = FREE  # ... opens into a cross-path
    path = np.array([[0.5, 2.05], [3.8, 2.05]])
    holding_point = find_holding_point(
        SPEC, costs, Pose2D(2.0, 2.05), [path], np.array([[0.5, 2.05]]), MIN_SEPARATION_M
    )
    assert (
        holding_point is not None
        and holding_point.x_m > 3.3
        and abs(holding_point.y_m - 2.05) > MIN_SEPARATION_M - 0.1
    )


def test_a_holding_point_has_room_to_turn():
    """Costs beside the wall at the top are high: the holding_point is on the other side."""
    costs = np.zeros(SPEC.shape, dtype=np.uint8)
    costs[28:, :] = COMFORTABLE
    path = np.array([[0.5, 2.0], [3.5, 2.0]])
    holding_point = find_holding_point(
        SPEC, costs, Pose2D(2.5, 2.2), [path], np.array([[0.5, 2.0]]), MIN_SEPARATION_M
    )
    assert holding_point is not None and holding_point.y_m == pytest.approx(
        2.0 - MIN_SEPARATION_M, abs=0.11
    )


@pytest.mark.parametrize(
    "gap, other, reached",
    [(True, (0.5, 0.5), True), (False, (0.5, 0.5), False), (True, (2.05, 3.0), False)],
)
def test_reachability_of_a_holding_point(gap, other, reached):
    """Through the only gap of a wall, unless a peer is in it."""
    costs = np.zeros(SPEC.shape, dtype=np.uint8)
    costs[:, 20] = LETHAL
    if gap:
        costs[25:35, 20] = FREE
    assert (
        is_reachable(
            SPEC, costs, Pose2D(1.0, 1.0), Pose2D(3.0, 1.0), np.array([other]), MIN_SEPARATION_M
        )
        is reached
    )


def test_without_room_there_is_no_holding_point():
    costs = np.full(SPEC.shape, LETHAL, dtype=np.uint8)
    costs[20, :] = FREE
    path = np.array([[0.5, 2.05], [4.0, 2.05]])
    assert (
        find_holding_point(
            SPEC, costs, Pose2D(2.0, 2.05), [path], np.array([[0.5, 2.05]]), MIN_SEPARATION_M
        )
        is None
    )


def test_the_layer_forgets_where_a_peer_was():
    layer, master = PeerLayer(), CostGrid(SPEC)
    for points in ([[1.05, 1.05]], [[3.05, 3.05]]):
        layer.set_areas([PeerArea(np.array(points), 0.2, 120)])
        bounds = layer.update_bounds(Pose2D(2.0, 2.0), 0.0, NOWHERE)
        window = master.window_of(bounds)
        master.reset(window)
        layer.update_costs(master, window)
    assert master.costs[30, 30] == 120
    assert master.costs[10, 10] == FREE


def test_the_layer_without_peers_changes_nothing():
    layer, master = PeerLayer(), CostGrid(SPEC, UNKNOWN)
    assert layer.update_bounds(Pose2D(2.0, 2.0), 0.0, NOWHERE) == NOWHERE
    layer.update_costs(master, master.window_of(NOWHERE.grown(1e31)))
    assert (master.costs == UNKNOWN).all()


def test_positions_on_the_path_of_a_peer():
    """From (1, 1) it goes on to the point after the nearest one, then along the path to its end."""
    path = np.array([(0.0, 0.0), (1.0, 0.0), (4.0, 5.0), (4.0, 7.0)])
    ahead = predict_positions(
        np.array([1.0, 1.0]), path, 0.5, np.array([0.0, 5.0, 10.0, 12.0, 99.0])
    )
    np.testing.assert_allclose(ahead, [(1.0, 1.0), (2.5, 3.0), (4.0, 5.0), (4.0, 6.0), (4.0, 7.0)])
    stays = predict_positions(np.array([1.0, 1.0]), np.empty((0, 2)), 0.5, np.array([0.0, 9.0]))
    assert stays.tolist() == [[1.0, 1.0], [1.0, 1.0]]
