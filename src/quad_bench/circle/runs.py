"""Fly a circle by each method, several at the same time, and measure the flights alike."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Callable, Dict, Iterator, List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_bench.circle.orca import Orca
from quad_bench.circle.setup import ARRIVED_M, ORCA, ORCA_POINTS, QUAD, Circle
from quad_bench.flights import fly_each
from quad_nav.geometry import Twist2D
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.offline.run import fly
from quad_nav.sim.contacts import Contact
from quad_nav.sim.robot_state import RobotStates
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import STEPS_PER_S

Floats = NDArray[np.float64]

DRAWN_PERIOD_S = 0.5
_ALL_ARRIVED = "all have arrived"
_ODOM_STEPS = STEPS_PER_S // 40


@dataclass(frozen=True)
class CircleRun:
    """One flight of all robots.

    Attributes:
        method: Of ``METHODS``.
        robots: Number of robots.
        radius_m: Radius of the circle.
        run: Number of the flight.
        seed: Its seed.
        arrivals_s: Times of arrival; None for a robot that has not arrived.
        detours: Length of each robot's path to its arrival over that of the straight line.
        gap_m: Smallest distance between two hulls; negative if they overlap.
        contacts: Contacts; of points, the pairs whose hulls overlap.
        sim_time_s: Duration of the flight.
        tracks_m: Positions float64[t, n, 2] in ``map``, each ``DRAWN_PERIOD_S``.
    """

    method: str
    robots: int
    radius_m: float
    run: int
    seed: int
    arrivals_s: Tuple[Optional[float], ...]
    detours: Tuple[float, ...]
    gap_m: float
    contacts: Tuple[str, ...]
    sim_time_s: float
    tracks_m: Floats

    @property
    def arrived(self) -> int:
        """Number of robots that have arrived."""
        return sum(time_s is not None for time_s in self.arrivals_s)

    @property
    def detour(self) -> float:
        """Mean of path length over that of the straight line."""
        return sum(self.detours) / len(self.detours)

    @property
    def succeeded(self) -> bool:
        """True if all robots arrived without contact."""
        return self.arrived == self.robots and not self.contacts

    @property
    def mean_arrival_s(self) -> Optional[float]:
        """Mean time of arrival; None unless all arrived."""
        times_s = [time_s for time_s in self.arrivals_s if time_s is not None]
        return sum(times_s) / len(times_s) if len(times_s) == self.robots else None

    @property
    def last_arrival_s(self) -> Optional[float]:
        """Time of the last arrival; None unless all arrived."""
        times_s = [time_s for time_s in self.arrivals_s if time_s is not None]
        return max(times_s) if len(times_s) == self.robots else None


class Track:
    """Positions of all robots in the course of a flight, measured alike for every method.

    Attributes:
        arrivals_s: Times of arrival, inf for none.
        gap_m: Smallest distance between two hulls.
    """

    def __init__(self, starts_m: Floats, goals_m: Floats, body_radius_m: float) -> None:
        self._goals_m, self._body_radius_m = goals_m, body_radius_m
        self._straight_m = np.hypot(*(goals_m - starts_m).T)
        self._last_m = starts_m
        self._lengths_m = np.zeros(len(starts_m))
        self._pairs = np.triu_indices(len(starts_m), 1)
        self._drawn = [starts_m]
        self.arrivals_s = np.full(len(starts_m), math.inf)
        self.gap_m = math.inf
        self.touching: Dict[Tuple[int, int], float] = {}

    @property
    def all_arrived(self) -> bool:
        """True if every robot has arrived, wherever it is now."""
        return bool(np.isfinite(self.arrivals_s).all())

    def add(self, now_s: float, positions_m: Floats) -> None:
        """Add the positions float64[n, 2] at a later time."""
        flying = ~np.isfinite(self.arrivals_s)
        self._lengths_m[flying] += np.hypot(*(positions_m - self._last_m).T)[flying]
        self._last_m = positions_m
        near = np.hypot(*(self._goals_m - positions_m).T) <= ARRIVED_M
        self.arrivals_s[flying & near] = now_s
        first, second = self._pairs
        gaps_m = np.hypot(*(positions_m[first] - positions_m[second]).T) - 2 * self._body_radius_m
        self.gap_m = min(self.gap_m, float(gaps_m.min()))
        for pair in np.flatnonzero(gaps_m < 0.0):
            self.touching.setdefault((int(first[pair]), int(second[pair])), now_s)
        if now_s >= len(self._drawn) * DRAWN_PERIOD_S - 1e-9:
            self._drawn.append(positions_m)

    def result(
        self, circle: Circle, method: str, run: int, now_s: float, contacts: Sequence[str]
    ) -> CircleRun:
        """Return the measured flight."""
        return CircleRun(
            method,
            len(circle.starts),
            circle.radius_m,
            run,
            circle.flight_of(run).seed,
            tuple(None if time == math.inf else time for time in self.arrivals_s.tolist()),
            tuple((self._lengths_m / (self._straight_m - ARRIVED_M)).tolist()),
            self.gap_m,
            tuple(contacts),
            now_s,
            np.array([*self._drawn, self._last_m]),
        )


def fly_all(
    circles: Sequence[Circle], methods: Sequence[str], runs: int, count: int
) -> Iterator[CircleRun]:
    """Yield every flight as soon as it is flown, in any order; see ``fly_each``."""
    tasks = [
        (circle, method, run) for circle in circles for run in range(runs) for method in methods
    ]
    return fly_each(_fly, tasks, count)


def _fly(circle: Circle, method: str, run: int) -> CircleRun:
    return FLIGHTS[method](circle, run)


def fly_quad(circle: Circle, run: int) -> CircleRun:
    """Fly with our navigators until all have arrived, or to the time limit."""
    setup = circle.flight_of(run)
    observer = _TrackObserver(_track(circle, run))
    summary = fly(setup, (observer,))
    contacts = [_contact_text(contact) for contact in summary.contacts]
    return observer.track.result(circle, QUAD, run, summary.sim_time_s, contacts)


def fly_orca(circle: Circle, run: int) -> CircleRun:
    """Fly our quadcopters with ORCA's velocities as commands, at the navigators' frequency."""
    setup, track = circle.flight_of(run), _track(circle, run)
    orca = Orca(circle.orca, *_places(circle, run))
    simulation = Simulation(setup.scene, len(circle.starts), setup.simulation, setup.seed)
    control_steps = round(setup.simulation.controller_period_s * STEPS_PER_S)
    contacts: List[Contact] = []
    try:
        while not track.all_arrived and simulation.now_s < setup.time_limit_s:
            if simulation.step_count % control_steps == 0:
                _command(simulation, orca)
            contacts += simulation.advance(math.gcd(_ODOM_STEPS, control_steps))
            track.add(simulation.now_s, RobotStates(simulation.body_state).poses[:, :2].copy())
        return track.result(
            circle, ORCA, run, simulation.now_s, [_contact_text(one) for one in contacts]
        )
    finally:
        simulation.close()


def _command(simulation: Simulation, orca: Orca) -> None:
    """Command ORCA's velocities, in the bodies' frames and without a turn."""
    states = RobotStates(simulation.body_state)
    positions_m, velocities = states.poses[:, :2].copy(), states.bodies.velocities_mps[:, :2].copy()
    for robot, (vx_mps, vy_mps) in enumerate(orca.step(positions_m, velocities).tolist()):
        base_from_map = states[robot].map_from_base.to_2d().inverse()
        simulation.set_command(robot, Twist2D(*base_from_map.rotate(vx_mps, vy_mps), 0.0))


def fly_orca_points(circle: Circle, run: int) -> CircleRun:
    """Move points by ORCA's velocities, without bodies."""
    setup, track = circle.flight_of(run), _track(circle, run)
    params = circle.orca
    positions_m, goals_m = _places(circle, run)
    velocities = np.zeros_like(positions_m)
    orca = Orca(params, positions_m, goals_m)
    step, now_s = 0, 0.0
    while not track.all_arrived and now_s < setup.time_limit_s:
        velocities = orca.step(positions_m, velocities)
        positions_m = positions_m + params.period_s * velocities
        step += 1
        now_s = step * params.period_s
        track.add(now_s, positions_m)
    contacts = [
        f"quad{one} touches quad{other} at {time_s:.1f} s"
        for (one, other), time_s in track.touching.items()
    ]
    return track.result(circle, ORCA_POINTS, run, now_s, contacts)


FLIGHTS: Dict[str, Callable[[Circle, int], CircleRun]] = {
    QUAD: fly_quad,
    ORCA: fly_orca,
    ORCA_POINTS: fly_orca_points,
}


class _TrackObserver(FlightObserver):
    """Measures a flight and ends it when all robots have arrived."""

    def __init__(self, track: Track) -> None:
        self.track = track

    @property
    def stop_reason(self) -> str:
        """Says that all have arrived, once they have."""
        return _ALL_ARRIVED if self.track.all_arrived else ""

    def on_move(self, flight: Flight) -> None:
        """Measure the positions."""
        self.track.add(flight.now_s, flight.states.poses[:, :2].copy())


def _places(circle: Circle, run: int) -> Tuple[Floats, Floats]:
    starts = np.array([(start.x_m, start.y_m) for start in circle.starts_of(run)])
    return starts, np.array(circle.goals_m)


def _track(circle: Circle, run: int) -> Track:
    return Track(*_places(circle, run), circle.flight.simulation.airframe.radius_m)


def _contact_text(contact: Contact) -> str:
    return f"{contact.robot} touches {contact.other} at {contact.time_s:.1f} s"
