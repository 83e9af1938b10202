"""Voronoi cells: commands are limited so that no two robots collide."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.peers.peer import Peer
from quad_nav.peers.voronoi_cell import COASTING_S, Cell

SAFETY_RADIUS_M = 0.4
STANDING = Twist2D()


def peer(x_m, y_m, vx_mps=0.0, vy_mps=0.0, name="other"):
    return Peer(name, x_m, y_m, vx_mps, vy_mps, 0.0)


def cell(*peers, at=(0.0, 0.0, 0.0), velocity=STANDING, hold_s=1.0):
    return Cell(Pose2D(*at), velocity, peers, SAFETY_RADIUS_M, hold_s)


def test_a_command_ends_at_the_border_of_the_cell():
    # 1.2 m apart: 0.6 m to the middle, less 0.4 m, leaves 0.2 m of the 0.4 m in 1 s.
    assert cell(peer(1.2, 0.0)).limit(Twist2D(0.4)) == (Twist2D(pytest.approx(0.2)), "other")


def test_the_coasting_distance_counts():
    coasting = cell(peer(1.2, 0.0), velocity=Twist2D(0.1 / COASTING_S))  # carries 0.1 m of the 0.2
    assert coasting.limit(Twist2D(0.4))[0] == Twist2D(pytest.approx(0.1))


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
    assert cell(peer(*other), at=(0.0, 0.0, yaw_rad)).limit(command) == (command, "")


@pytest.mark.parametrize(
    "yaw_rad, vx_mps, turn_radps",
    [
        (0.0, 0.4, -0.4),  # head-on: to the right
        (0.8, 0.4, 0.4),
        (-0.8, 0.4, -0.4),  # the peer is to the right, to the left
        (math.pi + 0.8, -0.4, 0.4),  # it backs, with the peer to the right of its course
    ],
)
def test_too_near_and_straight_a_robot_turns_away(yaw_rad, vx_mps, turn_radps):
    command, _ = cell(peer(0.7, 0.0), at=(0.0, 0.0, yaw_rad)).limit(Twist2D(vx_mps))
    assert command == Twist2D(0.0, 0.0, turn_radps)


@pytest.mark.parametrize("stagger, lost_m", [(0, 0.0), (5, 0.025)])
def test_point_masses_inside_their_cells_never_collide(stagger, lost_m):
    """Four that all want to the middle, each commanded once a second.

    Commanded at different times they see each other's cells turn, and lose up to
    ``lost_m`` of the 0.4 m: that is for the margin.
    """
    at = np.array([[2.0, 0.0], [-2.0, 0.1], [0.0, 2.0], [0.1, -2.0]])
    at += np.random.default_rng(0).normal(0, 0.1, (4, 2))
    velocity = np.zeros((4, 2))
    for step in range(400):
        seen = [peer(*at[k], *velocity[k]) for k in range(4)]
        for k in range(4):
            if step % 20 == stagger * k:
                yaw = math.atan2(-at[k, 1], -at[k, 0])
                others = seen[:k] + seen[k + 1 :]
                command, _ = cell(*others, at=(*at[k], yaw)).limit(Twist2D(0.5))
                velocity[k] = command.vx_mps * np.array([math.cos(yaw), math.sin(yaw)])
        at += 0.05 * velocity
        gaps = [np.hypot(*(at[i] - at[j])) for i in range(4) for j in range(i)]
        assert min(gaps) >= 2 * (SAFETY_RADIUS_M - lost_m) - 1e-6
    assert min(gaps) < 1.0  # they did come as near as they may


def test_peers_out_of_reach_make_no_difference():
    rng = np.random.default_rng(2)
    limited = 0
    for _ in range(300):
        near = [peer(*rng.normal(0.0, 1.2, 2), name=str(k)) for k in range(3)]
        far = peer(*(rng.normal(0.0, 0.1, 2) + 3.0), name="far")
        command = Twist2D(rng.normal(0.0, 0.4), 0.0, rng.normal())
        here = {"at": (0.0, 0.0, rng.normal()), "velocity": Twist2D(0.2), "hold_s": 0.25}
        alone = cell(*near, **here).limit(command)
        assert cell(far, *near, **here).limit(command) == alone
        assert cell(far, **here).limit(command)[0] == command
        limited += bool(alone[1])
    assert 30 < limited < 270


def test_many_velocities_are_limited_as_single_commands():
    """The bisector is 0.45 m away; without the radius of 0.4 m, 0.05 m are left for 0.25 s."""
    ahead = cell(peer(0.9, 0.0, -0.2), hold_s=0.25)
    limited = ahead.limit_velocities(
        np.array([[0.4, 0.4], [0.1, 0.0], [-0.4, 0.4], [1.3, 0.0], [1.4, 0.0]])
    )
    expected = [[0.2, 0.2], [0.1, 0.0], [-0.4, 0.4], [0.2, 0.0], [0.0, 0.0]]
    np.testing.assert_allclose(limited, expected)
    command, _ = ahead.limit(Twist2D(0.4, 0.4))
    np.testing.assert_allclose([command.vx_mps, command.vy_mps], limited[0])
