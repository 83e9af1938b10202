"""Neighbours: what peers leave of the commands of a robot that evades."""

from __future__ import annotations

import math

import numpy as np

from quad_nav.control.evasion import evade
from quad_nav.control.neighbours import NO_NEIGHBOURS
from quad_nav.control.surroundings import EvasionParams, Surroundings
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import GridSpec
from quad_nav.peers.peer import Peer
from quad_nav.peers.voronoi_cell import limit_to_cell, neighbours_of
from quad_nav.tracking.tracks import Tracks

HERE = Pose2D(0.0, 0.0)
AHEAD = Peer("quad1", 1.1, 0.0, -0.2, 0.0, 0.0)


def around_of(*peers, velocity=HERE, local_from_map=HERE):
    moving = Twist2D(velocity.x_m, velocity.y_m)
    return neighbours_of(HERE, moving, peers, 0.5, 0.25, local_from_map)


def test_a_command_is_cut_to_the_room_of_the_cell():
    """The bisector is 0.55 m away; without the radius of 0.5 m, 0.05 m are left for 0.25 s."""
    limited = around_of(AHEAD).limited(np.array([[0.4, 0.4], [0.1, 0.0], [-0.4, 0.4]]))
    np.testing.assert_allclose(limited, [[0.2, 0.2], [0.1, 0.0], [-0.4, 0.4]])


def test_a_command_of_which_little_is_left_stops_the_robot():
    limited = around_of(AHEAD).limited(np.array([[1.3, 0.0], [1.4, 0.0]]))
    np.testing.assert_allclose(limited, [[0.2, 0.0], [0.0, 0.0]])  # 0.154 and 0.143 of them


def test_the_cell_limits_commands_as_neighbours_do():
    command = Twist2D(0.4, 0.4)
    limited = limit_to_cell(HERE, Twist2D(), command, [AHEAD], 0.5, 0.25).command
    np.testing.assert_allclose([limited.vx_mps, limited.vy_mps], [0.2, 0.2])


def test_the_room_is_less_for_a_robot_that_coasts_towards_the_peer():
    coasting = around_of(AHEAD, velocity=Pose2D(0.1, 0.0))
    np.testing.assert_allclose(coasting.rooms, [[1.0, 0.0, 0.05 - 0.35 * 0.1]])


def test_peers_are_in_the_frame_of_the_local_costmap():
    turned = around_of(AHEAD, local_from_map=Pose2D(1.0, 2.0, math.pi / 2))
    np.testing.assert_allclose(turned.states, [[1.0, 3.1, 0.0, -0.2]], atol=1e-12)
    np.testing.assert_allclose(turned.rooms, [[0.0, 1.0, 0.05]], atol=1e-12)


def test_peers_keep_their_velocities_and_their_distance():
    discs = around_of(AHEAD).discs(Pose2D(0.1, 0.0), np.array([0.0, 2.0]))
    np.testing.assert_allclose(discs[:, 0], [[1.0, 0.0, 1.0, 0.05], [0.6, 0.0, 1.0, 0.25]])


def test_without_peers_nothing_is_limited():
    commands = np.array([[1.0, 2.0]])
    assert around_of() is NO_NEIGHBOURS
    assert NO_NEIGHBOURS.limited(commands) is commands
    assert NO_NEIGHBOURS.discs(HERE, np.zeros(3)).shape == (3, 0, 4)


def test_an_evasion_takes_the_side_that_peers_leave_free():
    """Something comes along the x axis, slightly to the left; a peer stands to the right."""

    def evaded(neighbours):
        spec = GridSpec(160, 160, 0.05, -4.0, -4.0)
        costs = np.zeros(spec.shape, np.uint8)
        around = Surroundings(spec, costs, HERE, Twist2D(), 0.25, 0.5, 0.5, False, 0.1, neighbours)
        states = np.array([[2.0, 0.05, -1.0, 0.0]])
        coming = Tracks(0.0, np.arange(1), states, np.zeros((1, 4, 4)), np.full(1, 0.3))
        params = EvasionParams(True, clearance_m=0.1)
        return evade(params, around, coming, 0.0, np.zeros((1, 2)), Twist2D(), (0.0, 0.0))

    right = Peer("quad1", 0.0, -1.1, 0.0, 0.0, 0.0)
    assert evaded(NO_NEIGHBOURS).vy_mps < -0.3
    assert evaded(around_of(right)).vy_mps > 0.3
