"""Comparison of what was published after goals and cancels with the recordings of C++ move_base."""

from __future__ import annotations

import copy
import gzip
import json
import sys
from pathlib import Path

import pytest

pytest.importorskip("rospy")

_HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(_HERE))

import transcript_action  # noqa: E402

with gzip.open(_HERE / "transcripts" / "actions.json.gz", "rt", encoding="utf-8") as file:
    RECORDED = [step for step in json.load(file) if "cpp" in step]


def changed(events, topic, **values):
    """The events with other values in the last one of a topic."""
    events = copy.deepcopy(events)
    [*_, last] = [summary for _, name, summary in events if name == topic]
    last.update(values)
    return events


def without(events, topic):
    return [event for event in events if event[1] != topic]


@pytest.mark.parametrize("step", RECORDED, ids=[step["input"][:20] for step in RECORDED])
def test_a_recording_is_equal_to_itself_a_moment_later_and_with_the_right_spelling(step):
    given, cpp = step["input"], step["cpp"]
    assert transcript_action.is_equal(given, cpp, cpp)
    later = [[round(seconds + 0.05, 2), topic, summary] for seconds, topic, summary in cpp]
    later = json.loads(json.dumps(later).replace("recieved", "received"))
    assert transcript_action.is_equal(given, later, cpp)


@pytest.mark.parametrize(
    "topic, values",
    [
        ("~/result", {"status": 8}),
        ("~/result", {"text": "Goal reached."}),
        ("~/result", {"id": "g5"}),
        ("~/current_goal", {"frame": "odom@"}),
        ("~/current_goal", {"pose": [2.0, 3.6, 0.0, 0.0, 0.0, 0.0, 1.0]}),
        ("~/feedback", {"id": "g4"}),
        ("~/feedback", {"bframe": ""}),
        ("~/status", {"status": [["g5", 4, ""]]}),
        ("/cmd_vel", {"cmd": [0.0, 0.0, 0.0]}),
    ],
)
def test_another_answer_differs(topic, values):
    step = RECORDED[1]  # g5 replaces g4
    given, cpp = step["input"], step["cpp"]
    assert not transcript_action.is_equal(given, changed(cpp, topic, **values), cpp)
    assert not transcript_action.is_equal(given, without(cpp, topic), cpp)


def test_a_recovery_that_was_not_recorded_differs():
    step = RECORDED[1]
    recovery = {"frame": "map", "stamp": 1.0, "i": 0, "of": 4, "name": "conservative_reset"}
    cpp = step["cpp"]
    assert not transcript_action.is_equal(
        step["input"], [*cpp, [1.0, "~/recovery_status", recovery]], cpp
    )
