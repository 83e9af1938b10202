"""Robots that stood or circled for ever in flights with other people's parameters."""

from __future__ import annotations

from pathlib import Path

import pytest

from quad_nav.navigator.tick import Trigger
from quad_nav.offline.flight import FlightObserver
from quad_nav.offline.run import fly
from quad_nav.scenario.flight_setup import FlightOptions, read_setup

CASES = Path(__file__).parents[2] / "field_cases"


class Recoveries(FlightObserver):
    """Ends a flight at its first recovery behaviour."""

    def __init__(self):
        self.triggers = []

    @property
    def stop_reason(self):
        return "a recovery runs" if self.triggers else ""

    def on_tick(self, robot, tick, located, wall_s):
        self.triggers += [tick.recovery.trigger] if tick.recovery else []


def flown(folder, config, limit_s):
    recoveries = Recoveries()
    options = FlightOptions(
        CASES / folder / "scene.yaml", CASES / folder, config, time_limit_s=limit_s
    )
    return fly(read_setup(options), [recoveries]), recoveries.triggers


@pytest.mark.parametrize("scene, config", [("appears", "cfg_n328"), ("hall", "cfg_n780")])
def test_heavy_obstacle_costs_keep_no_robot_from_its_goal(scene, config):
    """A cost of 100 outweighs 10 m of progress; a tenth of it still outweighs one."""
    folder = f"stuck_factor/{scene}"
    summary, recoveries = flown(folder, CASES / "stuck_factor" / config, 200.0)
    assert summary.success and recoveries == []


def test_a_robot_that_waits_asks_the_one_that_is_idle_on_its_goal_to_make_room():
    """DWA finds no control towards a goal that an idle robot blocks, 2.4 m away."""
    case = "same_goal_dwa"
    summary, recoveries = flown(case, CASES / case / "cfg", 60.0)
    assert summary.success and recoveries == []


def test_a_robot_that_circles_in_a_trap_recovers():
    """It sees 2 m of a wall of 4 m, and flies from one end of what it sees to the other."""
    _, recoveries = flown("wide_trap", "tutorial", 119.0)
    assert recoveries == [Trigger.OSCILLATION]
