"""Actions that nobody implements, and those of a page that may only watch."""

from __future__ import annotations

import pytest

from quad_nav.geometry import Pose2D
from quad_web.view.actions import Actions, Answer, GoalFileView, ParameterView, WatchOnly

PARAMETERS = [ParameterView("", "planner_frequency", "double", 1.0, 1.0)]
FILES = [GoalFileView(0, "goals.json", "v1", [(1.0, 2.0, None)])]
CALLS = {
    "start": (),
    "pause": (),
    "reset": (),
    "set_rate": (2.0,),
    "seek": (1.0,),
    "send_goal": (0, Pose2D(1.0, 2.0)),
    "cancel": (0,),
    "stop_all": (),
    "clear_costmaps": (0,),
    "enable_lidar": (0, True),
    "set_parameters": (0, "", {"planner_frequency": 2.0}),
    "save_goals": (0, "v1", []),
}
READS = {"parameters", "goal_files", "check_goals"}


class Everything(Actions):
    """Can do everything and counts what it did."""

    available = frozenset(CALLS)

    def __init__(self):
        self.done = []

    def __getattribute__(self, name):
        if name in CALLS:
            return lambda *args: self.done.append(name) or Answer(True, name)
        return super().__getattribute__(name)

    def parameters(self, robot):
        return PARAMETERS

    def goal_files(self):
        return FILES


def test_every_action_is_listed_here():
    methods = {
        name for name in vars(Actions) if callable(getattr(Actions, name)) and name[0] != "_"
    }
    assert methods == set(CALLS) | READS


@pytest.mark.parametrize("name", CALLS)
def test_who_may_watch_only_is_refused_everything(name):
    steering = Everything()
    watching = WatchOnly(steering)
    answer = getattr(watching, name)(*CALLS[name])
    assert (answer.ok, answer.text) == (False, f"{name}: this page may only watch")
    assert steering.done == []
    assert watching.available == frozenset()
    assert getattr(steering, name)(*CALLS[name]).ok


def test_who_may_watch_only_sees_parameters_and_goals():
    watching = WatchOnly(Everything())
    assert (watching.parameters(0), watching.goal_files()) == (PARAMETERS, FILES)


@pytest.mark.parametrize("name", CALLS)
def test_what_a_source_lacks_is_said(name):
    answer = getattr(Actions(), name)(*CALLS[name])
    assert (answer.ok, answer.text) == (False, f"{name}: not possible here")
