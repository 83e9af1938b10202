"""Ids of goals: a result belongs to the goal that the navigator names."""

from __future__ import annotations

from quad_nav.mission.goal_ids import GoalIds, Owner

ACTIVE, EARLIER, OTHER = Owner.ACTIVE, Owner.EARLIER, Owner.OTHER


def flying():
    """The first goal was sent at 10 s and has the id "a"."""
    ids = GoalIds()
    ids.send(10.0)
    assert ids.see("a", 10.01) is ACTIVE
    return ids


def test_the_result_of_a_goal_that_has_ended_is_not_that_of_the_next():
    """As after a hang: "a" succeeded at 19.9 s, and the result comes after the next goal."""
    ids = flying()
    ids.send(20.0)
    assert ids.see("a", 10.01) is EARLIER
    assert ids.see("b", 20.02) is ACTIVE
    assert ids.see("a", 10.01) is EARLIER


def test_it_is_not_even_if_both_goals_were_sent_within_the_clocks_lag():
    ids = flying()
    ids.send(10.1)
    assert ids.see("a", 10.01) is EARLIER
    assert ids.see("b", 10.12) is ACTIVE


def test_an_id_from_before_the_first_goal_is_of_another_node():
    ids = GoalIds()
    assert ids.see("rviz", 5.0) is OTHER
    ids.send(10.0)
    assert ids.see("rviz", 5.0) is OTHER
    assert ids.see("older", 9.4) is OTHER
    assert ids.see("a", 9.6) is ACTIVE  # a clock that lags by 0.4 s


def test_a_goal_of_another_node_after_ours():
    ids = flying()
    assert ids.see("rviz", 12.0) is OTHER
    assert ids.see_replaced("a", 10.01) is ACTIVE
    assert ids.see("rviz", 12.0) is OTHER


def test_after_the_last_goal_nothing_is_ours():
    ids = flying()
    ids.clear()
    assert ids.see("rviz", 12.0) is OTHER
    assert ids.see("a", 10.01) is EARLIER


def test_a_goal_that_was_replaced_before_its_id_was_known():
    """Two goals are sent within milliseconds; the first thing heard is that "a" was replaced."""
    ids = GoalIds()
    ids.send(10.0)
    ids.send(10.02)
    assert ids.see_replaced("a", 10.01) is EARLIER
    assert ids.see("b", 10.03) is ACTIVE


def test_a_goal_that_ended_before_its_id_was_known():
    """As where a stop overtakes it."""
    ids = flying()
    ids.send(20.0)
    ids.clear()
    assert ids.see("rviz", 25.0) is OTHER
    assert ids.see("late", 20.02) is EARLIER
    assert ids.see("rviz 2", 20.03) is OTHER


def test_a_restarted_navigator_gives_the_goal_another_id():
    ids = flying()
    ids.resend(15.0)
    assert ids.see("a", 10.01) is ACTIVE  # the new subscriber may be no navigator
    assert ids.see("new", 15.2) is ACTIVE
    assert ids.see("a", 10.01) is EARLIER
    assert ids.see("rviz", 16.0) is OTHER


def test_a_new_subscriber_that_is_no_navigator_changes_nothing():
    ids = flying()
    ids.resend(15.0)
    assert ids.see("rviz", 25.0) is OTHER
    assert ids.see("a", 10.01) is ACTIVE
