"""Roundabouts where four robots meet at (5, 5), at 8 s, on a map of 10 m x 10 m.

The safety radius is 0.35 m, as the margin is 0, and the speed 0.3 m/s. So robots are
2 * (0.35 m + 0.3 m/s * 0.6 s) = 1.06 m apart on a circle, and that of four has a radius of 0.675 m.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from quad_nav.config import load, updated
from quad_nav.geometry import Pose2D
from quad_nav.grid import LETHAL
from quad_nav.peers.peer import HIGHEST_PRIORITY, Intention, Peer
from quad_nav.peers.roundabout import Roundabout
from quad_nav.scenario.assembly import apply_configuration, build_navigator

SHAPE = {"robot_radius": 0.35, "footprint_padding": 0.0}
TREE = {
    "global_costmap": {"width": 10.0, "height": 10.0, "resolution": 0.1, **SHAPE},
    "local_costmap": {"width": 3.0, "height": 3.0, "rolling_window": True, **SHAPE},
}
START, GOAL = Pose2D(2.6, 5.0), Pose2D(8.0, 5.0)
TIMEOUT_S = 0.5
RADIUS_M = 4 * 1.06 / (2 * math.pi)


def peer(name: str, start, goal, priority: float = -1.0) -> Peer:
    return Peer(name, *start, 0.0, 0.0, 0.0, Intention(priority, np.array([start, goal])))


EAST = peer("quad1", (7.4, 5.0), (2.0, 5.0))
SOUTH = peer("quad2", (5.0, 2.6), (5.0, 8.0))
NORTH = peer("quad3", (5.0, 7.4), (5.0, 2.0))
ALL = [EAST, SOUTH, NORTH]


@pytest.fixture
def navigator():
    return build_navigator(load({**TREE, "robot": 0}))


@pytest.fixture
def roundabout(navigator) -> Roundabout:
    """The roundabout of a robot that flies east."""
    roundabout = navigator.peers._roundabout
    roundabout.start(GOAL)
    return roundabout


def update(roundabout, peers, pose=START, now_s=0.0):
    """Update when it is due: the call before asks for peers that are far away."""
    assert roundabout.update(now_s, pose, [], TIMEOUT_S) == []
    assert roundabout.reach_m == 18.0
    messages = roundabout.update(
        now_s, pose, [replace(one, stamp_s=now_s) for one in peers], TIMEOUT_S
    )
    assert roundabout.reach_m == 0.0
    return messages


def test_four_that_meet_keep_right_of_a_circle_with_room_for_all(roundabout):
    assert update(roundabout, ALL) == ["keeping right of (5.00, 5.00) by 0.67 m, as do 3 peers"]
    np.testing.assert_allclose(roundabout.centre, (5.0, 5.0))
    assert roundabout.radius_m == pytest.approx(RADIUS_M)
    assert roundabout.members == {"quad1", "quad2", "quad3"}
    expected = [(5.0, 5.0 + k * RADIUS_M) for k in range(4)]  # its left is north
    np.testing.assert_allclose(roundabout.barrier(START), expected, atol=1e-12)


@pytest.mark.parametrize(
    "third",
    [
        pytest.param(peer("quad3", (5.0, 7.4), (5.0, 2.0), HIGHEST_PRIORITY), id="no intention"),
        pytest.param(NORTH.with_intention(Intention()), id="parked"),
    ],
)
def test_who_sends_no_intention_or_is_parked_does_not_keep_right(roundabout, third):
    update(roundabout, [EAST, SOUTH, third])
    assert roundabout.centre is None


def test_who_is_silent_does_not_keep_right(roundabout):
    for _ in range(2):
        assert roundabout.update(1.0, START, ALL, TIMEOUT_S) == []  # as of 0 s
    assert roundabout.centre is None


@pytest.mark.filterwarnings("error")
def test_who_may_not_move_meets_nobody(roundabout):
    roundabout._tracker.cruise_mps = 0.0
    for _ in range(2):
        assert roundabout.update(0.0, START, ALL, TIMEOUT_S) == []
    assert roundabout.centre is None


@pytest.mark.parametrize("y_m, leaves", [(4.4, False), (4.2, True)])
def test_it_ends_where_the_way_to_the_goal_is_clear_of_the_circle(roundabout, y_m, leaves):
    """From (5, y) to (8, 5) the circle's centre is 0.588 m or 0.773 m to the left of 0.641 m."""
    update(roundabout, ALL)
    update(roundabout, [], Pose2D(5.0, y_m), now_s=1.0)
    assert (roundabout.centre is None) == leaves
    assert len(roundabout.members) == 3  # until there is another goal
    roundabout.start(GOAL)
    assert roundabout.members == frozenset()


def test_who_makes_no_progress_for_6_s_yields_again(roundabout):
    update(roundabout, ALL)
    update(roundabout, ALL, now_s=6.0)
    assert roundabout.centre is not None
    assert roundabout.update(7.0, START, ALL, TIMEOUT_S) == []
    assert roundabout.update(7.1, START, ALL, TIMEOUT_S) == [
        "no progress in the roundabout for 6 s, yielding to peers again"
    ]
    assert roundabout.centre is None and roundabout.members == frozenset()
    assert roundabout.update(8.0, START, ALL, TIMEOUT_S) == [] and roundabout.reach_m == 0.0


def test_members_do_not_yield_and_their_paths_cost_nothing(navigator):
    """Without roundabouts, this robot yields to all of them."""
    coordinator = navigator.peers
    coordinator.start_goal(GOAL, 0.0)
    first = [p.with_intention(Intention(0.5, p.intention.path)) for p in ALL]
    in_frame = Pose2D(0.0, 0.0)
    for _ in range(2):
        coordinator.observe(0.0, START, in_frame, first, 0.3)
    assert coordinator.decide(0.0, START, GOAL).messages == ()
    obstacles = coordinator._costs._obstacles(np.zeros((3, 2)), START, in_frame)
    assert [area.points.tolist() for area in obstacles] == [[[5.0, 5.0]]]
    assert obstacles[0].radius_m == pytest.approx(coordinator._roundabout.radius_m - 0.35 - 0.1)
    areas = coordinator._costs._areas(np.array([(p.x_m, p.y_m) for p in first]), START, -1.0)
    assert [(len(area.points), area.cost) for area in areas] == [(4, 100)]

    off = updated(load({**TREE, "robot": 0}), "peers", {"roundabouts": False})
    apply_configuration(navigator, off)
    coordinator.observe(0.1, START, in_frame, [p.extrapolated(0.1) for p in first], 0.3)
    assert coordinator.decide(0.1, START, GOAL).messages != ()
    assert len(coordinator._costs._areas(np.zeros((3, 2)), START, -1.0)) == 3


@pytest.mark.parametrize(
    "x_m, y_m, is_free",
    [
        pytest.param(5.0, 5.0, True, id="in the middle"),
        pytest.param(5.0 + RADIUS_M, 5.0, False, id="on the circle"),
    ],
)
def test_a_circle_has_to_be_free(navigator, roundabout, x_m, y_m, is_free):
    navigator.global_costmap.costs[int(10 * y_m), int(10 * x_m)] = LETHAL
    update(roundabout, ALL)
    assert (roundabout.centre is not None) == is_free


def test_a_circle_has_to_be_on_the_map(roundabout):
    """They meet at (5, 0.5)."""
    roundabout.start(Pose2D(8.0, 0.5))
    peers = [
        peer("quad1", (7.4, 0.5), (2.0, 0.5)),
        peer("quad2", (5.0, -1.9), (5.0, 4.0)),
        peer("quad3", (5.0, 2.9), (5.0, -2.0)),
    ]
    update(roundabout, peers, Pose2D(2.6, 0.5))
    assert roundabout.centre is None
