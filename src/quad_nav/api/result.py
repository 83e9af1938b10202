"""Result of a flight: its summary and its trajectories as arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import yaws_from_quaternions
from quad_nav.mission.summary import MissionSummary, to_json
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.sim.flight import BodyState

Floats = NDArray[np.float64]

TRAJECTORY_COLUMNS: Tuple[str, ...] = (
    "time_s",
    "x_m",
    "y_m",
    "z_m",
    "qx",
    "qy",
    "qz",
    "qw",
    "yaw_rad",
    "vx_mps",
    "vy_mps",
    "vz_mps",
    "vyaw_radps",
    "command_vx_mps",
    "command_vy_mps",
    "command_vyaw_radps",
)
"""Columns of a trajectory.

Position, quaternion and yaw are those of ``base_link`` in ``map``; velocities and commands are in
``base_link``. A command is the one that the simulator flew when it reached the row's state, limited
as it limits it; zero while the quadcopter hovers.
"""


@dataclass(frozen=True)
class FlightResult:
    """Summary and trajectories of a flight.

    Attributes:
        summary: Figures of the mission: goals, times, lengths, clearances, contacts.
        trajectories: float64[k, 16] for each robot, a row every 1/40 s from time 0 on; columns
            as in ``TRAJECTORY_COLUMNS``.
    """

    summary: MissionSummary
    trajectories: Tuple[Floats, ...]

    @property
    def success(self) -> bool:
        """True if every goal was reached without a contact."""
        return self.summary.success

    def column(self, robot: int, name: str) -> Floats:
        """Return a column of a robot's trajectory, float64[k].

        Raises:
            ValueError: There is no column of this name.
        """
        return self.trajectories[robot][:, TRAJECTORY_COLUMNS.index(name)]

    def to_json(self) -> Dict[str, Any]:
        """Return the summary as ``quad fly --json`` writes it."""
        return to_json(self.summary)

    def to_frame(self) -> Any:
        """Return all trajectories as one ``pandas.DataFrame`` with a column ``robot`` first.

        Raises:
            ImportError: pandas is not installed; quad does not require it.
        """
        import pandas

        frame = pandas.DataFrame(np.concatenate(self.trajectories), columns=TRAJECTORY_COLUMNS)
        lengths = [len(rows) for rows in self.trajectories]
        frame.insert(0, "robot", np.repeat(np.arange(len(lengths)), lengths))
        return frame


class TrajectoryObserver(FlightObserver):
    """Keeps the states of all bodies every 1/40 s."""

    def __init__(self) -> None:
        self._times_s: List[float] = []
        self._states: List[Floats] = []
        self._commands: List[Floats] = []

    def on_start(self, flight: Flight) -> None:
        """Keep the start."""
        self.on_move(flight)

    def on_move(self, flight: Flight) -> None:
        """Keep the present states, and the commands that led to them."""
        self._times_s.append(flight.now_s)
        self._states.append(flight.simulation.body_state.rows)
        self._commands.append(flight.simulation.commands)

    def trajectories(self) -> Tuple[Floats, ...]:
        """Return the trajectory of each robot so far; see ``FlightResult``."""
        times_s, commands = np.array(self._times_s), np.array(self._commands)
        rows = np.array(self._states)
        count, robots, _ = rows.shape
        rotations = BodyState(rows.reshape(count * robots, 13)).rotations
        rotations = rotations.reshape(count, robots, 3, 3)
        velocities = np.einsum("krji,krj->kri", rotations, rows[..., 7:10])
        spins = np.einsum("krj,krj->kr", rotations[..., 2], rows[..., 10:13])
        quaternions = rows[..., 3:7].reshape(-1, 4)
        yaws = yaws_from_quaternions(quaternions).reshape(count, robots)
        return tuple(
            np.column_stack(
                [
                    times_s,
                    rows[:, robot, :7],
                    yaws[:, robot],
                    velocities[:, robot],
                    spins[:, robot],
                    commands[:, robot],
                ]
            )
            for robot in range(robots)
        )
