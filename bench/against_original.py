"""Fly the same flights with our navigator and with the original, C++ move_base, in turn.

    scripts/ros_env python3 bench/against_original.py --workspace ~/navigation_ws --repeat 5

The flights are those of ``two_quads.launch`` at real time. Simulator, sequencer, goals and
parameter files are the same: only ``nav:=`` differs. CPU time is counted from the first odometry
until a robot's last goal ended, in milliseconds per simulated second; memory is the largest
resident set. Parts of the navigators are compared by bench/navigation.py, in-process.

The original is not part of this project, and this script neither fetches nor builds it. Ubuntu
20.04 has it as a package. Debian 12 has not: build it in a catkin workspace of your own, and name
that workspace's folder, or its devel or install space, with ``--workspace``.

Exit status: 0 if every flight ended with a summary, 1 if one did not, 2 without the original.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import shutil
import statistics
import sys
import tempfile
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Dict, FrozenSet, List, Optional, Tuple

import click
from figures import JSON_HELP, LARGER, SMALLER, Figure, Figures
from fleet import used
from launched import Launch, Watch, answers, wait_for
from tabulate import tabulate

OURS, ORIGINAL = "quad", "move_base"  # values of nav:=
MISSING = """C++ move_base is not installed: no package move_base, or no executable in it.
Ubuntu 20.04: apt-get install ros-noetic-navigation
Debian 12 has no package. In a catkin workspace of your own, build voxel_grid, costmap_2d, nav_core,
base_local_planner, dwa_local_planner, navfn, clear_costmap_recovery, rotate_recovery and move_base
of github.com/ros-planning/navigation, branch noetic-devel. Name its folder with --workspace."""
PERIOD_S, LONGEST_S = 0.25, 400.0  # wall time between samples; simulated time of a flight
ROBOTS, JITTER_M = 2, 0.3
IN_WORKSPACE = "QUAD_BENCH_WORKSPACE"  # set once the workspace's set-up file is sourced
# Unit of each figure, and what is better. CPU and memory have one of each node.
UNITS = {
    "CPU of": ("ms/s", SMALLER),
    "memory of": ("MB", SMALLER),
    "goals reached": ("", LARGER),
    "time to a goal": ("s", SMALLER),
    "flight": ("s", SMALLER),
    "commands to": ("1/s", LARGER),
    "smallest gap between the robots": ("m", LARGER),
    "smallest gap to an obstacle": ("m", LARGER),
    "contacts": ("", SMALLER),
    "recoveries": ("", SMALLER),
}


@dataclass(frozen=True)
class Sample:
    """Resources that the nodes have used until a moment.

    Attributes:
        now_s: Simulated time.
        nodes: CPU time in seconds and memory in MB by the node's name.
        commands: Number of commands to each robot.
        done: Robots without further goals.
    """

    now_s: float
    nodes: Dict[str, Tuple[float, float]]
    commands: Tuple[int, ...]
    done: FrozenSet[int]


def setup_file(workspace: Path) -> Path:
    """Return the set-up file of a catkin workspace, or of its devel or install space."""
    for folder in (workspace, workspace / "devel", workspace / "install"):
        if (folder / "setup.bash").is_file():
            return folder / "setup.bash"
    print(f"bench: {workspace} has no devel/setup.bash: is it built?", file=sys.stderr)
    sys.exit(2)


def enter(workspace: Path) -> None:
    """Run this script again with the packages of a workspace beside ours."""
    if os.environ.get(IN_WORKSPACE) != str(workspace):
        os.environ[IN_WORKSPACE] = str(workspace)
        source = 'source "$0" --extend && exec "$@"'
        script = str(Path(__file__).resolve())
        file = str(setup_file(workspace).resolve())
        os.execvp("bash", ["bash", "-c", source, file, "python3", script, *sys.argv[1:]])


def has_original() -> bool:
    """Return True if ROS finds the original's node."""
    import roslib.packages
    import rospkg

    try:
        return bool(roslib.packages.find_node(ORIGINAL, "move_base"))
    except rospkg.ResourceNotFound:
        return False


class Commands:
    """Counts the commands to each robot."""

    def __init__(self) -> None:
        import rospy

        self.counts = [0] * ROBOTS
        for robot in range(ROBOTS):
            rospy.Subscriber(f"/cmd_vel{robot}", rospy.AnyMsg, self._add, robot)

    def _add(self, _: Any, robot: int) -> None:
        self.counts[robot] += 1


def flight(navigator: str, config: str, seed: int, rate: float) -> Dict[str, float]:
    """Fly once; return the flight's figures, none if it left no summary."""
    folder = Path(tempfile.mkdtemp(prefix="quad_against_"))
    result = folder / "result.json"
    launch = Launch(
        [
            "two_quads.launch",
            "rviz:=false",
            "exit_when_done:=true",
            f"nav:={navigator}",
            f"config:={config}",
            f"seed:={seed}",
            f"jitter:={JITTER_M}",
            f"rate:={rate}",
            f"result:={result}",
            f"journal:={folder / 'journal'}",
        ],
        folder,
    )
    samples: List[Sample] = []
    try:
        wait_for(lambda: answers(launch.port), "the roscore")
        watch, commands = Watch(), Commands()
        end_s = time.monotonic() + 60.0 + LONGEST_S / rate
        while launch.process.poll() is None and time.monotonic() < end_s:
            if watch.now_s > 0.0:
                counts, done = tuple(commands.counts), frozenset(watch.done)
                samples.append(Sample(watch.now_s, used(launch.port), counts, done))
            time.sleep(PERIOD_S)
    finally:
        launch.end(0.5)
    if not result.exists():
        print(f"{navigator}, seed {seed}: no summary, logs in {folder}", file=sys.stderr)
        return {}
    summary = json.loads(result.read_text(encoding="utf-8"))
    shutil.rmtree(folder, ignore_errors=True)
    return {**used_by_nodes(samples), **flown(summary)}


def used_by_nodes(samples: List[Sample]) -> Dict[str, float]:
    """Return CPU and memory of each node, and the rate of commands.

    Those of a navigator count until its robot has no goals left, those of other nodes until none
    has.
    """
    found = {}
    for node in sorted({node for one in samples for node in one.nodes}):
        robots = {int(node[-1])} if node.startswith("move_base") else set(range(ROBOTS))
        until = [one for one in samples if node in one.nodes and not robots <= one.done]
        if len(until) < 2:
            continue
        first, last = until[0], until[-1]
        flown_s = last.now_s - first.now_s
        found[f"CPU of {node}"] = 1e3 * (last.nodes[node][0] - first.nodes[node][0]) / flown_s
        found[f"memory of {node}"] = max(one.nodes[node][1] for one in until)
        if len(robots) == 1:
            (robot,) = robots
            commands = last.commands[robot] - first.commands[robot]
            found[f"commands to quad{robot}"] = commands / flown_s
    return found


def flown(summary: Dict[str, Any]) -> Dict[str, float]:
    """Return the figures of a summary; a smallest gap is absent if there was none."""
    robots = summary["robots"]
    reached = [goal["time_s"] for robot in robots for goal in robot["goals"] if goal["reached"]]
    found = {
        "goals reached": float(len(reached)),
        "flight": summary["sim_time_s"],
        "contacts": float(len(summary["contacts"])),
        "recoveries": float(sum(robot["recoveries"] for robot in robots)),
    }
    if reached:
        found["time to a goal"] = statistics.mean(reached)
    for name, key in (
        ("smallest gap between the robots", "min_separation_m"),
        ("smallest gap to an obstacle", "min_clearance_m"),
    ):
        gaps = [robot[key] for robot in robots if robot[key] is not None]
        if gaps:
            found[name] = min(gaps)
    return found


def fly_in_process(pipe: Connection, *arguments: Any) -> None:
    """Fly in a process of its own, because a process has one ROS node."""
    pipe.send(flight(*arguments))
    os._exit(0)  # rospy's threads wait for a master that is gone


def run(*arguments: Any) -> Dict[str, float]:
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=fly_in_process, args=(there, *arguments))
    process.start()
    there.close()
    try:
        return here.recv()
    except EOFError:  # it has printed why
        return {}
    finally:
        process.join()


def table(flights: Dict[str, List[Dict[str, float]]], figures: Figures) -> List[List[str]]:
    """Add all figures; return a row for each, with our median, the original's, and the ratio."""
    rows = []
    names = {name: None for found in flights[OURS] + flights[ORIGINAL] for name in found}
    for start, (unit, better) in UNITS.items():
        for name in (one for one in names if one.startswith(start)):
            medians, cells = [], []
            for navigator, all_found in flights.items():
                values = [found[name] for found in all_found if name in found]
                if values:
                    medians.append(figures.add(f"{navigator}, {name}", unit, values, better))
                    one = Figure(name, unit, better, tuple(values))
                    cells.append(f"{one.median:.4g} ({min(values):.4g} to {max(values):.4g})")
                else:
                    cells.append("-")
            both = len(medians) == 2 and medians[1] != 0.0
            ratio = f"{medians[0] / medians[1]:.2f}" if both else "-"
            rows.append([f"{name}, {unit}" if unit else name, *cells, ratio])
    return rows


@click.command(help=__doc__.split("\n\n", maxsplit=1)[0])
@click.option("--workspace", type=click.Path(path_type=Path), help="A workspace with the original.")
@click.option("--config", default="tutorial", show_default=True)
@click.option("--repeat", type=click.IntRange(min=1), default=3, show_default=True)
@click.option("--rate", type=click.FloatRange(min=0.1), default=1.0, show_default=True)
@click.option("--json", "file", type=click.Path(path_type=Path), help=JSON_HELP)
def main(
    workspace: Optional[Path], config: str, repeat: int, rate: float, file: Optional[Path]
) -> None:
    if workspace is not None:
        enter(workspace)
    if not has_original():
        print(f"bench: {MISSING}", file=sys.stderr)
        sys.exit(2)
    flights: Dict[str, List[Dict[str, float]]] = {OURS: [], ORIGINAL: []}
    for seed in range(1, repeat + 1):
        for navigator, found in flights.items():
            found.append(run(navigator, config, seed, rate))
            print(f"{navigator}, seed {seed}: flown", file=sys.stderr, flush=True)
    figures = Figures(f"against_original {config}")
    rows = table(flights, figures)
    print(
        f"two_quads.launch, config {config}, {repeat} flights with each, jitter {JITTER_M} m; "
        f"median (range); load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    )
    header = ("", "Python", "C++", "ratio")
    align = ("left", "right", "right", "right")
    print(tabulate(rows, header, tablefmt="github", disable_numparse=True, colalign=align))
    figures.write(file)
    sys.exit(0 if all(all(found) for found in flights.values()) else 1)


if __name__ == "__main__":
    main()
