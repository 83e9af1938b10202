"""Parameters of a simulation, and its steps; apart from the simulation, which loads the engine."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from quad_nav.errors import InputError
from quad_nav.sim.flight import Airframe, FlightParams
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.odometry import OdometryErrors

STEPS_PER_S = 240
STEP_S = 1.0 / STEPS_PER_S
STEPS_PER_ODOMETRY = STEPS_PER_S // 40
LIDAR_CASTERS = ("kernel", "bullet")
FASTEST_RATE = 1000.0
"""From this rate on the simulation goes as fast as it can, and does not lag."""


@dataclass(frozen=True)
class SimulationParams:
    """Parameters of a simulation, apart from the scene and the number of quadcopters.

    A quadcopter hovers when its last command is older than ``command_timeout_s`` plus
    ``controller_period_s``.

    Attributes:
        lidar: Beam pattern and noise.
        flight: Limits of commands and gains of the flight controller.
        airframe: Mass properties and size of the quadcopters.
        command_timeout_s: Age up to which a command is valid, without the controller's period.
        controller_period_s: Period of the navigators' commands.
        jitter_m: Largest random displacement of a start pose.
        lidar_caster: Ray caster, see ``casters``: "kernel", or "bullet" for the physics engine.
        odom_drift: Errors of the odometry.

    Raises:
        InputError: A value is out of range; lists all of them.
    """

    lidar: LidarParams = field(default_factory=LidarParams)
    flight: FlightParams = field(default_factory=FlightParams)
    airframe: Airframe = field(default_factory=Airframe)
    command_timeout_s: float = 0.5
    controller_period_s: float = 0.05
    jitter_m: float = 0.0
    lidar_caster: str = "kernel"
    odom_drift: OdometryErrors = OdometryErrors()

    def __post_init__(self) -> None:
        problems = [
            f"{name}: {value}, expected {unit}, 0 or more"
            for name, value, unit in [
                ("command_timeout", self.command_timeout_s, "seconds"),
                ("controller_period", self.controller_period_s, "seconds"),
                ("jitter", self.jitter_m, "metres"),
            ]
            if not 0.0 <= value < math.inf
        ]
        if self.lidar_caster not in LIDAR_CASTERS:
            problems.append(f"lidar: {self.lidar_caster!r}, expected {' or '.join(LIDAR_CASTERS)}")
        if problems:
            raise InputError(problems)
