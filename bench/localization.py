"""Fly seeds of a mission with a localization; print a row of docs/localization.md.

    python bench/localization.py amcl scenes/arena.yaml goals --robots 2 --seeds 100

Cases: ``people``: ten walk and keep away from quadcopters; ``unknown``: amcl's map lacks an
obstacle, another one for each seed; ``kidnapped``: after 2 to 10 s the particles are 3 m away;
``global``: they are all over the map. The ratio is that of the times with the localization and with
perfect poses. *Right* are flights that end with an error below 0.2 m, not lost, and the time until
it stays so; *wrong* is the time with a larger error in which robot 0 is not lost. *Drawn* are the
shares of slam's occupied cells within a cell of the scene's, and of the scene's seen ones within
one of slam's.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any, Tuple

import click
import numpy as np
import tabulate

from quad_localization.offline import MAKERS, LocalizationErrors
from quad_nav.config.files import leaves
from quad_nav.files.document import read_yaml
from quad_nav.files.shipped import shipped
from quad_nav.offline.flight import Flight
from quad_nav.offline.run import fly
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.motion import Walkers
from quad_nav.sim.odometry import OdometryErrors
from quad_nav.sim.scene import Scene
from quad_nav.sim.scene_cells import touched_cells
from quad_nav.sim.simulation_params import SimulationParams

CASES = ("mission", "people", "unknown", "kidnapped", "global")
PERFECT = SimulationParams(LidarParams(noise_std_m=0.01), jitter_m=0.2)
DRIFT = OdometryErrors(per_m=0.05, per_rad=0.05)
MISPLACED_S, JUMP_M = (2.0, 10.0), 3.0
RIGHT_M, ODOMETRY_HZ = 0.2, 40.0


class Misplaced(LocalizationErrors):
    """Misplaces the particles of robot 0, and measures the errors."""

    def __init__(self, case: str, seed: int) -> None:
        super().__init__()
        self.case, self.since_s, self.random = case, 0.0, np.random.default_rng(seed)
        self.is_misplaced, self.is_lost = False, []
        self.localization: Any = None

    def on_start(self, flight: Flight) -> None:
        """Choose when the particles are misplaced."""
        self.localization = flight.loop.group.localization
        if self.case in ("kidnapped", "global"):
            self.since_s = self.random.uniform(*MISPLACED_S)

    def on_move(self, flight: Flight) -> None:
        """Misplace the particles, and note whether the robot is right, wrong or lost."""
        super().on_move(flight)
        self.is_lost.append(self.localization.is_lost(0))
        if self.is_misplaced or not 0.0 < self.since_s <= flight.now_s:
            return
        self.is_misplaced, amcl = True, self.localization.amcls[0]
        if self.case == "global":
            amcl.set_uniform()
            return
        cloud = amcl.particles
        jumps = cloud.free_places - cloud.poses[:, :2].mean(axis=0)
        far = jumps[np.abs(np.hypot(*jumps.T) - JUMP_M) < 0.05]
        cloud.poses[:, :2] += self.random.choice(far)


def shares_drawn(localization: Any, scene: Scene) -> Tuple[float, float]:
    """Return the shares of right cells on slam's map, and of the scene's cells on it."""
    if not hasattr(localization, "slam"):
        return np.nan, np.nan
    grid = localization.slam.map.grid()
    solid, mapped = touched_cells(scene, grid.spec), grid.occupancy == 100
    seen = solid & grown(~solid & (grid.occupancy >= 0))
    return grown(solid)[mapped].mean(), grown(mapped)[seen].mean()


def grown(cells: Any) -> Any:
    """Return the cells bool[H, W] within one cell of some."""
    (rows, columns), padded, three = cells.shape, np.pad(cells, 1), range(3)
    return np.any([padded[j : j + rows, k : k + columns] for j in three for k in three], axis=0)


def fly_seed(kind: str, case: str, options: FlightOptions, config: str) -> Any:
    """Fly a seed with the localization, and with perfect poses; return the figures of a row."""
    overlay = tuple(leaves(read_yaml(shipped("config", f"{config}.yaml"))))
    known, setup = read_setup(options), read_setup(replace(options, parameters=overlay))
    scene, seed = setup.scene, setup.seed
    if case == "people":
        scene = replace(scene, walkers=Walkers(10, reacting=True))
    hidden = seed % len(scene.obstacles) if case == "unknown" else len(scene.obstacles)
    on_map = replace(scene, obstacles=scene.obstacles[:hidden] + scene.obstacles[hidden + 1 :])
    seen, simulation = Misplaced(case, seed), replace(setup.simulation, odom_drift=DRIFT)
    setup = replace(
        setup,
        scene=scene,
        simulation=simulation,
        localization=lambda _, robots: MAKERS[kind](on_map, robots),
    )
    summary, perfect = fly(setup, [seen]), fly(replace(known, scene=scene))
    far_m, robots = np.concatenate(seen.errors)[:, 0], len(setup.robots)
    is_far, is_lost = far_m[::robots] >= RIGHT_M, np.array(seen.is_lost)
    not_right = int(np.append(-1, np.flatnonzero(is_far | is_lost))[-1]) + 1
    right_s = not_right / ODOMETRY_HZ - seen.since_s if not_right < len(is_far) else np.inf
    wrong_s = (is_far & ~is_lost).sum() / ODOMETRY_HZ
    figures = summary.success, len(summary.contacts), far_m, summary.sim_time_s, perfect.sim_time_s
    return (*figures, right_s, wrong_s, *shares_drawn(seen.localization, scene))


@click.command()
@click.argument("kind", type=click.Choice(list(MAKERS)))
@click.argument("scene", type=click.Path(path_type=Path))
@click.argument("goals", type=click.Path(path_type=Path))
@click.option("--case", type=click.Choice(CASES), default="mission", show_default=True)
@click.option("--robots", default=1, show_default=True)
@click.option("--seeds", default=20, show_default=True)
@click.option("--first", default=0, show_default=True, help="The first seed.")
@click.option("--config", default="localized", show_default=True, help="An overlay.")
def main(kind: str, case: str, seeds: int, first: int, config: str, **given: Any) -> None:
    """Fly seeds and print the row of a table."""
    base, flown = "people" if case == "people" else "default", []
    for seed in range(first, first + seeds):
        options = FlightOptions(
            config=base, seed=seed, time_limit_s=600.0, simulation=PERFECT, **given
        )
        flown.append(fly_seed(kind, case, options, config))
        line = [np.percentile(np.float64(one), [50, 95]).round(3).tolist() for one in flown[-1]]
        click.echo(f"{seed}: {line}", err=True)
    done, contacts, far_m, times_s, perfect_s, rights_s, wrong_s, right_cells, seen_cells = zip(
        *flown
    )
    sure_s = [one for one in rights_s if np.isfinite(one)]
    row = {
        "flights": f"{kind} {given['scene'].stem} {case}",
        "robots": given["robots"],
        "seeds": f"{first}-{first + seeds - 1}",
        "complete": sum(done),
        "contacts": sum(contacts),
        "error (m)": "{:.3f}, {:.3f}".format(*np.percentile(np.concatenate(far_m), [50, 95])),
        "ratio": f"{sum(times_s) / sum(perfect_s):.3f}",
        "right": f"{len(sure_s)}: {np.median(sure_s or [np.nan]):.1f} s",
        "wrong": f"{sum(wrong_s):.1f} s",
        "drawn": f"{np.mean(right_cells):.3f}, {np.mean(seen_cells):.3f}",
    }
    print(tabulate.tabulate([row], "keys", tablefmt="pipe", disable_numparse=True))


if __name__ == "__main__":
    main()
