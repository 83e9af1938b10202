"""Measure the time of a scan of 512 beams, with the kernel and with the physics engine.

    make bench

CPU times in microseconds, medians of all calls. Several robots scan in one call; the time is for
each of them.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import List, Optional, Tuple

import click
import numpy as np
from figures import JSON_HELP, Figures
from tabulate import tabulate

from quad_nav.geometry import Pose2D
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.scene import Box, Cylinder, Obstacle, Scene, Walls
from quad_nav.sim.scene_file import load_scene
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import LIDAR_CASTERS, SimulationParams

ROOT = Path(__file__).resolve().parents[1]
BEAMS = LidarParams().beam_count
RUNS = {"kernel": 50, "bullet": 5}


def field(obstacles: int, robots: int, size_m: float = 60.0) -> Scene:
    """Make a scene with random obstacles and a square pattern of start poses."""
    random = np.random.default_rng(0)
    solids: List[Obstacle] = []
    for k in range(obstacles):
        x, y, yaw = random.uniform((0.0, 0.0, 0.0), (size_m, size_m, 3.0)).tolist()
        solids.append(
            Box(f"box{k}", x, y, 0.5, 0.5, 2.0, yaw)
            if k % 2
            else Cylinder(f"pillar{k}", x, y, 0.3, 2.0)
        )
    side = int(np.ceil(np.sqrt(robots)))
    pitch = size_m / side
    starts = tuple(
        Pose2D((k % side + 0.5) * pitch, (k // side + 0.5) * pitch) for k in range(robots)
    )
    return Scene("field", size_m, size_m, 1.0, Walls(), tuple(solids), starts)


def scan_us(scene: Scene, robots: int, caster: str) -> List[float]:
    """Return the times per robot of calls that scan all robots."""
    simulation = Simulation(scene, robots, SimulationParams(lidar_caster=caster))
    everyone = range(robots)
    simulation.scans(everyone)
    times = []
    for _ in range(RUNS[caster]):
        begin_ns = time.process_time_ns()
        simulation.scans(everyone)
        times.append(1e-3 * (time.process_time_ns() - begin_ns) / robots)
    simulation.close()
    return times


@click.command()
@click.option("--json", "file", type=click.Path(path_type=Path), help=JSON_HELP)
def main(file: Optional[Path]) -> None:
    """Print the time of a scan with the kernel and with the physics engine."""
    arena = load_scene(ROOT / "scenes" / "arena.yaml")
    cases: List[Tuple[str, Scene, int]] = [
        ("the tutorial's arena, 1 quadcopter", arena, 1),
        ("the tutorial's arena, 2 quadcopters", arena, 2),
        ("60 m, 200 obstacles, 10 quadcopters", field(200, 10), 10),
        ("60 m, 200 obstacles, 100 quadcopters", field(200, 100), 100),
        ("60 m, 10000 obstacles, 10 quadcopters", field(10000, 10), 10),
    ]
    figures, table = Figures("lidar"), []
    for name, scene, robots in cases:
        kernel, bullet = (
            figures.add(f"{caster}, {name}", "us", scan_us(scene, robots, caster))
            for caster in LIDAR_CASTERS
        )
        table.append(
            (f"{BEAMS} beams, {name}", f"{kernel:.0f}", f"{bullet:.0f}", f"{bullet / kernel:.0f}")
        )
    print(
        tabulate(
            table,
            ("", "kernel, us", "bullet, us", "ratio"),
            disable_numparse=True,
            colalign=("left", "right", "right", "right"),
        )
    )
    figures.write(file)


if __name__ == "__main__":
    main()
