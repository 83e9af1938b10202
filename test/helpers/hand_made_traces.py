"""Traces of flights with metrics that can be worked out by hand."""

from __future__ import annotations

from typing import Any, Sequence, Tuple

import numpy as np

from quad_nav.geometry import Pose2D, quaternion_from_euler
from quad_nav.navigator.tick import State
from quad_nav.recording.trace import FlightTrace, GoalTrace, RobotTrace
from quad_nav.sim.contacts import Contact
from quad_nav.sim.obstacles import Box, Cylinder
from quad_nav.sim.scene import Scene, Walls

RADIUS_M = 0.3
SCENE = Scene(
    "room",
    12.0,
    12.0,
    1.0,
    Walls(),
    (Cylinder("pillar", 6.0, 6.0, 0.5, 2.0), Box("crate", 3.0, 9.0, 1.0, 0.6, 0.4, yaw_rad=0.3)),
    (),
)
TIMES_S = np.arange(401) / 40.0  # ten seconds at 40 Hz


def robot(
    number: int,
    start: Tuple[float, float],
    velocity: Tuple[float, float] = (0.0, 0.0),
    turn_radps: float = 0.0,
    times_s: np.ndarray = TIMES_S,
    pitch_rad: float = 0.0,
    **more: Any,
) -> RobotTrace:
    """A straight flight at a steady speed from time 0, with a cycle and a command each second."""
    x_m, y_m = (start[k] + velocity[k] * times_s for k in (0, 1))
    quaternions = [quaternion_from_euler(0.0, pitch_rad, turn_radps * t) for t in times_s]
    velocities = np.tile([np.hypot(*velocity), 0.0, turn_radps], (len(times_s), 1))
    cycles_s = times_s[::40]
    return RobotTrace(
        f"quad{number}",
        times_s,
        np.column_stack([x_m, y_m, np.ones(len(times_s))]),
        np.array(quaternions, dtype=float).reshape(-1, 4),
        velocities,
        cycles_s,
        velocities[::40],
        cycles_s,
        np.full(len(cycles_s), 0.02),
        **more,
    )


def goal(
    index: int,
    place: Tuple[float, float],
    sent_s: float,
    ended_s: Any = None,
    reached: bool = True,
    reason: str = "",
) -> GoalTrace:
    return GoalTrace(
        index, 1, Pose2D(*place), sent_s, ended_s, ended_s is not None and reached, reason
    )


def flight(
    *robots: RobotTrace, contacts: Sequence[Contact] = (), scene: Any = SCENE, **more: Any
) -> FlightTrace:
    more = {"seed": 7, "config_name": "default", "versions": {"quad": "0.1.0"}, **more}
    return FlightTrace("by hand", robots, tuple(contacts), scene, RADIUS_M, **more)


def fleet(count: int) -> FlightTrace:
    """Quadcopters side by side that fly north at 0.5 m/s with everything that may happen."""
    robots = [
        robot(
            k,
            (1.0 + k, 1.0),
            (0.0, 0.5),
            goals=(
                goal(0, (1.0 + k, 3.5), 0.0, 5.0),
                goal(1, (1.0 + k, 6.0), 5.0, 10.0, k % 2 == 0, "aborted"),
            ),
            states=((0.0, State.PLANNING), (0.5, State.CONTROLLING), (7.0, State.CLEARING)),
            recoveries=((7.0, "conservative_reset"),),
            parameters={"controller_frequency": 10.0},
        )
        for k in range(count)
    ]
    return flight(*robots, contacts=[Contact(7.0, "quad0", "pillar", 1.3, 4.5)])
