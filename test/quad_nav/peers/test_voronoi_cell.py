"""Voronoi cells: commands are limited so that no two robots collide."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.peers.peer import (
    IDLE_PRIORITY,
    Intention,
    Peer,
)
from quad_nav.peers.voronoi_cell import COASTING_S, limit_to_cell, limited_velocities

SAFETY_RADIUS_M = 0.4
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


def test_peers_out_of_reach_make_no_difference():
    rng = np.random.default_rng(2)
    limited = 0
    for _ in range(300):
        near = [peer(*rng.normal(0.0, 1.2, 2), name=str(k)) for k in range(3)]
        far = [peer(*(rng.normal(0.0, 0.1, 2) + 3.0), name="far")]
        command = Twist2D(rng.normal(0.0, 0.4), 0.0, rng.normal())
        arguments = (Pose2D(0.0, 0.0, rng.normal()), Twist2D(0.2), command)
        alone = limit_to_cell(*arguments, near, SAFETY_RADIUS_M, 0.25)
        assert limit_to_cell(*arguments, far + near, SAFETY_RADIUS_M, 0.25) == alone
        assert limit_to_cell(*arguments, far, SAFETY_RADIUS_M, 0.25).command == command
        limited += bool(alone.limited_by)
    assert 30 < limited < 270


def test_many_velocities_are_limited_as_single_commands():
    """The bisector is 0.55 m away; without the radius of 0.5 m, 0.05 m are left for 0.25 s."""
    ahead = Peer("ahead", 1.1, 0.0, -0.2, 0.0, 0.0)
    velocities = np.array([[0.4, 0.4], [0.1, 0.0], [-0.4, 0.4], [1.3, 0.0], [1.4, 0.0]])
    here = Pose2D(0.0, 0.0)
    limited = limited_velocities(velocities, here, Twist2D(), [ahead], 0.5, 0.25)
    expected = [[0.2, 0.2], [0.1, 0.0], [-0.4, 0.4], [0.2, 0.0], [0.0, 0.0]]
    np.testing.assert_allclose(limited, expected)
    one = limit_to_cell(here, Twist2D(), Twist2D(0.4, 0.4), [ahead], 0.5, 0.25).command
    np.testing.assert_allclose([one.vx_mps, one.vy_mps], limited[0])
