"""Measure how long a navigator takes to start, and the memory that it needs.

    scripts/ros_env python3 bench/startup.py --rate 3

Flies ``two_quads.launch``, kills the process of ``move_base0`` and waits until the process that
replaces it sends its first command, and its first one that moves the quadcopter: a navigator that
starts while another quadcopter has the right of way commands it to hover. Times count from the
start of that process, and from the kill, which adds the 0.5 s of roslaunch's ``respawn_delay``.
Simulated time counts from the kill. Memory is the process's a while after: resident pages, of
which others may share some, and those that it has alone.
"""

from __future__ import annotations

import os
import signal
import tempfile
import time
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Dict, List, Optional, Tuple

import click
import rospy
import tabulate
from figures import JSON_HELP, Figures
from geometry_msgs.msg import Twist
from launched import Launch, answers, wait_for
from rosgraph_msgs.msg import Clock

NODE, TOPIC = "move_base0", "/cmd_vel0"
TICKS_PER_S = os.sysconf("SC_CLK_TCK")
SETTLE_S = 3.0  # simulated


@dataclass(frozen=True)
class Start:
    """One start of the navigator: durations until its first commands, and its memory then."""

    from_process_s: float
    from_kill_s: float
    from_kill_simulated_s: float
    moves_from_process_s: float
    cpu_s: float
    resident_mb: float
    own_mb: float


UNITS = {field.name: field.name.rsplit("_", 1)[1].replace("mb", "MB") for field in fields(Start)}


class Commands:
    """The times of the commands of one robot, on the clock of process starts."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self._times_s: List[Tuple[float, float, bool]] = []  # since boot, simulated, if it moves
        self._subscribers = [
            rospy.Subscriber(TOPIC, Twist, self._add, queue_size=10),
            rospy.Subscriber("/clock", Clock, self._set_clock, queue_size=1),
        ]

    def first_after(self, boot_s: float, moves: bool = False) -> Optional[Tuple[float, float]]:
        """Return the time since boot, and the simulated time, of the first one after a time.

        With ``moves`` it is the first one that moves the quadcopter.
        """
        for sent_s, clock_s, is_moving in list(self._times_s):
            if sent_s > boot_s and (is_moving or not moves):
                return sent_s, clock_s
        return None

    def _add(self, message: Any) -> None:
        is_moving = bool(message.linear.x or message.linear.y or message.angular.z)
        self._times_s.append((since_boot_s(), self.now_s, is_moving))

    def _set_clock(self, message: Any) -> None:
        self.now_s = message.clock.to_sec()


def since_boot_s() -> float:
    return time.clock_gettime(time.CLOCK_BOOTTIME)


def process_of(port: int) -> int:
    """Return the process id of the navigator under a master, 0 if there is none."""
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            is_node = f"__name:={NODE}\0".encode() in (folder / "cmdline").read_bytes()
            if is_node and f"localhost:{port}".encode() in (folder / "environ").read_bytes():
                return int(folder.name)
        except OSError:  # it has just ended
            continue
    return 0


def stat_of(process: int) -> Tuple[float, float]:
    """Return the time since boot at which a process started, and its processor time."""
    text = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return int(text[19]) / TICKS_PER_S, (int(text[11]) + int(text[12])) / TICKS_PER_S


def memory_mb(process: int) -> Dict[str, float]:
    """Return the fields of a process's memory."""
    lines = Path(f"/proc/{process}/smaps_rollup").read_text().splitlines()[1:]
    return {line.split(":")[0]: int(line.split()[1]) / 1024 for line in lines}


def respawn(commands: Commands, port: int) -> Start:
    """Kill the navigator and measure the one that replaces it."""
    begun_s = since_boot_s()
    wait_for(lambda: commands.first_after(begun_s, moves=True) is not None, "a command")
    old, killed_s, clock_s = process_of(port), since_boot_s(), commands.now_s
    os.kill(old, signal.SIGKILL)
    wait_for(lambda: process_of(port) not in (0, old), "another process")
    process = process_of(port)
    started_s = stat_of(process)[0]
    wait_for(lambda: commands.first_after(started_s) is not None, "a command")
    cpu_s = stat_of(process)[1]
    wait_for(lambda: commands.first_after(started_s, moves=True) is not None, "a moving command")
    command_s, command_clock_s = commands.first_after(started_s) or (0.0, 0.0)
    moving_s, moving_clock_s = commands.first_after(started_s, moves=True) or (0.0, 0.0)
    wait_for(lambda: commands.now_s > moving_clock_s + SETTLE_S, "the clock")
    memory = memory_mb(process)
    return Start(
        from_process_s=command_s - started_s,
        from_kill_s=command_s - killed_s,
        from_kill_simulated_s=command_clock_s - clock_s,
        moves_from_process_s=moving_s - started_s,
        cpu_s=cpu_s,
        resident_mb=memory["Rss"],
        own_mb=memory["Private_Clean"] + memory["Private_Dirty"],
    )


def measure(rate: float, config: str, repeat: int) -> List[Start]:
    """Fly, and kill the navigator again and again."""
    mission = f"two_quads.launch rviz:=false loop:=true rate:={rate:g} config:={config}"
    with tempfile.TemporaryDirectory() as folder:
        launch = Launch(mission.split(), Path(folder))
        try:
            wait_for(lambda: answers(launch.port), "the master")
            rospy.init_node("bench", anonymous=True, disable_signals=True, disable_rosout=True)
            commands = Commands()
            wait_for(lambda: commands.now_s > SETTLE_S, "the simulation")
            return [respawn(commands, launch.port) for _ in range(repeat)]
        finally:
            launch.process.send_signal(signal.SIGINT)
            launch.end()


@click.command(help=__doc__.splitlines()[0])
@click.option("--rate", default=3.0, show_default=True, help="Simulated seconds per second.")
@click.option("--config", default="default", show_default=True)
@click.option("--repeat", default=5, show_default=True, help="Starts.")
@click.option("--json", "file", type=click.Path(path_type=Path), help=JSON_HELP)
def main(rate: float, config: str, repeat: int, file: Optional[Path]) -> None:
    """Print the median and the range of each figure."""
    figures, starts = Figures(f"startup {config} rate {rate:g}"), measure(rate, config, repeat)
    rows = []
    for name, unit in UNITS.items():
        values = [getattr(start, name) for start in starts]
        median = figures.add(name.rsplit("_", 1)[0].replace("_", " "), unit, values)
        rows.append((figures.figures[-1].name, unit, median, min(values), max(values)))
    print(f"Respawned navigator, config {config}, rate {rate:g}, {repeat} starts")
    print(tabulate.tabulate(rows, ["", "", "median", "least", "most"], floatfmt=".2f"))
    figures.write(file)


if __name__ == "__main__":
    main()
