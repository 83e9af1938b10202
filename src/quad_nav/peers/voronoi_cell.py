"""Limit velocity commands to the robot's buffered Voronoi cell.

The cell is bounded by the perpendicular bisectors between the robot and its peers, each
shifted towards the robot by its radius plus a margin. With n the direction to a peer at
distance d, a displacement p stays inside the cell if

    p . n <= d / 2 - radius - margin

A command is safe if the robot stays inside its cell until the command expires, stopping
distance included. If every robot obeys this, no two collide, whatever their control rates and
without communication. The displacement is the arc of the command plus the distance
``COASTING_S * v`` that the present velocity still carries the robot: a velocity loop of unit
gain responds as a first-order lag, and that is the area under its decay.

Source: D. Zhou, Z. Wang, S. Bandyopadhyay, M. Schwager, "Fast, On-line Collision Avoidance
for Dynamic Vehicles Using Buffered Voronoi Cells", RA-L 2(2), 2017, section III.
"""

from __future__ import annotations

import math
from typing import Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D, Twist2D, angle_difference
from quad_nav.peers.peer import Peer

COASTING_S = 0.35
MIN_FRACTION = 0.15  # below this part of a command the cell stops the robot
_PARTS = 20
_STEPS = np.arange(1, _PARTS + 1)
_TURN_RADPS = 0.4

Arc = Tuple[NDArray[np.float64], NDArray[np.float64]]
"""Displacements along x and y, float64[_PARTS] each, metres."""


class Cell:
    """The Voronoi cell of a robot, which limits its commands."""

    def __init__(
        self,
        pose: Pose2D,
        velocity: Twist2D,
        peers: Sequence[Peer],
        safety_radius_m: float,
        hold_s: float,
    ) -> None:
        """Bound the cell of a robot.

        Args:
            pose: Robot pose in ``map``.
            velocity: Current velocity in the robot's frame.
            peers: Peers whose state is fresh.
            safety_radius_m: Robot radius plus margin.
            hold_s: How long a command may stay in force.
        """
        self._pose, self._peers = pose, peers
        self._safety_radius_m, self._hold_s = safety_radius_m, hold_s
        self._coasting = COASTING_S * np.array(pose.rotate(velocity.vx_mps, velocity.vy_mps))

    def limit(self, command: Twist2D) -> Tuple[Twist2D, str]:
        """Scale a command down so that the robot stays inside its cell.

        The path (arc) of the command is kept and flown more slowly, as the local planner has
        checked it. If too little of it is inside the cell, the robot turns in place, away from the
        nearest peer; otherwise two robots that graze each other's cells would stand for ever.

        Returns:
            The limited command, and the name of the peer that limited it, "" if none did.
        """
        if command.vx_mps == 0.0 and command.vy_mps == 0.0:
            return command, ""
        # No arc is longer than the way that it takes: only peers within it can limit the command.
        way_m = math.hypot(command.vx_mps, command.vy_mps) * self._hold_s * (1.0 + 1e-9)
        near = [(peer, *self._offset_and_room(peer)) for peer in self._peers]
        near = [row for row in near if row[-1] < way_m]
        if not near:
            return command, ""
        arc = self._pose.rotate(*_arc(command, self._hold_s))
        fraction, nearest = 1.0, None
        for peer, dx_m, dy_m, room_m in near:
            allowed = _allowed_fraction(arc, dx_m, dy_m, room_m)
            if allowed < fraction:
                fraction, nearest = allowed, peer
        if nearest is None:
            return command, ""
        if fraction < MIN_FRACTION:  # the robot turns in place
            return _turn_in_place(self._pose, command, nearest), nearest.name
        vx_mps, vy_mps = fraction * command.vx_mps, fraction * command.vy_mps
        return Twist2D(vx_mps, vy_mps, fraction * command.vyaw_radps), nearest.name

    def limit_velocities(self, velocities: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what the cell leaves of many commands that do not turn, for planning.

        Args:
            velocities: Commands, float64[c, 2], m/s along the axes of ``map``.

        Returns:
            float64[c, 2], shorter velocities with the same courses, 0 where the robot would turn.
        """
        parts = np.ones(len(velocities))
        for peer in self._peers:
            dx_m, dy_m, room_m = self._offset_and_room(peer)
            towards = np.array([dx_m, dy_m]) / max(math.hypot(dx_m, dy_m), 1e-9)
            carried_m = np.maximum(self._hold_s * (velocities @ towards), 1e-9)
            parts = np.minimum(parts, room_m / carried_m)
        parts = np.where(parts < MIN_FRACTION, 0.0, parts)
        limited: NDArray[np.float64] = velocities * parts[:, None]
        return limited

    def _offset_and_room(self, peer: Peer) -> Tuple[float, float, float]:
        """Return the offset of a peer, and how much nearer a command may bring the robot to it."""
        dx_m, dy_m = peer.x_m - self._pose.x_m, peer.y_m - self._pose.y_m
        distance_m = math.hypot(dx_m, dy_m)
        if distance_m == 0.0:
            return dx_m, dy_m, 0.0
        approach_m = (self._coasting[0] * dx_m + self._coasting[1] * dy_m) / distance_m
        room_m = 0.5 * distance_m - self._safety_radius_m - max(approach_m, 0.0)
        return dx_m, dy_m, float(max(room_m, 0.0))


def _turn_in_place(pose: Pose2D, command: Twist2D, peer: Peer) -> Twist2D:
    """Return the commanded turn or, if it is slow, a turn of the course away from the peer.

    Of two robots that meet head-on each turns to its right.
    """
    if abs(command.vyaw_radps) >= _TURN_RADPS:
        return Twist2D(0.0, 0.0, command.vyaw_radps)
    course_rad = pose.yaw_rad + math.atan2(command.vy_mps, command.vx_mps)
    bearing_rad = angle_difference(math.atan2(peer.y_m - pose.y_m, peer.x_m - pose.x_m), course_rad)
    return Twist2D(0.0, 0.0, _TURN_RADPS if bearing_rad < -1e-6 else -_TURN_RADPS)


def _allowed_fraction(arc: Arc, dx_m: float, dy_m: float, room_m: float) -> float:
    """Return the part of the arc, 0 to 1, that is inside the half-plane of a peer."""
    distance_m = math.hypot(dx_m, dy_m)
    if distance_m == 0.0:
        return 0.0
    towards_m = (arc[0] * dx_m + arc[1] * dy_m) / distance_m
    outside = towards_m > room_m + 1e-9
    first = int(outside.argmax())
    return float(first) / _PARTS if outside[first] else 1.0


def _arc(command: Twist2D, hold_s: float) -> Arc:
    """Return displacements in the robot's frame at equal steps of time."""
    times = hold_s * _STEPS / _PARTS
    turns = command.vyaw_radps * times
    if abs(command.vyaw_radps) < 1e-6:
        ahead, aside = times, np.zeros_like(times)
    else:
        ahead = np.sin(turns) / command.vyaw_radps
        aside = (1.0 - np.cos(turns)) / command.vyaw_radps
    return (
        command.vx_mps * ahead - command.vy_mps * aside,
        command.vx_mps * aside + command.vy_mps * ahead,
    )
