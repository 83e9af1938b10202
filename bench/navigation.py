"""Measure the navigator's parts and compare them with C++ move_base, called in-process.

    make bench

Parameters and arena are the tutorial's. Times are CPU times in milliseconds without compilation,
the medians of ten rounds. A round takes the median of 20 calls of each part, so that a slow minute
of the machine meets all parts and shows in their spread. Two scans come before each update of a
costmap.
"""

from __future__ import annotations

import statistics
import time
from dataclasses import replace
from pathlib import Path
from typing import Callable, Dict, List, Optional, Sequence, Tuple

import click
from figures import JSON_HELP, Figures
from tabulate import tabulate

from quad_nav import config
from quad_nav.control.controller import LocalPlanner
from quad_nav.control.dwa_planner import DwaParams, DwaPlanner
from quad_nav.control.trajectory_planner import TrajectoryPlanner
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.obstacle import ObstacleLayer
from quad_nav.geometry import Pose2D, Pose3D, Scan, Twist2D
from quad_nav.navigator.navigator import Navigator
from quad_nav.scenario.assembly import build_navigator
from quad_nav.sim.lidar import base_from_lidar
from quad_nav.sim.scene_file import load_scene
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import STEPS_PER_S

ROOT = Path(__file__).resolve().parents[1]
GOAL = Pose2D(9.0, 5.5)
SCAN_HZ = 20
SCANS = 20  # kept by observation_persistence 1.0
SEEN, SCANS_PER_UPDATE = 40, 2  # scans of the repeated flight; costmaps of 10 Hz
ROUNDS, CALLS = 10, 20

# CPU time in ms of C++ navigation 1.17.3 with the same data and the same results: medians of 200
# calls in-process, release build of gcc 12, on two cores of a server.
CPP_MS = {
    "local costmap 120 x 120, 20 kept scans of 512 beams": 0.95,
    "global costmap 240 x 240, the same scans": 0.84,
    "NavfnROS, plan over 240 x 240": 0.56,
    "TrajectoryPlannerROS, 20 x 20 samples of 1.7 s": 5.85,
    "TrajectoryPlannerROS, 6 x 20 samples of 1 s": 2.1,
    "TrajectoryPlannerROS with dwa: true, 20 x 20 samples": 5.95,
    "DWAPlannerROS, 20 x 20 samples": 5.4,
}


Seen = Tuple[Scan, Pose3D]  # and the pose map_from_base
Part = Tuple[Callable[[], object], Callable[[], object]]  # what is measured, what goes before it


def no_preparation() -> None:
    """Prepare nothing."""


def median_ms(call: Callable[[], object], prepare: Callable[[], object]) -> float:
    """Return the median CPU time of ``CALLS`` calls."""
    times_ns = []
    for _ in range(CALLS):
        prepare()
        begin_ns = time.process_time_ns()
        call()
        times_ns.append(time.process_time_ns() - begin_ns)
    return 1e-6 * statistics.median(times_ns)


class Updates:
    """Updates of a costmap in flight: two new scans before each, the oldest two are dropped.

    The flight repeats. Stamps go on, so that ``SCANS`` are kept at any time.
    """

    def __init__(self, costmap: LayeredCostmap, seen: Sequence[Seen]) -> None:
        self.costmap, self.seen = costmap, seen
        self.taken = 0

    def take(self, scans: int = SCANS_PER_UPDATE) -> None:
        """Take the next scans."""
        for _ in range(scans):
            scan, map_from_base = self.seen[self.taken % len(self.seen)]
            self.now_s, self.pose = self.taken / SCAN_HZ, map_from_base.to_2d()
            map_from_sensor = map_from_base.compose(base_from_lidar)
            layer = self.costmap.layers["obstacle_layer"]
            assert isinstance(layer, ObstacleLayer)
            layer.add_scan(
                "base_scan", replace(scan, stamp_s=self.now_s), map_from_sensor, self.now_s
            )
            self.taken += 1

    def update(self) -> None:
        """Update the costmap."""
        self.costmap.update(self.now_s, self.pose)


def tutorial_flight() -> List[Seen]:
    """Fly straight with 0.3 m/s; return what the LIDAR sees in two seconds."""
    simulation = Simulation(load_scene(ROOT / "scenes" / "arena.yaml"), 2)
    seen = []
    for k in range(SCANS + SEEN):  # the robot accelerates in the first second
        simulation.set_command(0, Twist2D(vx_mps=0.3))
        for _ in range(STEPS_PER_S // SCAN_HZ):
            simulation.step()
        if k >= SCANS:
            seen.append((simulation.scan(0), simulation.state(0).map_from_base))
    simulation.close()
    return seen


def tutorial_navigator() -> Tuple[Navigator, Pose2D]:
    """Build the tutorial's navigator, with a second of flight in its costmaps."""
    navigator = build_navigator(
        config.load(config.load_files(ROOT / "config" / "tutorial", {"i": "0"}))
    )
    seen = tutorial_flight()
    for costmap in (navigator.global_costmap, navigator.local_costmap):
        updates = Updates(costmap, seen)
        updates.take(SCANS)
        updates.update()
    return navigator, updates.pose


def local_planners(tutorial: LocalPlanner) -> List[LocalPlanner]:
    """Return the local planners to measure, the tutorial's first."""
    assert isinstance(tutorial, TrajectoryPlanner)
    short = replace(tutorial.params, vx_samples=6, sim_time_s=1.0)
    window = replace(tutorial.params, dwa=True)
    dwa = replace(
        DwaParams(),
        vx_samples=20,
        vy_samples=1,
        vth_samples=20,
        max_vel_y_mps=0.0,
        min_vel_y_mps=0.0,
        max_vel_x_mps=0.3,
        max_vel_trans_mps=0.3,
    )
    footprint, period_s = tutorial.footprint, tutorial.control_period_s
    return [
        tutorial,
        TrajectoryPlanner(short, footprint, period_s),
        TrajectoryPlanner(window, footprint, period_s),
        DwaPlanner(dwa, footprint, period_s),
    ]


def parts() -> List[Part]:
    """Return what is measured, in the order of ``CPP_MS``."""
    navigator, pose = tutorial_navigator()
    spare, seen = tutorial_navigator()[0], tutorial_flight()
    local = navigator.local_costmap
    plan = navigator.make_plan(pose, GOAL)
    flying = Twist2D(vx_mps=0.2)

    def update(costmap: LayeredCostmap) -> Part:
        updates = Updates(costmap, seen)
        return updates.update, updates.take

    def control(controller: LocalPlanner) -> Part:
        return (
            lambda: controller.compute_velocity(local.spec, local.costs, pose, flying),
            lambda: controller.set_plan(plan),
        )

    return [
        update(spare.local_costmap),
        update(spare.global_costmap),
        (lambda: navigator.make_plan(pose, GOAL), no_preparation),
        *map(control, local_planners(navigator.controller)),
    ]


def measure() -> Dict[str, List[float]]:
    """Return the time of each part in ms, one for each round, after a first one that compiles."""
    named = dict(zip(CPP_MS, parts()))
    times_ms: Dict[str, List[float]] = {name: [] for name in named}
    for k in range(ROUNDS + 1):
        for name, (call, prepare) in named.items():
            one_ms = median_ms(call, prepare)
            if k:
                times_ms[name].append(one_ms)
    return times_ms


@click.command()
@click.option("--json", "file", type=click.Path(path_type=Path), help=JSON_HELP)
def main(file: Optional[Path]) -> None:
    """Print the time of each part beside the original's."""
    figures, table = Figures("navigation"), []
    for name, times_ms in measure().items():
        ms = figures.add(name, "ms", times_ms)
        row = (f"{ms:.2f}", f"{figures.figures[-1].spread:.2f}", f"{CPP_MS[name]:.2f}")
        table.append((name, *row, f"{ms / CPP_MS[name]:.2f}"))
    print(
        tabulate(
            table,
            ("", "Python, ms", "spread", "C++, ms", "ratio"),
            disable_numparse=True,
            colalign=("left", "right", "right", "right", "right"),
        )
    )
    figures.write(file)


if __name__ == "__main__":
    main()
