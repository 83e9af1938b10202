"""What an evasion knows: its parameters, the robot, and what is around the robot."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.body_response import Body
from quad_nav.control.neighbours import NO_NEIGHBOURS, Neighbours
from quad_nav.control.standing_obstacles import StandingObstacles, fill_gaps
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import GridSpec
from quad_nav.parameter import flag, number

Floats = NDArray[np.float64]

BODY = Body(gain_per_s=25.0 / 8.0, lag_s=2.0 / 25.0, acceleration_mps2=2.0)
"""Response of a quadcopter, as of ``sim/flight.py``."""
_FASTER_MPS = 0.2  # above its usual speed: the robot has evaded


@dataclass(frozen=True)
class EvasionParams:
    """Parameters of the evasion of moving obstacles, see ``docs/moving_obstacles.md``.

    Attributes:
        glance_rad: For what a LIDAR that does not see all around hides.
        max_acceleration_mps2: For passive safety, see ``control/passive_safety.py``.
        walking_mps: Greatest speed of an obstacle then, unless it is faster already.
    """

    avoid_moving_obstacles: bool = flag(
        "avoid_moving_obstacles", False, "Evade tracked obstacles.", upstream=False
    )
    clearance_m: float = number(
        "clearance", 0.1, "metres", 0, 2, "Distance from predicted obstacles."
    )
    glance_rad: float = number(
        "glance", 0.0, "radians", 0, 3.1416, "Look so far to both sides of the way."
    )
    speed_mps: float = number(
        "evasion_speed", 0.0, "metres/s", 0, 10, "Greatest speed of evasions; 0: as usual."
    )
    max_acceleration_mps2: float = number(
        "max_acceleration", 0.0, "metres/s^2", 0, 100, "Obstacles' greatest; 0: no passive safety."
    )
    walking_mps: float = number(
        "max_speed", 1.6, "metres/s", 0.1, 10, "Greatest speed of obstacles, for passive safety."
    )


@dataclass(frozen=True)
class Surroundings:
    """The robot among its peers and what stands, in the local costmap's frame.

    Attributes:
        spec: Grid of the local costmap.
        costs: uint8[H, W] on it.
        pose: Pose of the robot.
        velocity: Velocity of the robot, in its own frame.
        radius_m: Radius of the robot.
        max_speed_mps: Greatest speed of the robot in any direction, while it evades.
        usual_speed_mps: Greatest speed otherwise.
        is_following: The robot follows a plan; else it stays near a point.
        period_s: Time between two commands.
        neighbours: The peers.
    """

    spec: GridSpec
    costs: NDArray[np.uint8]
    pose: Pose2D
    velocity: Twist2D
    radius_m: float
    max_speed_mps: float
    usual_speed_mps: float
    is_following: bool
    period_s: float
    neighbours: Neighbours = NO_NEIGHBOURS

    @property
    def is_fast(self) -> bool:
        """The robot is faster than the navigator expects: it has evaded."""
        speed_mps = math.hypot(self.velocity.vx_mps, self.velocity.vy_mps)
        return speed_mps > self.usual_speed_mps + _FASTER_MPS

    def motion(self, last: Tuple[float, float]) -> Tuple[float, float, float, float]:
        """Return the robot's velocity, m/s, and its acceleration by the last command, m/s^2.

        They are along the axes of the costmap's frame, as the last command is.
        """
        velocity = self.pose.rotate(self.velocity.vx_mps, self.velocity.vy_mps)
        ax, ay = (BODY.gain_per_s * (c - v) for c, v in zip(last, velocity))
        shorten = BODY.acceleration_mps2 / max(math.hypot(ax, ay), BODY.acceleration_mps2)
        return (*velocity, shorten * ax, shorten * ay)

    def twist(self, command: Floats, vyaw_radps: float) -> Twist2D:
        """Return a velocity along the axes of the costmap's frame, float64[2], as a command."""
        turned = Pose2D(0.0, 0.0, -self.pose.yaw_rad).rotate(*command.tolist())
        return Twist2D(*turned, vyaw_radps)

    @cached_property
    def standing(self) -> StandingObstacles:
        """The distances from what stands in the local costmap."""
        spec = self.spec
        gaps = np.empty(self.costs.shape)
        fill_gaps(self.costs, spec.resolution_m, self.radius_m, gaps)
        x_m, y_m = spec.origin_x_m - self.pose.x_m, spec.origin_y_m - self.pose.y_m
        return StandingObstacles(gaps, x_m, y_m, spec.resolution_m)


def polar(max_speed_mps: float, speeds: int, courses: int) -> Floats:
    """Return the hover and a polar grid of velocities, float64[c, 2]."""
    angles = np.arange(courses) * (2.0 * math.pi / courses)
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    steps = max_speed_mps * np.arange(1, speeds + 1) / speeds
    return np.concatenate([np.zeros((1, 2)), *(speed * ring for speed in steps)])
