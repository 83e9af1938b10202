#!/usr/bin/env python3
"""Drives one navigator by a list of inputs and writes a transcript of what it answers.

    scripts/ros_env test/conformance/transcript.py [FILE...] [--nav move_base] [--out FILE]

FILE is a session, by default each one in transcripts/. It is YAML:

    base:     another session, of which this one is a variant
    world:    robot and surroundings, see transcript_world.World
    params:   the node's private parameters, those of costmaps and planners below their names
    steps:    inputs in their order
    recorded: {file: FILE, config: NAME}, further steps: those of a list in JSON (.gz and .xz,
              too) whose `config` or `session` is NAME

A step has `family`, `input` and, if it was recorded, `expected` or `cpp`, the answer of C++
move_base; what that does not have is not compared:

    service   {service: make_plan, start: [x, y, yaw, frame], goal: likewise, tolerance: metres}
    action    a goal or a cancel as in recordings, see transcript_action
    goal      [x, y, yaw, frame]; the next step comes when the goal is active
    cancel    seconds to wait after a cancel of all goals
    marks     further marks of the world, as there
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
import lzma
import multiprocessing
import sys
from pathlib import Path
from typing import Any, Callable, Dict, List

import yaml

_HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(_HERE)]

import transcript_action  # noqa: E402
import transcript_service  # noqa: E402
from transcript_session import NotStarted, Session  # noqa: E402

EXIT_EQUAL, EXIT_DIFFERS, EXIT_UNUSABLE = 0, 1, 2
Answer = Callable[[Session, Any], Any]

FAMILIES: Dict[str, Answer] = {
    "service": transcript_service.answer,
    "action": transcript_action.answer,
    "goal": lambda session, place: session.send_goal(place),
    "cancel": lambda session, seconds: session.cancel(seconds),
    "marks": lambda session, lines: session.mark(lines),
    "wait": lambda session, seconds: session.wait(seconds),
    "params": lambda session, changes: session.reconfigure(changes),
}


def load(path: Path) -> Dict[str, Any]:
    """A session with all its steps."""
    session = yaml.safe_load(path.read_text(encoding="utf-8"))
    if "base" in session:
        base = yaml.safe_load((path.parent / session.pop("base")).read_text(encoding="utf-8"))
        session = merged(base, session)
    steps = list(session.get("steps", []))
    if "recorded" in session:
        recorded, name = path.parent / session["recorded"]["file"], session["recorded"]["config"]
        opened = {".gz": gzip.open, ".xz": lzma.open}.get(recorded.suffix, open)
        with opened(recorded, "rt", encoding="utf-8") as file:
            steps += [s for s in json.load(file) if name in (s.get("config"), s.get("session"))]
    unknown = {step["family"] for step in steps} - FAMILIES.keys()
    if unknown:
        raise ValueError(f"unknown families {sorted(unknown)}, expected {list(FAMILIES)}")
    return {**session, "steps": steps}


def merged(base: Dict[str, Any], changes: Dict[str, Any]) -> Dict[str, Any]:
    """A tree with the values of another one in their places."""
    both = dict(base)
    for key, value in changes.items():
        is_tree = isinstance(value, dict) and isinstance(both.get(key), dict)
        both[key] = merged(both[key], value) if is_tree else value
    return both


def play(path: Path, nav: str) -> List[Dict[str, Any]]:
    """The transcript of a session."""
    loaded = load(path)
    with Session(nav, loaded.get("world", {}), loaded.get("params", {})) as session:
        return [
            {**step, "answer": FAMILIES[step["family"]](session, step["input"])}
            for step in loaded["steps"]
        ]


def recorded_answer(step: Dict[str, Any]) -> Any:
    """What C++ move_base answered; None if that is not known."""
    return step.get("expected", step.get("cpp"))


def is_as_recorded(step: Dict[str, Any]) -> bool:
    """Whether the answer to a step is that of C++ move_base."""
    answer, recorded = step["answer"], recorded_answer(step)
    if step["family"] == "action":
        return transcript_action.is_equal(step["input"], answer, recorded)
    return is_equal(answer, recorded)


def is_equal(answer: Any, recorded: Any) -> bool:
    """Whether an answer is as recorded, in all that is recorded of it."""
    if isinstance(recorded, dict):
        return recorded.keys() <= answer.keys() and all(
            answer[key] == value for key, value in recorded.items()
        )
    return bool(answer == recorded)


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
        recorded = [step for step in transcript if recorded_answer(step) is not None]
        wrong = [step for step in recorded if not is_as_recorded(step)]
        print(f"{path.stem}: {len(recorded) - len(wrong)} of {len(recorded)} answers are equal")
        for step in wrong:
            print(f"  differs: {json.dumps(step['input'])}")
        differences += len(wrong)
    if arguments.out:
        arguments.out.write_text(json.dumps(transcripts, indent=1), encoding="utf-8")
    return EXIT_DIFFERS if differences else EXIT_EQUAL


if __name__ == "__main__":
    sys.exit(main())
