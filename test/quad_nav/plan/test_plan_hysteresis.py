"""Plan hysteresis: a robot keeps its way until all plans have led another way for some time."""

from __future__ import annotations

import numpy as np

from quad_nav.geometry import Pose2D
from quad_nav.navigator.plan_hysteresis import PlanHysteresis

DELAY_S = 1.0
SAME_WAY_M = 0.25
START = Pose2D(0.0, 0.0)


def way(bulge_m, end_x_m=4.0):
    """A plan along x to (end_x_m, 0), whose middle is off the x axis by bulge_m."""
    x = np.linspace(0.0, end_x_m, 81)
    return np.column_stack([x, bulge_m * np.sin(np.pi * x / end_x_m), np.zeros(81)])


def choose(hysteresis, plan, now_s, pose=START):
    return hysteresis.choose(plan, now_s, pose, DELAY_S, SAME_WAY_M)


def test_the_first_plan_and_plans_along_the_same_way_are_taken():
    hysteresis = PlanHysteresis()
    for now_s, bulge_m in enumerate((0.0, 0.2, 0.4)):  # each at most 0.25 m from the one before
        plan = way(bulge_m)
        assert choose(hysteresis, plan, float(now_s)) is plan


def test_a_way_that_opens_and_closes_keeps_the_current_plan():
    hysteresis = PlanHysteresis()
    for step in range(20):
        choose(hysteresis, way(0.0), step * 1.0)
        chosen = choose(hysteresis, way(1.0), step * 1.0 + 0.5)
        np.testing.assert_array_equal(chosen, way(0.0))


def test_another_way_is_taken_after_the_delay():
    hysteresis = PlanHysteresis()
    choose(hysteresis, way(0.0), 0.0)
    other = way(1.0)
    taken = [choose(hysteresis, other, now_s) is other for now_s in (0.25, 0.5, 1.0, 1.25, 1.5)]
    assert taken == [False, False, False, True, True]


def test_a_kept_plan_begins_where_the_robot_is():
    hysteresis = PlanHysteresis()
    choose(hysteresis, way(0.0), 0.0)
    kept = choose(hysteresis, way(1.0), 0.5, Pose2D(1.0, 0.05))
    np.testing.assert_allclose(kept[0, :2], [1.0, 0.0])
    assert len(kept) == 61


def test_a_plan_to_another_end_is_taken():
    hysteresis = PlanHysteresis()
    choose(hysteresis, way(0.0), 0.0)
    other = way(1.0, end_x_m=3.0)
    assert choose(hysteresis, other, 0.5) is other


def test_after_trouble_any_plan_is_taken():
    hysteresis = PlanHysteresis()
    choose(hysteresis, way(0.0), 0.0)
    hysteresis.forget()
    other = way(1.0)
    assert choose(hysteresis, other, 0.5) is other
