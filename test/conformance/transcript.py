#!/usr/bin/env python3
"""Drives one navigator by a list of inputs and writes a transcript of what it answers.

    scripts/ros_env test/conformance/transcript.py [FILE...] [--nav move_base] [--out FILE]

FILE is a session, by default each one in transcripts/. It is YAML:

    world:    robot and surroundings, see transcript_world.World
    params:   the node's private parameters, those of costmaps and planners below their names
    steps:    inputs in their order, or
    recorded: file of recorded steps beside it (JSON, may be gzipped), after those of `steps`

A step has `family`, `input` and, if it was recorded, `expected`, the answer of C++ move_base:

    service   {service: make_plan, start: [x, y, yaw, frame], goal: likewise, tolerance: m}
    action    a goal or a cancel, see transcript_action
    wait      seconds of simulated time
    params    {name: value}, by dynamic_reconfigure; a name may have a namespace: GlobalPlanner/...

In names '@' stands for the number of the robot: odom@, base_link@. The transcript is a list of the
steps, as JSON, each with its `answer`. Exit status: 0 when every recorded answer is equal, 1 when
one is not, 2 when a session cannot be read or the navigator does not start.
"""

from __future__ import annotations

import argparse
import gzip
import json
import multiprocessing
import sys
from pathlib import Path
from typing import Any, Callable, Dict, List

import yaml

_HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(_HERE)]

import transcript_service  # noqa: E402
from transcript_session import NotStarted, Session  # noqa: E402

EXIT_EQUAL, EXIT_DIFFERS, EXIT_UNUSABLE = 0, 1, 2
Answer = Callable[[Session, Any], Any]

FAMILIES: Dict[str, Answer] = {
    "service": transcript_service.answer,
    "wait": lambda session, seconds: session.wait(seconds),
    "params": lambda session, changes: session.reconfigure(changes),
}


def load(path: Path) -> Dict[str, Any]:
    """A session with its recorded steps behind its own."""
    session = yaml.safe_load(path.read_text(encoding="utf-8"))
    steps = list(session.get("steps", []))
    if "recorded" in session:
        recorded = path.parent / session["recorded"]
        opened = gzip.open if recorded.suffix == ".gz" else open
        with opened(recorded, "rt", encoding="utf-8") as file:
            steps += json.load(file)
    unknown = {step["family"] for step in steps} - FAMILIES.keys()
    if unknown:
        raise ValueError(f"{path}: unknown families {sorted(unknown)}, expected {list(FAMILIES)}")
    return {**session, "steps": steps}


def play(path: Path, nav: str) -> List[Dict[str, Any]]:
    """The transcript of a session."""
    loaded = load(path)
    with Session(nav, loaded.get("world", {}), loaded.get("params", {})) as session:
        return [
            {**step, "answer": FAMILIES[step["family"]](session, step["input"])}
            for step in loaded["steps"]
        ]


def differing(transcript: List[Dict[str, Any]]) -> List[Dict[str, Any]]:
    """The steps whose answer is not the recorded one."""
    return [
        step for step in transcript if "expected" in step and step["answer"] != step["expected"]
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", type=Path, help="sessions")
    parser.add_argument("--nav", default="quad", help="package of the node (default: %(default)s)")
    parser.add_argument("--out", type=Path, help="file of the transcripts, JSON")
    arguments = parser.parse_args()
    transcripts, differences = {}, 0
    # A process can be a node once.
    processes = multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1)
    for path in arguments.files or sorted(_HERE.glob("transcripts/*.yaml")):
        try:
            transcript = processes.apply(play, (path, arguments.nav))
            transcripts[path.stem] = transcript
        except (OSError, ValueError, KeyError, yaml.YAMLError, NotStarted) as error:
            print(f"{path}: {error}", file=sys.stderr)
            return EXIT_UNUSABLE
        wrong = differing(transcript)
        recorded = sum("expected" in step for step in transcript)
        print(f"{path.stem}: {recorded - len(wrong)} of {recorded} answers are equal")
        for step in wrong:
            print(f"  differs: {json.dumps(step['input'])}")
        differences += len(wrong)
    if arguments.out:
        arguments.out.write_text(json.dumps(transcripts, indent=1), encoding="utf-8")
    return EXIT_DIFFERS if differences else EXIT_EQUAL


if __name__ == "__main__":
    sys.exit(main())
