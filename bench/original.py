"""Fly the tutorial's mission with C++ move_base, with ours, and with ours without fixes, in turn.

    make bench-original ARGS="--config default --repeat 5"

The flights are those of ``two_quads.launch`` at real time, in a loop: simulator, goals and YAML are
the same. CPU time and memory (resident set) are those of one of the two navigators. A run whose
real-time factor is below 0.95 is marked: the machine was too busy, and its figures do not count.
Without C++ move_base the other two are measured, and the status is 0 as well.
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
from pathlib import Path
from typing import Dict, List, Optional

import click
from fleet import Snapshot, cpu_of, factor, rate_hz, snapshots
from tabulate import tabulate

from quad_nav.errors import InputError, printable
from quad_nav.files.shipped import shipped
from quad_nav.scenario.flight_setup import FlightOptions, read_setup

MISSING = """C++ move_base is not installed, or its executable is missing: measuring ours alone.
Ubuntu 20.04: apt-get install ros-noetic-navigation
Debian 12 has no package. Build voxel_grid, costmap_2d, nav_core, base_local_planner,
dwa_local_planner, navfn, clear_costmap_recovery, rotate_recovery and move_base of
github.com/ros-planning/navigation, branch noetic-devel, in a catkin workspace of your own:
  apt-get install ros-cmake-modules liborocos-kdl-dev libtf2-dev libtf2-ros-dev \\
    libtf2-geometry-msgs-dev libtf2-sensor-msgs-dev libtf2-msgs-dev liblaser-geometry-dev \\
    libmap-msgs-dev libmove-base-msgs-dev libmessage-filters-dev libactionlib-dev pluginlib-dev \\
    librostest-dev ros-std-msgs ros-geometry-msgs ros-nav-msgs ros-map-msgs ros-move-base-msgs \\
    ros-sensor-msgs ros-visualization-msgs
  PATH=/usr/bin:$PATH catkin_make -DCMAKE_CXX_STANDARD=17
and name the workspace: ARGS="--workspace ~/navigation_ws"."""
ROBOTS, REAL_TIME = 2, 0.95
ORIGINAL, OURS, UPSTREAM = "C++ move_base", "quad", "quad, upstream: true"
IN_WORKSPACE = "QUAD_BENCH_WORKSPACE"  # set once the workspace's set-up file is sourced


def enter(workspace: Path) -> None:
    """Run this script again with the packages of a workspace beside ours."""
    if os.environ.get(IN_WORKSPACE) != str(workspace):
        os.environ[IN_WORKSPACE] = str(workspace)
        command = 'source "$0/devel/setup.bash" --extend && exec "$@"'
        os.execvp("bash", ["bash", "-c", command, str(workspace), sys.executable, *sys.argv])


def has_original() -> bool:
    """Return whether ROS finds the original's node."""
    import roslib.packages
    import rospkg

    try:
        return bool(roslib.packages.find_node("move_base", "move_base"))
    except rospkg.ResourceNotFound:
        return False


def row(navigator: str, seen: List[Snapshot]) -> List[str]:
    """Return a run's row; CPU time and memory are the means of both navigators."""
    (first, last), of_one = (seen[0], seen[-1]), range(ROBOTS)
    real_time = factor(first, last)
    return [
        navigator,
        f"{cost_ms(seen):.1f}",
        f"{statistics.mean(last.nodes[f'move_base{k}'][1] for k in of_one):.0f}",
        f"{rate_hz(ROBOTS, first, last):.1f}",
        f"{real_time:.2f}" + (" too slow" if real_time < REAL_TIME else ""),
    ]


def cost_ms(seen: List[Snapshot]) -> float:
    """Return the CPU time of a navigator in ms per simulated second."""
    cpu = cpu_of(seen[0], seen[-1])
    return 1000.0 * statistics.mean(cpu[f"move_base{k}"] for k in range(ROBOTS))


@click.command(help=__doc__.split("\n\n", maxsplit=1)[0])
@click.option("--workspace", type=click.Path(path_type=Path), help="A workspace with the original.")
@click.option("--config", default="tutorial", show_default=True)
@click.option("--repeat", type=click.IntRange(min=1), default=3, show_default=True)
@click.option("--seconds", type=click.FloatRange(min=1), default=60.0, show_default=True)
def main(workspace: Optional[Path], config: str, repeat: int, seconds: float) -> None:
    if workspace is not None:
        enter(workspace)
    try:
        read_setup(FlightOptions(None, shipped("goals"), config, robots=ROBOTS))
    except InputError as error:
        print(f"bench: {printable(error, chr(10))}", file=sys.stderr)
        sys.exit(2)
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as upstream:
        upstream.write("fixes: {upstream: true}\n")
        upstream.flush()
        arguments = {ORIGINAL: ["nav:=move_base"], OURS: [], UPSTREAM: []}
        arguments[UPSTREAM] = [f"override{robot}:={upstream.name}" for robot in range(ROBOTS)]
        if not has_original():
            print(f"bench: {MISSING}", file=sys.stderr)
            del arguments[ORIGINAL]
        rows: List[List[str]] = []
        costs_ms: Dict[str, List[float]] = {navigator: [] for navigator in arguments}
        for navigator, own in [*arguments.items()] * repeat:
            launched = "two_quads.launch", "loop:=true", f"config:={config}", *own
            seen = snapshots(ROBOTS, seconds, *launched)
            rows.append(row(navigator, seen))
            costs_ms[navigator].append(cost_ms(seen))
            print(*rows[-1], sep=", ", file=sys.stderr, flush=True)
    header = ("", "CPU, ms/s", "memory, MB", "commands, 1/s", "real-time factor")
    align = ("left", *["right"] * 3, "left")
    print(f"two_quads.launch, config {config}, {seconds:g} s; load {os.getloadavg()[0]:.1f}")
    print(tabulate(sorted(rows), header, "github", disable_numparse=True, colalign=align))
    medians_ms = {navigator: statistics.median(one) for navigator, one in costs_ms.items()}
    for navigator, ms in medians_ms.items():
        ratio = f", {ms / medians_ms[ORIGINAL]:.2f} of C++" if ORIGINAL in medians_ms else ""
        print(f"{navigator}: {ms:.1f} ms/s{ratio}")


if __name__ == "__main__":
    main()
