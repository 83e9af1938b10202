"""Actions that nobody implements, and those of a page that may only watch."""

from __future__ import annotations

import pytest

from quad_web.view.actions import LABELS, READS, Actions, Answer, WatchOnly


class Everything(Actions):
    """Can do everything and counts what it did."""

    available = frozenset({*LABELS, *READS})

    def __init__(self):
        self.done = []

    def __getattr__(self, name):
        return lambda *arguments: self.done.append((name, *arguments)) or Answer(True, name)


@pytest.mark.parametrize("name", LABELS)
def test_actions_are_carried_out_or_refused(name):
    steering = Everything()
    watching = WatchOnly(steering)
    assert watching.call(name, 1) == Answer(False, f"{name}: this page may only watch")
    assert watching.available == frozenset() and steering.done == []
    assert steering.call(name, 1).ok and steering.done == [(name, 1)]
    assert Actions().call(name, 1) == Answer(False, f"{name}: not possible here")


def test_who_may_watch_only_sees_parameters_and_goals_and_has_no_goals_checked():
    steering = Everything()
    watching = WatchOnly(steering)
    assert watching.call("parameters", 0).ok and watching.call("goal_files").ok
    assert watching.call("check_goals", 0, "v1", []) == [] == Actions().call("goal_files")
    assert steering.done == [("parameters", 0), ("goal_files",)]


def test_nothing_else_is_called():
    assert not Everything().call("__init__").ok and not Everything().call("refusal").ok
