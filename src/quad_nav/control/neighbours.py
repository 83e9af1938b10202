"""Neighbours: the peers around a robot that evades, and the room that they leave it.

The robot's Voronoi cell limits its final command, see ``peers/voronoi_cell.py``. The evasion takes
the same limit into account, so that it does not choose a command that the cell stops.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D

Floats = NDArray[np.float64]

MIN_FRACTION = 0.15  # below this part of a command the cell stops the robot
_SIGMA_M, _SIGMA_MPS = 0.05, 0.1  # uncertainty of a peer's position, and its growth


@dataclass(frozen=True)
class Neighbours:
    """Peers, in the local costmap's frame.

    Attributes:
        states: float64[p, 4], rows x, y, vx and vy.
        rooms: float64[p, 3], rows unit vector towards a peer and the distance in metres by which a
            command may carry the robot that way.
        separation_m: Distance that the centres of two robots keep.
        hold_s: How long a command may stay in force.
    """

    states: Floats
    rooms: Floats
    separation_m: float = 0.0
    hold_s: float = 0.0

    def limited(self, commands: Floats) -> Floats:
        """Return velocities cut to the cell, float64[c, 2] in m/s; 0 where it stops the robot.

        The way is taken as straight; ``limit_to_cell`` follows the arc of the final command.

        Args:
            commands: float64[c, 2], velocities in m/s.
        """
        if not len(self.rooms):
            return commands
        carried_m = np.maximum(commands @ self.rooms[:, :2].T * self.hold_s, 1e-9)
        parts = np.minimum(self.rooms[:, 2] / carried_m, 1.0).min(axis=1)
        limited: Floats = commands * np.where(parts < MIN_FRACTION, 0.0, parts)[:, None]
        return limited

    def discs(self, pose: Pose2D, times_s: Floats) -> Floats:
        """Return discs that the robot's centre has to avoid if peers keep their velocities.

        Args:
            pose: Pose of the robot.
            times_s: float64[t], times from now.

        Returns:
            float64[t, p, 4]: x and y relative to the robot, radius, standard deviation.
        """
        discs = np.empty((len(times_s), len(self.states), 4))
        discs[:, :, :2] = self.states[:, :2] - np.array([pose.x_m, pose.y_m])
        discs[:, :, :2] += times_s[:, None, None] * self.states[:, 2:]
        discs[:, :, 2] = self.separation_m
        discs[:, :, 3] = (_SIGMA_M + _SIGMA_MPS * times_s)[:, None]
        return discs


NO_NEIGHBOURS = Neighbours(np.zeros((0, 4)), np.zeros((0, 3)))
