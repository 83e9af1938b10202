"""Nodes killed and stopped at random moments of a flight, and a link cut: what becomes of it.

    scripts/ros_env python3 bench/faults.py --each 20 --seed 1
    scripts/ros_env python3 bench/faults.py --kinds link --each 3        (as root)

Each flight is that of test/ros/respawn_goals, two quadcopters with three goals, at three times
real time. One fault is injected at a moment drawn evenly from the first ``MISSION_S`` simulated
seconds. A flight that its fault has ended (simulator, roscore) is flown on with resume:=true. In
the end every goal must have been reached, none in two flights, and nothing touched. Seconds of the
table are simulated: until the last moving quadcopter hovered, and until all that had not arrived
flew again; they count from the fault, for a stop or a cut from its beginning and its end.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import multiprocessing
import os
import random
import shutil
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Optional, Set, Tuple
from xmlrpc.client import ServerProxy

import tabulate
from link import HERE_IP, THERE_IP, Link, why_no_links

ROOT = Path(__file__).resolve().parents[1]
GOALS = ROOT / "test" / "ros" / "respawn_goals"
SCENE = ROOT / "scenes" / "arena.yaml"
RATE = 3.0
MISSION_S = 18.0
PATIENCE_S = 150.0  # wall time
STOPPED_S, CUT_S, FULL_S = 5.0, 10.0, 4.0  # wall time
HOVERS_MPS, FLIES_MPS = 0.05, 0.12


@dataclass(frozen=True)
class Kind:
    """``node`` dies by ``number``; ``flyers`` are the quadcopters that are then blind."""

    name: str
    node: str
    number: int = signal.SIGKILL
    flyers: Tuple[int, ...] = ()
    fleet: bool = False
    ends_flight: bool = False


KINDS = {
    kind.name: kind
    for kind in (
        Kind("sequencer", "/sequencer"),
        Kind("navigator", "/move_base0", flyers=(0,)),
        Kind("fleet", "/fleet0", flyers=(0, 1), fleet=True),
        Kind("stopped", "/move_base0", signal.SIGSTOP, flyers=(0,)),
        Kind("simulator", "/simulator", ends_flight=True),
        Kind("roscore", "", ends_flight=True),
        Kind("link", "", flyers=(1,), fleet=True),
        Kind("disk", ""),
    )
}


@dataclass
class Outcome:
    """Of one fault; ``problems`` is empty when all went as it must."""

    at_s: float
    hover_s: Optional[float] = None
    resume_s: Optional[float] = None
    reason: str = ""
    problems: List[str] = field(default_factory=list)


class Watch:
    """A node that looks on: speeds and what the sequencer does."""

    def __init__(self) -> None:
        import rospy
        from nav_msgs.msg import Odometry
        from std_msgs.msg import String

        rospy.init_node("faults", anonymous=True, disable_signals=True)
        self.events: List[dict] = []
        self.now_s = 0.0
        self.speeds_mps: List[Tuple[float, int, float]] = []  # when, who, how fast
        self._subscribers = [rospy.Subscriber("/quad/events", String, self._on_event)] + [
            rospy.Subscriber(f"/odom{i}", Odometry, self._on_odometry, i) for i in (0, 1)
        ]

    def _on_event(self, message) -> None:
        self.events.append(json.loads(message.data))

    def _on_odometry(self, message, robot: int) -> None:
        v = message.twist.twist.linear
        self.now_s = message.header.stamp.to_sec()
        self.speeds_mps.append((self.now_s, robot, math.hypot(v.x, v.y)))

    @property
    def done(self) -> Set[int]:
        """Quadcopters without further goals."""
        return {event["robot"] for event in self.events if event["event"] == "done"}

    def first(self, robot: int, after_s: float, holds: Callable[[float], bool]) -> float:
        """When a quadcopter's speed was first so, inf for never."""
        return next(
            (
                t
                for t, who, v in list(self.speeds_mps)
                if who == robot and t >= after_s and holds(v)
            ),
            math.inf,
        )


class Launch:
    """A roslaunch with a roscore of its own, or, with ``port``, one beside it."""

    def __init__(
        self,
        arguments: List[str],
        folder: Path,
        port: Optional[int] = None,
        prefix: Tuple[str, ...] = (),
        ip: str = "localhost",
    ) -> None:
        self.folder, self.port = folder, port or free_port()
        core = ["-p", str(self.port)] if port is None else []
        master = f"http://{'localhost' if ip == 'localhost' else HERE_IP}:{self.port}"
        self.log = (folder / f"launch-{time.monotonic():.3f}.log").open("w")
        self.process = subprocess.Popen(
            [*prefix, "roslaunch", *core, "quad", *arguments],
            stdout=self.log,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            env={
                **os.environ,
                "ROS_MASTER_URI": master,
                "ROS_HOSTNAME": ip,
                "ROS_HOME": str(folder),
            },
        )
        os.environ.update(
            ROS_MASTER_URI=master, ROS_HOSTNAME=("localhost" if ip == "localhost" else HERE_IP)
        )

    def pid_of(self, node: str) -> int:
        """Of a node, or of the rosmaster for ""."""
        if not node:
            children = subprocess.run(
                ["ps", "-o", "pid=,args=", "--ppid", str(self.process.pid)],
                stdout=subprocess.PIPE,
                text=True,
                check=True,
            ).stdout
            return next(
                int(line.split()[0]) for line in children.splitlines() if "rosmaster" in line
            )
        uri = ServerProxy(os.environ["ROS_MASTER_URI"]).lookupNode("/faults", node)[2]
        return ServerProxy(uri).getPid("/faults")[2]

    def end(self, patience_s: float = PATIENCE_S) -> bool:
        """Whether it ended by itself."""
        try:
            self.process.wait(patience_s)
            return True
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGINT)
            self.process.wait(60)
            return False
        finally:
            self.log.close()


def arguments_of(kind: Kind, result: Path, *more: str) -> List[str]:
    file = ["fleet.launch", "robots:=2", f"scene:={SCENE}"] if kind.fleet else ["two_quads.launch"]
    return [
        *file,
        "rviz:=false",
        f"rate:={RATE}",
        f"goals:={GOALS}",
        "exit_when_done:=true",
        f"result:={result}",
        *more,
    ]


def fly(kind: Kind, at_s: float, folder: Path) -> Outcome:
    """One flight with its fault, and a second one where that ends the first."""
    outcome, result = Outcome(at_s), folder / "result.json"
    more = {"link": ["hosts:=2", "only_host:=0"], "disk": [f"journal:={folder}/disk/journal"]}.get(
        kind.name, []
    )
    launch = Launch(
        arguments_of(kind, result, *more),
        folder,
        ip=HERE_IP if kind.name == "link" else "localhost",
    )
    other = None
    if kind.name == "link":
        wait_for(lambda: answers(launch.port), "the roscore")
        other = Launch(
            arguments_of(
                kind,
                folder / "none",
                "hosts:=2",
                "only_host:=1",
                "simulator:=false",
                "sequencer:=false",
            ),
            folder,
            launch.port,
            Link.there,
            THERE_IP,
        )
    wait_for(lambda: answers(launch.port), "the roscore")
    watch = Watch()
    wait_for(lambda: watch.now_s >= 1.0 + at_s, "the moment of the fault")
    inject(kind, launch, watch, outcome)
    if not launch.end():
        outcome.problems.append("did not end")
    if other is not None:
        os.killpg(other.process.pid, signal.SIGINT)
        other.process.wait(60)
    flown = read(result, outcome)
    outcome.reason = flown.get("reason", "")
    if kind.ends_flight:
        flown = resume(kind, folder, flown, outcome)
    judge(flown, watch, kind, outcome)
    return outcome


def inject(kind: Kind, launch: Launch, watch: Watch, outcome: Outcome) -> None:
    pid = launch.pid_of(kind.node) if kind.name not in ("link", "disk") else 0
    done, fault_s = watch.done, watch.now_s
    if kind.name == "link":
        Link.cut(CUT_S)
    elif kind.name == "disk":
        fill(launch.folder / "disk", watch, outcome)
    else:
        os.kill(pid, kind.number)
        if kind.number == signal.SIGSTOP:
            time.sleep(STOPPED_S)
            os.kill(pid, signal.SIGCONT)
    over_s = watch.now_s
    blind = [robot for robot in kind.flyers if robot not in done]
    if not blind or kind.ends_flight:
        return

    def resumed() -> bool:
        return all(
            robot in watch.done
            or watch.first(robot, max(over_s, hover_s(robot)), lambda v: v > FLIES_MPS) < math.inf
            for robot in blind
        )

    def hover_s(robot: int) -> float:
        return watch.first(robot, fault_s, lambda v: v < HOVERS_MPS)

    wait_for(lambda: all(hover_s(robot) < math.inf for robot in blind), "hover")
    wait_for(resumed, "flying again")
    outcome.hover_s = max(map(hover_s, blind)) - fault_s
    again_s = [
        watch.first(robot, max(over_s, hover_s(robot)), lambda v: v > FLIES_MPS) for robot in blind
    ]
    outcome.resume_s = max((t for t in again_s if t < math.inf), default=over_s) - over_s


def resume(kind: Kind, folder: Path, first: dict, outcome: Outcome) -> dict:
    """Flies on; the figures are those of the whole mission."""
    if not outcome.reason:
        outcome.problems.append("ended without a reason")
    result = folder / "resumed.json"
    launch = Launch(arguments_of(kind, result, "resume:=true"), folder)
    if not launch.end():
        outcome.problems.append("the resumed flight did not end")
    flown = read(result, outcome)
    reached = {
        (robot["robot"], goal["goal"]): goal["time_s"]
        for robot in first.get("robots", [])
        for goal in robot["goals"]
        if goal["reached"]
    }
    again = {
        (robot["robot"], goal["goal"]): goal["time_s"]
        for robot in flown.get("robots", [])
        for goal in robot["goals"]
    }
    outcome.problems += [
        f"{name} goal {number} was flown twice"
        for (name, number), time_s in reached.items()
        if again.get((name, number)) != time_s
    ]
    return flown


def judge(flown: dict, watch: Watch, kind: Kind, outcome: Outcome) -> None:
    goals = [(robot["robot"], goal) for robot in flown.get("robots", []) for goal in robot["goals"]]
    outcome.problems += [
        f"{name} goal {goal['goal']} was not reached: {goal['reason']}"
        for name, goal in goals
        if not goal["reached"]
    ]
    outcome.problems += [
        f"{name} goal {goal['goal']} took {goal['attempts']} attempts"
        for name, goal in goals
        if goal["attempts"] > 1
    ]
    outcome.problems += [f"contact: {contact}" for contact in flown.get("contacts", [])]
    if len(goals) != 3:
        outcome.problems.append(f"{len(goals)} goals in the summary, expected 3")
    ended = [(event["robot"], event["goal"]) for event in watch.events if event["event"] == "ended"]
    if len(ended) != len(set(ended)):
        outcome.problems.append(f"a goal has ended twice: {ended}")


@contextlib.contextmanager
def small_disk(folder: Path) -> Iterator[None]:
    """A file system of 64 KiB."""
    folder.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(folder)], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def fill(disk: Path, watch: Watch, outcome: Outcome) -> None:
    """Leaves no room, for a while; what the journal has then is complete."""
    with (disk / "other").open("wb", buffering=0) as other, contextlib.suppress(OSError):
        while True:
            other.write(bytes(4096))
    time.sleep(FULL_S)
    (disk / "other").unlink()
    time.sleep(FULL_S)
    lines = (disk / "journal").read_text().splitlines()
    legs = sum(json.loads(line).get("leg") is not None for line in lines)
    ended = sum(event["event"] == "ended" for event in watch.events)
    if legs != ended:
        outcome.problems.append(f"{legs} goals in the journal, {ended} flown")


def read(result: Path, outcome: Outcome) -> dict:
    if result.exists():
        return json.loads(result.read_text())
    outcome.problems.append("no summary")
    return {}


def wait_for(holds: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + PATIENCE_S
    while not holds():
        if time.monotonic() > end:
            raise TimeoutError(what)
        time.sleep(0.02)


def answers(port: int) -> bool:
    host = HERE_IP if os.environ["ROS_HOSTNAME"] == HERE_IP else "localhost"
    with socket.socket() as probe:
        return probe.connect_ex((host, port)) == 0


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        return probe.getsockname()[1]


def flown_apart(kind: Kind, at_s: float, pipe) -> None:
    """In a process of its own, because a process has one ROS node."""
    folder = Path(tempfile.mkdtemp(prefix="quad_faults_"))
    try:
        with {"link": Link, "disk": lambda: small_disk(folder / "disk")}.get(
            kind.name, contextlib.nullcontext
        )():
            outcome = fly(kind, at_s, folder)
    except Exception as error:
        outcome = Outcome(at_s, problems=[repr(error)])
    if outcome.problems:
        outcome.problems.append(f"logs in {folder}")
    else:
        shutil.rmtree(folder, ignore_errors=True)
    pipe.send(outcome)
    os._exit(0)  # rospy's threads wait for a master that may be dead


def run(kind: Kind, at_s: float) -> Outcome:
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=flown_apart, args=(kind, at_s, there))
    process.start()
    outcome = here.recv()
    process.join()
    return outcome


def why_not_here(name: str) -> str:
    """Why this machine can't have such a fault, "" when it can."""
    if name == "disk" and os.geteuid() != 0:
        return "a file system of its own needs root"
    return why_no_links() if name == "link" else ""


def row(kind: Kind, outcomes: List[Outcome]) -> List[str]:
    def figures(values: List[Optional[float]]) -> str:
        known = [value for value in values if value is not None]
        return f"{statistics.median(known):.2f} / {max(known):.2f}" if known else "-"

    good = sum(not outcome.problems for outcome in outcomes)
    reasons: Dict[str, int] = {}
    for outcome in outcomes:
        reasons[outcome.reason] = reasons.get(outcome.reason, 0) + 1
    told = "; ".join(f"{count} x {reason}" for reason, count in reasons.items() if reason)
    return [
        kind.name,
        f"{good} of {len(outcomes)}",
        figures([o.hover_s for o in outcomes]),
        figures([o.resume_s for o in outcomes]),
        told or "-",
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(KINDS))
    parser.add_argument("--each", type=int, default=20, help="flights of each kind")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    draw, rows, failed = random.Random(given.seed), [], False
    for name in given.kinds:
        moments_s = [draw.uniform(0.0, MISSION_S) for _ in range(given.each)]
        why_not = why_not_here(name)
        if why_not:
            print(f"{name}: NOT RUN: {why_not}", flush=True)
            failed = True
            continue
        outcomes = []
        for at_s in moments_s:
            outcome = run(KINDS[name], at_s)
            outcomes.append(outcome)
            print(name, outcome, flush=True)
        failed = failed or any(outcome.problems for outcome in outcomes)
        rows.append(row(KINDS[name], outcomes))
    print(
        tabulate.tabulate(
            rows,
            [
                "fault",
                "as it must",
                "hover s, median / max",
                "on again s, median / max",
                "reason of the end",
            ],
            tablefmt="github",
            disable_numparse=True,
        )
    )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
