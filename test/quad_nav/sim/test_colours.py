"""Colours of quadcopters are distinct."""

from __future__ import annotations

import itertools
import math

from quad_nav.sim.colours import ROBOT_COLOURS, robot_rgba


def test_sixteen_colours_are_distinct():
    assert len(ROBOT_COLOURS) == 16
    for a, b in itertools.combinations(ROBOT_COLOURS, 2):
        assert math.dist(a, b) > 50


def test_further_colours_differ_from_all_before():
    hundred = [robot_rgba(robot)[:3] for robot in range(100)]
    assert len(set(hundred)) == 100
    assert all(0.0 <= part <= 1.0 for colour in hundred for part in colour)
