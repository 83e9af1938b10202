"""Statuses of nodes from measured figures."""

from __future__ import annotations

import dataclasses

import pytest

from quad_nav.navigator.tick import State
from quad_nav.topics.health import (
    Control,
    Input,
    Level,
    LevelChange,
    Loop,
    change_lines,
    control_health,
    inputs_health,
    logged_name,
    loop_health,
)

SCAN = Input("/scan0", 10.0, 0.05, 0.01, 1.0)
ODOM = Input("/odom0", 40.0, 0.02, 0.0, 3.0)
REASON = "no plan: the goal is off the map"
CONTROL = Control(State.CONTROLLING, 9.6, 10.0, 0, "", False, REASON, 12.5)
LOOP = Loop(8, 0.02, 0.0, 0.4, 190.0)


def changed(one, **fields):
    return dataclasses.replace(one, **fields)


@pytest.mark.parametrize(
    "odom_s, scan_s, is_localized, level, message",
    [
        (0.02, 1.0, True, Level.OK, "all inputs arriving"),
        (0.02, None, True, Level.STALE, "no message yet on /scan0"),
        (1.5, 1.5, True, Level.ERROR, "no message on /scan0 for 1.5 s"),
        (None, 1.04, True, Level.ERROR, "no message on /scan0 for 1.0 s"),
        (0.02, 0.05, False, Level.ERROR, "robot pose unknown, check /tf"),
    ],
)
def test_inputs(odom_s, scan_s, is_localized, level, message):
    inputs = [changed(ODOM, silent_s=odom_s), changed(SCAN, silent_s=scan_s)]
    health = inputs_health("move_base0", "quad0", inputs, is_localized)
    assert (health.name, health.hardware_id) == ("move_base0: inputs", "quad0")
    assert (health.level, health.message) == (level, message)
    silent = "" if odom_s is None else f"{odom_s:.2f}"
    expected = {"located": str(is_localized), "/odom0 silent s": silent, "/scan0 late s": "0.010"}
    assert {**health.values, **expected} == health.values


@pytest.mark.parametrize(
    "fields, level, message",
    [
        ({}, Level.OK, "controlling at 9.6 Hz"),
        ({"state": State.IDLE, "rate_hz": 0.0}, Level.OK, "idle"),
        ({"rate_hz": 4.0, "slow_seconds": 2}, Level.OK, "controlling at 4.0 Hz"),
        ({"rate_hz": 4.0, "slow_seconds": 3}, Level.WARN, "controlling at 4.0 Hz, expected 10 Hz"),
        ({"state": State.CLEARING}, Level.WARN, "clearing at 9.6 Hz: recovery behaviour active"),
        # The level does not depend on the wording.
        ({"fault": "stopping: said"}, Level.WARN, "controlling: stopping: said"),
        ({"fault": "no data", "is_stopped": True}, Level.ERROR, "controlling: no data"),
    ],
)
def test_control(fields, level, message):
    health = control_health("move_base0", "quad0", changed(CONTROL, **fields))
    assert (health.level, health.message) == (level, message)
    assert (health.values["last reason"], health.values["last reason at s"]) == (REASON, "12.50")


@pytest.mark.parametrize(
    "fields, level, message",
    [
        ({}, Level.OK, "serving 8 robots"),
        ({"late_s": 0.5}, Level.WARN, "up to 0.50 s late, skipping control cycles"),
        ({"late_s": 0.5, "blocked_s": 7.0}, Level.ERROR, "control loop blocked for 7 s"),
    ],
)
def test_loop(fields, level, message):
    health = loop_health("fleet0", changed(LOOP, **fields))
    assert (health.name, health.hardware_id) == ("fleet0: loop", "fleet0")
    assert (health.level, health.message) == (level, message)
    assert loop_health("move_base0", LOOP, "quad0").hardware_id == "quad0"


def test_log_lines_of_a_navigator_begin_with_the_robot():
    assert logged_name("move_base0: inputs", "quad0") == "quad0: inputs"
    assert logged_name("fleet0: loop", "fleet0") == "fleet0: loop"


def test_the_same_change_of_many_robots_is_one_line():
    slow, blind = "controlling at 6.8 Hz, expected 10 Hz", "no message on /scan1 for 2.0 s"
    changes = [
        *(LevelChange(f"quad{n}: control", Level.OK, Level.WARN, slow) for n in range(4)),
        LevelChange("quad1: inputs", Level.OK, Level.ERROR, blind),
        LevelChange("fleet0: loop", Level.WARN, Level.OK, "serving 8 robots"),
        LevelChange("quad7: control", Level.OK, Level.WARN, slow),
        LevelChange("quad8: control", Level.ERROR, Level.WARN, slow),
    ]
    assert change_lines(changes) == [
        (Level.WARN, f"quad0 to quad3, quad7: control: OK -> WARN: {slow}"),
        (Level.ERROR, f"quad1: inputs: OK -> ERROR: {blind}"),
        (Level.OK, "fleet0: loop: WARN -> OK: serving 8 robots"),
        (Level.WARN, f"quad8: control: ERROR -> WARN: {slow}"),
    ]
