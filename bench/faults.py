"""Kill and stop nodes at random moments of a flight, cut a link, fill a disk, send bad messages.

    scripts/ros_env python3 bench/faults.py --each 20 --seed 1
    scripts/ros_env python3 bench/faults.py --kinds link --each 3        (as root)
    scripts/ros_env python3 bench/faults.py --composed --each 20

Each flight is that of test/ros/respawn_goals, two quadcopters with three goals, at three times
real time. One fault is injected at a moment drawn evenly from the first ``MISSION_S`` simulated
seconds; ``hung`` begins when robot 0 is 0.2 m to 0.8 m from its first goal. A flight that ends by
its fault (simulator, roscore) is resumed with resume:=true. A flight passes if every goal is
reached at the first attempt, none in two flights, without a contact. The table shows simulated
seconds from the fault until the last moving quadcopter hovered, and until all that had goals left
flew again. For a stop or a cut they count from its begin and from its end.
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
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional, Tuple

import tabulate
from bad_messages import TRUE_ODOMETRY, FutureTransform, OdometryRelay
from fault_kinds import COMPOSED_KINDS, SEPARATE_KINDS, STOP, Kind
from launched import ENDED, Launch, Watch, answers, wait_for
from link import HERE_IP, THERE_IP, Link, why_no_links

MISSION_S = 18.0
STOPPED_S, CUT_S, FULL_S = 5.0, 10.0, 4.0  # wall time
NAN_S = 3.0  # simulated time, as the next
BRAKES_S, FLIES_WITHIN_S = 1.5, 8.0  # a half turn on the spot takes 4.5 s
HOVERS_MPS, FLIES_MPS = 0.05, 0.12
HOVERS_WITHIN_S = 5.0  # simulated time; 0.6 s without a command, then braking


@dataclass
class Outcome:
    """Result of one fault; a flight without ``problems`` has passed."""

    at_s: float
    hover_s: Optional[float] = None
    resume_s: Optional[float] = None
    reason: str = ""
    problems: List[str] = field(default_factory=list)


def start(kind: Kind, folder: Path, result: Path) -> Tuple[Launch, Optional[Launch]]:
    """Start the flight, and for ``link`` the second host's part of it."""
    more = {
        "link": ["hosts:=2", "only_host:=0"],
        "disk": [f"journal:={folder}/disk/journal"],
        "fleet": ["composed:=false"],
    }.get(kind.name, [])
    ip = HERE_IP if kind.name == "link" else "localhost"
    launch = Launch(kind.arguments(result, *more), folder, ip=ip)
    if kind.name != "link":
        return launch, None
    wait_for(lambda: answers(launch.port), "the roscore")
    there = ("hosts:=2", "only_host:=1", "simulator:=false", "sequencer:=false")
    arguments = kind.arguments(folder / "none", *there)
    return launch, Launch(arguments, folder, launch.port, Link.there, THERE_IP)


def fly(kind: Kind, at_s: float, folder: Path) -> Outcome:
    """Fly with a fault, and resume the flight if the fault ends it."""
    outcome, result = Outcome(at_s), folder / "result.json"
    launch, other = start(kind, folder, result)
    wait_for(lambda: answers(launch.port), "the roscore")
    watch = Watch((TRUE_ODOMETRY, "/odom1")) if kind.name == "nan_odometry" else Watch()
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
    """Wait for the moment of the fault, inject it, and wait until the robots have recovered."""
    relay = OdometryRelay() if kind.name == "nan_odometry" else None
    future = FutureTransform(kind.listeners) if kind.listeners else None

    def is_due() -> bool:
        if kind.name == "hung":
            return watch.remaining_m(0) <= 0.2 + 0.6 * outcome.at_s / MISSION_S
        return watch.now_s >= 1.0 + outcome.at_s and (future is None or future.is_connected)

    wait_for(is_due, "the moment of the fault")
    pid = launch.pid_of(kind.node) if kind.number is not None else 0
    done, fault_s = watch.done, watch.now_s
    if relay is not None:
        relay.is_nan = True
        wait_for(lambda: watch.now_s >= fault_s + NAN_S, "the end of the fault")
        relay.is_nan = False
        if not kind.flyers:
            check_flight(watch, fault_s + BRAKES_S, outcome)
    elif future is not None:
        future.publish(fault_s)
        check_flight(watch, fault_s + BRAKES_S, outcome)
    elif kind.name == "link":
        Link.cut(CUT_S)
    elif kind.name == "disk":
        fill(launch.folder / "disk", watch, outcome)
    elif kind.number is not None:
        os.kill(pid, kind.number)
        if kind.number == STOP:
            time.sleep(STOPPED_S)
            os.kill(pid, signal.SIGCONT)
    if not kind.ends_flight:
        blind = [robot for robot in kind.flyers if robot not in done]
        wait_for_recovery(watch, blind, (fault_s, watch.now_s), outcome)


def check_flight(watch: Watch, begin_s: float, outcome: Outcome) -> None:
    """Check that robot 0 does not hover, unless it has flown all its goals."""

    def flies() -> bool:
        return watch.first(0, begin_s, lambda v: v > FLIES_MPS) < math.inf

    wait_for(lambda: flies() or watch.now_s > begin_s + FLIES_WITHIN_S, "flight")
    if not flies() and 0 not in watch.done:
        outcome.problems.append(f"quad0 hovered for {FLIES_WITHIN_S:g} s")


def wait_for_recovery(
    watch: Watch, blind: List[int], fault: Tuple[float, float], outcome: Outcome
) -> None:
    """Wait until the robots that lost their input have hovered and fly again.

    Args:
        watch: Observes the flight.
        blind: Robots that had goals left at the fault.
        fault: Begin and end of the fault in simulated seconds.
        outcome: Gets the times.
    """
    fault_s, over_s = fault
    if not blind:
        return

    def hover_s(robot: int) -> float:
        return watch.first(robot, fault_s, lambda v: v < HOVERS_MPS)

    def again_s(robot: int) -> float:
        return watch.first(robot, max(over_s, hover_s(robot)), lambda v: v > FLIES_MPS)

    wait_for(lambda: all(hover_s(robot) < math.inf for robot in blind), "hover")
    wait_for(
        lambda: all(robot in watch.done or again_s(robot) < math.inf for robot in blind),
        "flying again",
    )
    outcome.hover_s = max(map(hover_s, blind)) - fault_s
    if outcome.hover_s > HOVERS_WITHIN_S:
        outcome.problems.append(f"hovered after {outcome.hover_s:.1f} s")
    flying_s = [t for t in map(again_s, blind) if t < math.inf]
    outcome.resume_s = max(flying_s, default=over_s) - over_s


def resume(kind: Kind, folder: Path, first: Dict[str, Any], outcome: Outcome) -> Dict[str, Any]:
    """Resume the flight; the summary covers the whole mission."""
    if not outcome.reason:
        outcome.problems.append("ended without a reason")
    result = folder / "resumed.json"
    launch = Launch(kind.arguments(result, "resume:=true"), folder)
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


def judge(flown: Dict[str, Any], watch: Watch, kind: Kind, outcome: Outcome) -> None:
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
    ended = [(one.robot, one.goal) for one in watch.events if one.event in ENDED]
    if len(ended) != len(set(ended)):
        outcome.problems.append(f"a goal has ended twice: {ended}")


@contextlib.contextmanager
def small_disk(folder: Path) -> Iterator[None]:
    """Mount a file system of 64 KiB."""
    folder.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(folder)], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def fill(disk: Path, watch: Watch, outcome: Outcome) -> None:
    """Fill the disk for a while; afterwards the journal must be complete if the mission goes on."""
    before = watch.ended
    with (disk / "other").open("wb", buffering=0) as other, contextlib.suppress(OSError):
        while True:
            other.write(bytes(4096))
    time.sleep(FULL_S)
    on_full_disk = watch.ended
    (disk / "other").unlink()
    time.sleep(FULL_S)
    lines = (disk / "journal").read_text().splitlines()
    legs = sum(json.loads(line).get("leg") is not None for line in lines)
    is_over = len(watch.done) == 2 and on_full_disk == watch.ended
    if legs != watch.ended and not (is_over and legs >= before):
        outcome.problems.append(f"{legs} goals in the journal, {watch.ended} flown")


def read(result: Path, outcome: Outcome) -> Dict[str, Any]:
    if result.exists():
        return json.loads(result.read_text())
    outcome.problems.append("no summary")
    return {}


def fly_in_process(kind: Kind, at_s: float, pipe: Connection) -> None:
    """Fly in a process of its own, because a process has one ROS node."""
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
    process = context.Process(target=fly_in_process, args=(kind, at_s, there))
    process.start()
    outcome = here.recv()
    process.join()
    return outcome


def why_not_here(name: str) -> str:
    """Reason why this machine cannot inject a fault, "" if it can."""
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
    reasons_text = "; ".join(f"{count} x {reason}" for reason, count in reasons.items() if reason)
    return [
        kind.name,
        f"{good} of {len(outcomes)}",
        figures([o.hover_s for o in outcomes]),
        figures([o.resume_s for o in outcomes]),
        reasons_text or "-",
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--composed", action="store_true", help="the composed fleet")
    parser.add_argument("--kinds", nargs="+", metavar="KIND", help="all if not given")
    parser.add_argument("--each", type=int, default=20, help="flights of each kind")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    kinds = {kind.name: kind for kind in (COMPOSED_KINDS if given.composed else SEPARATE_KINDS)}
    for name in set(given.kinds or ()) - set(kinds):
        parser.error(f"--kinds: no kind {name!r}, expected some of {', '.join(kinds)}")
    draw, rows, failed = random.Random(given.seed), [], False
    for name in given.kinds or kinds:
        moments_s = [draw.uniform(0.0, MISSION_S) for _ in range(given.each)]
        why_not = why_not_here(name)
        if why_not:
            print(f"{name}: NOT RUN: {why_not}", flush=True)
            failed = True
            continue
        outcomes = []
        for at_s in moments_s:
            outcome = run(kinds[name], at_s)
            outcomes.append(outcome)
            print(name, outcome, flush=True)
        failed = failed or any(outcome.problems for outcome in outcomes)
        rows.append(row(kinds[name], outcomes))
    print(
        tabulate.tabulate(
            rows,
            [
                "fault",
                "passed",
                "hovers s, median / max",
                "resumes s, median / max",
                "stop reason",
            ],
            tablefmt="github",
            disable_numparse=True,
        )
    )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
