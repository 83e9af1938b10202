"""Measure the tracking of moving obstacles against the simulator's truth.

    python bench/tracking.py
    python bench/tracking.py --dynabarn worlds.npz --barn barn.npz --json tracking.json

Each flight is flown as configured, and a tracker beside it gets the scans of the first quadcopter.
For each scan its tracks are compared with the obstacles that move: errors of position and velocity,
the normalised estimation error squared (NEES, 4 if the filter is consistent: four states), tracks
without an obstacle, the time from which on an obstacle is in view until its track is confirmed, and
the wall time of the tracker. An obstacle is in view if four beams hit it, and moves if it is
faster than 1.25 times the tracker's least speed. A box counts as the disc around it.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Dict, Iterator, List, Optional, Tuple

import click
import numpy as np
from figures import JSON_HELP, Figures
from numpy.typing import NDArray
from tabulate import tabulate

from quad_moving.tracker import Tracker
from quad_nav.barn.dynamic import flight_setup as dynabarn_setup
from quad_nav.barn.dynamic import read_dynamic_setup
from quad_nav.barn.setup import BarnOptions, read_barn_setup
from quad_nav.barn.setup import flight_setup as barn_setup
from quad_nav.config.plugins import Parameters
from quad_nav.costmap.tracks import Tracks
from quad_nav.geometry import Pose3D, Scan
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.offline.run import fly
from quad_nav.scenario.flight_setup import FlightOptions, FlightSetup, read_setup
from quad_nav.sim.motion import SPLINE
from quad_nav.sim.movers import reach_m

Floats = NDArray[np.float64]

ROOT = Path(__file__).resolve().parents[1]
VIEW_BEAMS = 4
MOVES = 1.25
MATCH_M = 0.5  # a track farther than this from every obstacle's disc is false
LIFT_M = 0.3  # lower points are the floor's, as in config/default
DIFFERENCE_S = 0.05
STATIC_SCENES = ("scenes/arena.yaml", "scenes/encounters/corridor.yaml")
TIME_LIMIT_S = 60.0


@dataclass
class Tally:
    """Figures of one flight or more."""

    scans: int = 0
    tracks: int = 0
    false_tracks: int = 0
    false_predicted: int = 0
    false_numbers: int = 0
    seen: int = 0
    found: int = 0
    nees: List[float] = field(default_factory=list)
    position_m: List[float] = field(default_factory=list)
    predicted_m: List[float] = field(default_factory=list)
    velocity_mps: List[float] = field(default_factory=list)
    radius_m: List[float] = field(default_factory=list)
    delays_s: List[float] = field(default_factory=list)
    cost_us: List[float] = field(default_factory=list)


class Trial(FlightObserver):
    """Feeds a tracker with the scans of one robot and compares its tracks with the truth."""

    needs_single_process = True

    def __init__(self, tally: Tally) -> None:
        self._tally = tally
        self.tracker = Tracker(Parameters({}, "tracker"))
        self._since_s: Dict[int, float] = {}
        self._found: Dict[int, bool] = {}
        self._false: set = set()
        self._end_s = 0.0

    def on_start(self, flight: Flight) -> None:
        """Keep the simulation."""
        self._simulation = flight.simulation

    def on_scan(self, robot: int, scan: Scan, map_from_lidar: Pose3D) -> None:
        """Track, and compare."""
        if robot != 0:
            return
        start_s = time.perf_counter()
        self.tracker.add_scan("lidar", scan, map_from_lidar, (LIFT_M, math.inf))
        self._tally.cost_us.append(1e6 * (time.perf_counter() - start_s))
        self._tally.scans += 1
        states, radii_m = self._truth(scan.stamp_s)
        self._compare(self.tracker.known, self.tracker.known.unseen_s, states, radii_m)
        self._watch(scan, map_from_lidar, self.tracker.known, states, radii_m)

    def _truth(self, now_s: float) -> Tuple[Floats, Floats]:
        """Return states float64[m, 4] and radii of what moves but the robot itself."""
        movers = self._simulation.movers
        times_s = np.array([now_s - DIFFERENCE_S, now_s, now_s + DIFFERENCE_S])
        before, here, after = movers.poses_at(times_s)[:, :, :2]
        velocity = (after - before) / (2.0 * DIFFERENCE_S)
        velocity = np.where(np.isfinite(velocity), velocity, (here - before) / DIFFERENCE_S)
        bodies = self._simulation.body_state.rows[1:]
        states = np.concatenate([np.column_stack([here, velocity]), bodies[:, [0, 1, 7, 8]]])
        body_m = self._simulation.params.airframe.radius_m
        radii_m = [*(reach_m(shape) for shape in movers.shapes), *(body_m for _ in bodies)]
        return states, np.array(radii_m)

    def _compare(self, tracks: Tracks, unseen_s: Floats, states: Floats, radii_m: Floats) -> None:
        tally = self._tally
        tally.tracks += len(tracks)
        for number, state, covariance, radius_m, hidden_s in zip(
            tracks.numbers.tolist(), tracks.states, tracks.covariances, tracks.radii_m, unseen_s
        ):
            away_m = np.hypot(*(states[:, :2] - state[:2]).T) if len(states) else np.empty(0)
            nearest = int(np.argmin(away_m)) if len(away_m) else -1
            if nearest < 0 or away_m[nearest] > MATCH_M + radii_m[nearest]:
                if hidden_s > 0.0:
                    tally.false_predicted += 1
                    continue
                tally.false_tracks += 1
                if number not in self._false:
                    self._false.add(number)
                    tally.false_numbers += 1
                continue
            off = state - states[nearest]
            if hidden_s > 0.0:
                tally.predicted_m.append(float(np.hypot(*off[:2])))
                continue
            tally.nees.append(float(off @ np.linalg.solve(covariance, off)))
            tally.position_m.append(float(np.hypot(*off[:2])))
            tally.velocity_mps.append(float(np.hypot(*off[2:])))
            tally.radius_m.append(float(radius_m - radii_m[nearest]))

    def _watch(
        self, scan: Scan, pose: Pose3D, tracks: Tracks, states: Floats, radii_m: Floats
    ) -> None:
        """Count the obstacles in view that have a track, and the time until it is confirmed."""
        near_m = np.where(scan.ranges_m < self.tracker.params.range_m, scan.ranges_m, np.nan)
        angles = scan.angle_min_rad + scan.angle_increment_rad * np.arange(len(near_m))
        flat = np.column_stack([near_m * np.cos(angles), near_m * np.sin(angles), 0.0 * near_m])
        points = pose.transform_points(flat)[:, :2]
        for k, (state, radius_m) in enumerate(zip(states, radii_m)):
            hits = int((np.hypot(*(points - state[:2]).T) < radius_m + 0.05).sum())
            speed_mps = math.hypot(state[2], state[3])
            if hits < VIEW_BEAMS or speed_mps < MOVES * self.tracker.params.min_speed_mps:
                self._since_s.pop(k, None)
                continue
            if k not in self._since_s:
                self._since_s[k], self._found[k] = scan.stamp_s, False
            away_m = np.hypot(*(tracks.states[:, :2] - state[:2]).T)
            is_tracked = bool((away_m < MATCH_M + radius_m).any())
            self._tally.seen += 1
            self._tally.found += is_tracked
            if is_tracked and not self._found[k]:
                self._found[k] = True
                self._tally.delays_s.append(scan.stamp_s - self._since_s[k])


def flights(
    dynabarn: Optional[Path], barn: Optional[Path], only: Tuple[int, ...]
) -> Iterator[Tuple[str, FlightSetup]]:
    """Yield name and set-up of each flight."""
    arena, goals = ROOT / "scenes" / "arena.yaml", ROOT / "goals"
    encounters = goals / "encounters"
    scenes = ROOT / "scenes"
    cases: List[Tuple[str, Path, Path, Optional[int]]] = [
        ("arena, alone", arena, goals, 1),
        ("corridor, alone", scenes / "encounters" / "corridor.yaml", encounters / "corridor", 1),
        ("office, alone", scenes / "examples" / "office.yaml", goals / "examples" / "office", 1),
        ("arena, 2 robots", arena, goals, None),
        ("swap, 2 robots", scenes / "encounters" / "swap.yaml", encounters / "swap", None),
        ("walkers", scenes / "examples" / "walkers.yaml", goals / "examples" / "walkers", 1),
    ]
    for name, scene, folder, robots in cases:
        for seed in (0, 1):
            options = FlightOptions(
                scene, folder, robots=robots, seed=seed, time_limit_s=TIME_LIMIT_S
            )
            yield name, read_setup(options)
    if barn is not None:
        setup = read_barn_setup(BarnOptions(barn, only=(0, 60, 120, 180)))
        for world in setup.worlds:
            yield "BARN", barn_setup(setup.contestant, world, 0)
    if dynabarn is not None:
        options = BarnOptions(dynabarn, only=only)
        for world in read_dynamic_setup(options, SPLINE, 0.5).worlds:
            setup = read_dynamic_setup(replace(options, only=(world.number,)), SPLINE, 0.5)
            name = f"DynaBARN {('easy', 'medium', 'hard')[world.difficulty]}"
            yield name, dynabarn_setup(setup.contestant, world, SPLINE, 0)


def row(name: str, tally: Tally) -> List[str]:
    """Return a row of the table."""

    def middle(values: List[float], digits: int, part: float = 50.0) -> str:
        return f"{np.percentile(values, part):.{digits}f}" if values else "-"

    return [
        name,
        str(tally.scans),
        f"{tally.found / tally.seen:.0%}" if tally.seen else "-",
        f"{tally.tracks / max(tally.scans, 1):.2f}",
        f"{tally.false_tracks / max(tally.scans, 1):.3f}",
        f"{tally.false_predicted / max(tally.scans, 1):.3f}",
        str(tally.false_numbers),
        middle(tally.position_m, 2),
        middle(tally.position_m, 2, 95.0),
        middle(tally.predicted_m, 2),
        middle(tally.velocity_mps, 2),
        middle(tally.velocity_mps, 2, 95.0),
        middle(tally.nees, 1),
        f"{np.mean(np.minimum(tally.nees, 100.0)):.1f}" if tally.nees else "-",
        middle(tally.radius_m, 2),
        middle(tally.delays_s, 2),
        middle(tally.delays_s, 2, 90.0),
        middle(tally.cost_us, 0),
        f"{np.mean(tally.cost_us):.0f}",
    ]


HEADERS = (
    "",
    "scans",
    "tracked",
    "tracks",
    "false",
    "hidden",
    "falses",
    "m",
    "m 95%",
    "m hid.",
    "m/s",
    "m/s 95%",
    "NEES",
    "mean",
    "radius",
    "delay s",
    "90%",
    "us",
    "mean us",
)


@click.command()
@click.option("--dynabarn", type=click.Path(exists=True, path_type=Path), help="DynaBARN's worlds.")
@click.option("--barn", type=click.Path(exists=True, path_type=Path), help="BARN's worlds.")
@click.option("--worlds", default="", help="Numbers of DynaBARN's worlds; all without.")
@click.option("--case", default="", help="Fly the cases whose name contains this.")
@click.option("--json", "file", type=click.Path(path_type=Path), help=JSON_HELP)
def main(
    dynabarn: Optional[Path], barn: Optional[Path], worlds: str, case: str, file: Optional[Path]
) -> None:
    """Print errors, false tracks, delays and cost of the tracker for each kind of scene."""
    only = tuple(int(number) for number in worlds.split(",") if number)
    tallies: Dict[str, Tally] = {}
    for name, setup in flights(dynabarn, barn, only):
        if case in name:
            fly(setup, [Trial(tallies.setdefault(name, Tally()))])
    figures = Figures("tracking")
    for name, tally in tallies.items():
        figures.add(f"cost, {name}", "us", tally.cost_us)
        if tally.position_m:
            figures.add(f"position error, {name}", "m", tally.position_m)
            figures.add(f"velocity error, {name}", "m/s", tally.velocity_mps)
    print(tabulate([row(*one) for one in tallies.items()], HEADERS, disable_numparse=True))
    figures.write(file)


if __name__ == "__main__":
    main()
