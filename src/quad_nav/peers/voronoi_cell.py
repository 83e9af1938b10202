"""Commands that keep a robot on its own side of each peer.

Half-way between two robots stands a line. Each keeps its circle, of radius r, and a
margin on its own side, for as long as a command may last and for the way that it
takes to stop: its buffered Voronoi cell (D. Zhou, Z. Wang, S. Bandyopadhyay and
M. Schwager 2017, "Fast, On-line Collision Avoidance for Dynamic Vehicles Using Buffered
Voronoi Cells"). With n the direction to a peer at distance d, a displacement p is allowed
if

    p . n <= d / 2 - r - margin

If all do so none touch, at any control rate and without agreeing on anything. A
displacement is the arc that the command flies plus the way that the present velocity
still carries, ``COASTING_S * v``: a velocity loop of unit gain answers like a lag, and
after the lag has died away it has covered just that much more.

Where the arc leaves the cell it is flown more slowly, so that it ends before. The path
stays the one that the planner has checked. Where nothing of it is left the robot turns
on the spot, as it was to or else away from the peer: otherwise one that grazes a cell's
border would stand there for ever. Of two that meet head-on each turns to its right.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Sequence

import numpy as np

from quad_nav.geometry import Pose2D, Twist2D, angle_difference
from quad_nav.peers.peer import Peer

COASTING_S = 0.35
_PARTS = 20
_SLOWEST_PART = 0.15  # slower than that is standing
_TURN_RADPS = 0.4


@dataclass(frozen=True)
class LimitedCommand:
    """A command within the cell; ``by`` names the peer that it was slowed down for."""

    command: Twist2D
    by: str = ""


def limit_to_cell(
    pose: Pose2D,
    velocity: Twist2D,
    command: Twist2D,
    peers: Sequence[Peer],
    safety_radius_m: float,
    hold_s: float,
) -> LimitedCommand:
    """The command, slowed down as far as the cell between the peers demands.

    ``velocity`` and ``command`` are in the robot's frame; ``safety_radius_m`` is r + margin;
    ``hold_s`` is how long the command may last.
    """
    if not peers or (command.vx_mps == 0.0 and command.vy_mps == 0.0):
        return LimitedCommand(command)
    coasting = COASTING_S * np.array(pose.rotate(velocity.vx_mps, velocity.vy_mps))
    arc = np.column_stack(pose.rotate(*_arc(command, hold_s).T))
    fraction, nearest = 1.0, None
    for peer in peers:
        allowed = _allowed_fraction(
            arc, coasting, peer.x_m - pose.x_m, peer.y_m - pose.y_m, safety_radius_m
        )
        if allowed < fraction:
            fraction, nearest = allowed, peer
    if nearest is None:
        return LimitedCommand(command)
    if fraction < _SLOWEST_PART:
        return LimitedCommand(_turn_instead(pose, command, nearest), nearest.name)
    return LimitedCommand(
        Twist2D(
            fraction * command.vx_mps, fraction * command.vy_mps, fraction * command.vyaw_radps
        ),
        nearest.name,
    )


def _turn_instead(pose: Pose2D, command: Twist2D, peer: Peer) -> Twist2D:
    """The commanded turn, or if that is hardly one, a turn that takes the course off the peer."""
    if abs(command.vyaw_radps) >= _TURN_RADPS:
        return Twist2D(0.0, 0.0, command.vyaw_radps)
    course_rad = pose.yaw_rad + math.atan2(command.vy_mps, command.vx_mps)
    bearing_rad = angle_difference(math.atan2(peer.y_m - pose.y_m, peer.x_m - pose.x_m), course_rad)
    return Twist2D(0.0, 0.0, _TURN_RADPS if bearing_rad < -1e-6 else -_TURN_RADPS)


def room_towards(dx_m: float, dy_m: float, coasting: np.ndarray, safety_radius_m: float) -> float:
    """How far a command may bring the robot nearer to a peer that is (dx, dy) away."""
    distance_m = math.hypot(dx_m, dy_m)
    if distance_m == 0.0:
        return 0.0
    approach_m = (coasting[0] * dx_m + coasting[1] * dy_m) / distance_m
    return max(0.5 * distance_m - safety_radius_m - max(approach_m, 0.0), 0.0)


def _allowed_fraction(
    arc: np.ndarray, coasting: np.ndarray, dx_m: float, dy_m: float, safety_radius_m: float
) -> float:
    distance_m = math.hypot(dx_m, dy_m)
    if distance_m == 0.0:
        return 0.0
    room_m = room_towards(dx_m, dy_m, coasting, safety_radius_m)
    towards_m = (arc[:, 0] * dx_m + arc[:, 1] * dy_m) / distance_m
    outside = towards_m > room_m + 1e-9
    return float(np.argmax(outside)) / _PARTS if outside.any() else 1.0


def _arc(command: Twist2D, hold_s: float) -> np.ndarray:
    """Displacements in the robot's frame after 1, 2, ... parts of the time, float64[n, 2]."""
    times = hold_s * np.arange(1, _PARTS + 1) / _PARTS
    turns = command.vyaw_radps * times
    if abs(command.vyaw_radps) < 1e-6:
        ahead, aside = times, np.zeros_like(times)
    else:
        ahead = np.sin(turns) / command.vyaw_radps
        aside = (1.0 - np.cos(turns)) / command.vyaw_radps
    return np.column_stack(
        (
            command.vx_mps * ahead - command.vy_mps * aside,
            command.vx_mps * aside + command.vy_mps * ahead,
        )
    )
