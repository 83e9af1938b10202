"""Measure the navigator's parts and compare them with C++ move_base, called in-process.

    make bench

Parameters and arena are the tutorial's. Times are medians in milliseconds without compilation.
"""

from __future__ import annotations

import statistics
import time
from dataclasses import replace
from pathlib import Path
from typing import Callable, List, Tuple

from tabulate import tabulate

from quad_nav import config
from quad_nav.control.controller import LocalPlanner
from quad_nav.control.dwa_planner import DwaParams, DwaPlanner
from quad_nav.control.trajectory_planner import TrajectoryPlanner
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.navigator.navigator import Navigator
from quad_nav.scenario.assembly import build_navigator
from quad_nav.sim.lidar import base_from_lidar
from quad_nav.sim.scene_file import load_scene
from quad_nav.sim.simulation import STEPS_PER_S, Simulation

ROOT = Path(__file__).resolve().parents[1]
GOAL = Pose2D(9.0, 5.5)
SCANS = 20  # kept by observation_persistence 1.0 at 20 Hz
RUNS = 200

# Milliseconds, navigation 1.17.3, release build, called in-process on two cores of a server.
CPP_MS = {
    "local costmap 120 x 120, 20 kept scans of 512 beams": 0.83,
    "global costmap 240 x 240, the same scans": 0.71,
    "NavfnROS, plan over 240 x 240": 1.0,
    "TrajectoryPlannerROS, 20 x 20 samples of 68 steps": 5.5,
    "TrajectoryPlannerROS, 6 x 20 samples of 1 s": 2.0,
    "TrajectoryPlannerROS with dwa: true, 20 x 20 samples": 3.9,
    "DWAPlannerROS, 20 x 20 samples": 3.9,
}


def median_ms(
    call: Callable[[], object], prepare: Callable[[], object] = lambda: None, runs: int = RUNS
) -> float:
    """Return the median time of ``runs`` calls after a first one that compiles."""
    prepare()
    call()
    times = []
    for _ in range(runs):
        prepare()
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return 1e3 * statistics.median(times)


def tutorial_navigator() -> Tuple[Navigator, Pose2D]:
    """Build the tutorial's navigator, with a second of flight in its costmaps."""
    navigator = build_navigator(
        config.load(config.load_files(ROOT / "config" / "tutorial", {"i": "0"}))
    )
    simulation = Simulation(load_scene(ROOT / "scenes" / "arena.yaml"), 2)
    for k in range(2 * SCANS):  # the robot accelerates in the first second
        simulation.set_command(0, Twist2D(vx_mps=0.3))
        for _ in range(STEPS_PER_S // 20):
            simulation.step()
        pose = simulation.state(0).map_from_base
        if k >= SCANS:
            scan = replace(simulation.scan(0), stamp_s=0.05 * (k - SCANS))
            for costmap in (navigator.global_costmap, navigator.local_costmap):
                costmap.layers["obstacle_layer"].add_scan(
                    "base_scan", scan, pose.compose(base_from_lidar), scan.stamp_s
                )
    simulation.close()
    for costmap in (navigator.global_costmap, navigator.local_costmap):
        costmap.update(1.0, pose.to_2d())
    return navigator, pose.to_2d()


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


def rows() -> List[Tuple[str, float]]:
    """Measure the parts; return their names and times in ms."""
    navigator, pose = tutorial_navigator()
    local, globe = navigator.local_costmap, navigator.global_costmap
    plan = navigator.make_plan(pose, GOAL)
    flying = Twist2D(vx_mps=0.2)

    def update(costmap: LayeredCostmap) -> float:
        return median_ms(lambda: costmap.update(1.0, pose))

    def control(controller: LocalPlanner) -> float:
        return median_ms(
            lambda: controller.compute_velocity(local.spec, local.costs, pose, flying),
            prepare=lambda: controller.set_plan(plan),
        )

    measured = [
        update(local),
        update(globe),
        median_ms(lambda: navigator.make_plan(pose, GOAL)),
        *map(control, local_planners(navigator.controller)),
    ]
    return list(zip(CPP_MS, measured))


def main() -> None:
    table = [
        (name, f"{ms:.2f}", f"{CPP_MS[name]:.2f}", f"{ms / CPP_MS[name]:.2f}")
        for name, ms in rows()
    ]
    print(
        tabulate(
            table,
            ("", "Python, ms", "C++, ms", "ratio"),
            disable_numparse=True,
            colalign=("left", "right", "right", "right"),
        )
    )


if __name__ == "__main__":
    main()
