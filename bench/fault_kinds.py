"""The faults of bench/faults.py, and the launch files that fly with them."""

from __future__ import annotations

import signal
from dataclasses import dataclass
from pathlib import Path
from typing import List, Optional, Tuple

ROOT = Path(__file__).resolve().parents[1]
GOALS = ROOT / "test" / "ros" / "respawn_goals"
SCENE = ROOT / "scenes" / "arena.yaml"
RATE = 3.0
KILL, STOP = signal.SIGKILL, signal.SIGSTOP

TWO_QUADS = ("two_quads.launch",)
FLEET = ("fleet.launch", "robots:=2", f"scene:={SCENE}", "composed:=false")
RELAYED = ("relayed.launch", f"scene:={SCENE}", "composed:=false")
# Robot 0's navigator is in the simulator's process, robot 1's in the process of its own, fleet1.
COMPOSED = ("fleet.launch", "robots:=2", f"scene:={SCENE}", "composed:=true", "hosts:=2")
RELAYED_COMPOSED = ("relayed.launch", f"scene:={SCENE}", "composed:=true")


@dataclass(frozen=True)
class Kind:
    """A fault: ``node`` gets the signal ``number``, and ``flyers`` lose their input.

    ``node`` is "" for the rosmaster; without a signal the fault is another one. ``listeners`` is
    the number of nodes that listen to ``/tf``.
    """

    name: str
    node: str = ""
    number: Optional[signal.Signals] = None
    flyers: Tuple[int, ...] = ()
    file: Tuple[str, ...] = TWO_QUADS
    ends_flight: bool = False
    listeners: int = 0

    def arguments(self, result: Path, *more: str) -> List[str]:
        """Return the launch file and its arguments."""
        return [
            *self.file,
            "rviz:=false",
            f"rate:={RATE}",
            f"goals:={GOALS}",
            "exit_when_done:=true",
            f"result:={result}",
            *more,
        ]


SEPARATE_KINDS = (
    Kind("sequencer", "/sequencer", KILL),
    Kind("navigator", "/move_base0", KILL, flyers=(0,)),
    Kind("fleet", "/fleet0", KILL, flyers=(0, 1), file=FLEET),
    Kind("stopped", "/move_base0", STOP, flyers=(0,)),
    Kind("simulator", "/simulator", KILL, ends_flight=True),
    Kind("roscore", "", KILL, ends_flight=True),
    Kind("link", flyers=(1,), file=FLEET),
    Kind("disk"),
    Kind("hung", "", STOP),
    Kind("nan_odometry", flyers=(0,), file=RELAYED),
    Kind("future_transform", listeners=2),
)
# A navigator is no process, and there is no link. Odometry of the own simulation is no message.
COMPOSED_KINDS = (
    Kind("sequencer", "/sequencer", KILL, file=COMPOSED),
    Kind("fleet", "/fleet1", KILL, flyers=(1,), file=COMPOSED),
    Kind("stopped", "/fleet1", STOP, flyers=(1,), file=COMPOSED),
    Kind("simulator", "/simulator", KILL, file=COMPOSED, ends_flight=True),
    Kind("roscore", "", KILL, file=COMPOSED, ends_flight=True),
    Kind("disk", file=COMPOSED),
    Kind("hung", "", STOP, file=COMPOSED),
    Kind("nan_odometry", file=RELAYED_COMPOSED),
    Kind("future_transform", file=COMPOSED, listeners=1),
)
