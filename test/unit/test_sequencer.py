"""Sequencer: the actions for each event."""

import math

import pytest

from quad_nav.geometry import Pose2D
from quad_nav.mission.goal_file import Goal, GoalSequence, SequenceSettings
from quad_nav.mission.sequencer import (
    GoalEnded,
    NavigatorReport,
    SendGoal,
    SequenceDone,
    Sequencer,
    Verdict,
)

START = Pose2D(0.0, 0.0, 0.5)
A, B, C = Goal(3.0, 4.0), Goal(3.0, 8.0), Goal(0.0, 8.0, -1.0)
ABORTED = NavigatorReport(Verdict.ABORTED, "no plan")
SUCCEEDED = NavigatorReport(Verdict.SUCCEEDED)


def sequencer(*goals, **settings):
    return Sequencer(GoalSequence(goals or (A, B, C), SequenceSettings(**settings)))


def flying(*goals, **settings):
    """A sequencer that has sent its first goal at 0 s."""
    started = sequencer(*goals, **settings)
    assert len(started.tick(0.0, START)) == 1
    return started


def at(goal, off_m=0.0):
    return Pose2D(goal.x_m + off_m, goal.y_m, 0.0)


def test_goals_are_sent_one_by_one_to_the_end():
    s = sequencer(A, B)
    assert s.tick(10.0, START) == [SendGoal(0, 1, Pose2D(3.0, 4.0, math.atan2(4, 3)), 1)]
    assert s.tick(11.0, START) == []
    assert s.tick(20.0, at(A, 0.3)) == [
        GoalEnded(0, 1, A, True, 10.0, 1),
        SendGoal(1, 1, Pose2D(3.0, 8.0, math.atan2(4, -0.3)), 1),
    ]
    assert not s.done and s.index == 1
    assert s.tick(25.0, at(B)) == [GoalEnded(1, 1, B, True, 5.0, 1), SequenceDone()]
    assert s.done and s.active_goal is None and s.index == 2
    assert s.tick(26.0, START) == []


def test_a_goal_is_reached_at_the_tolerance_and_not_outside_it():
    s = flying(A, goal_tolerance_m=0.25)
    assert s.tick(1.0, at(A, 0.26)) == []
    assert isinstance(s.tick(2.0, at(A, 0.25))[0], GoalEnded)


def test_a_given_yaw_is_sent_and_without_distance_the_robots_own():
    assert sequencer(C).tick(0.0, START)[0].pose == Pose2D(0.0, 8.0, -1.0)
    assert sequencer(Goal(0.0, 0.0)).tick(0.0, START)[0].pose == START


def test_an_aborted_goal_is_sent_again_then_skipped():
    s = flying(A, B, retries=1)
    sent = s.active_goal.pose
    assert s.tick(5.0, at(A, 2.0), [ABORTED]) == [SendGoal(0, 1, sent, 2, "aborted: no plan")]
    assert s.tick(6.0, at(A, 2.0)) == []
    ended, following = s.tick(9.0, at(A, 2.0), [ABORTED])
    assert ended == GoalEnded(0, 1, A, False, 9.0, 2, "aborted: no plan")
    assert following == SendGoal(1, 1, Pose2D(3.0, 8.0, math.atan2(4, -2)), 1)


def test_without_retries_the_first_failure_skips():
    s = flying(A, retries=0)
    assert s.tick(5.0, START, [ABORTED]) == [
        GoalEnded(0, 1, A, False, 5.0, 1, "aborted: no plan"),
        SequenceDone(),
    ]


def test_each_attempt_has_its_own_timeout():
    s = flying(A, goal_timeout_s=30.0, retries=1)
    assert s.tick(29.9, START) == []
    assert s.tick(30.0, START) == [SendGoal(0, 1, s.active_goal.pose, 2, "not reached in 30 s")]
    assert s.tick(59.9, START) == []
    assert s.tick(60.0, START)[0] == GoalEnded(0, 1, A, False, 60.0, 2, "not reached in 30 s")


def test_a_reached_goal_counts_whatever_the_navigator_reports():
    s = flying(A)
    assert s.tick(500.0, at(A), [ABORTED])[0] == GoalEnded(0, 1, A, True, 500.0, 1)


def test_stopping_short_of_the_goal_is_a_failure():
    s = flying(A)
    assert s.tick(5.0, at(A, 0.5), [SUCCEEDED])[0].resend_reason == (
        "the navigator stopped 0.50 m from it (goal_tolerance 0.40 m)"
    )
    assert s.active_goal.attempt == 2


def test_a_cancelled_goal_is_skipped():
    s = flying(A, B)
    ended, following = s.tick(4.0, START, [NavigatorReport(Verdict.CANCELLED)])
    assert ended == GoalEnded(0, 1, A, False, 4.0, 1, "cancelled by another node")
    assert following.index == 1


@pytest.mark.parametrize("outcome", [SUCCEEDED, ABORTED])
def test_another_nodes_goal_is_waited_for_and_costs_no_attempt(outcome):
    s = flying(A)
    assert s.tick(2.0, START, [NavigatorReport(Verdict.REPLACED)]) == []
    assert s.tick(20.0, START) == []
    assert s.tick(21.0, START, [outcome]) == [
        SendGoal(0, 1, s.active_goal.pose, 1, "the navigator has finished another node's goal")
    ]
    assert s.tick(22.0, START, [outcome])[0].attempt == 2


def test_a_navigator_that_lost_its_goal_gets_it_again_in_the_same_attempt():
    s = flying(A, goal_timeout_s=30.0)
    assert s.tick(8.0, START) == []
    assert s.tick(10.0, START, navigator_idle=True) == []
    assert s.tick(12.9, START, navigator_idle=True) == []
    assert s.tick(13.0, START, navigator_idle=True) == [
        SendGoal(0, 1, s.active_goal.pose, 1, "the navigator has had no goal for 5 s")
    ]
    assert s.tick(17.9, START, navigator_idle=True) == []
    assert s.tick(30.0, START)[0].resend_reason == "not reached in 30 s"


def test_looping_counts_laps():
    s = flying(A, B, loop=True)
    s.tick(1.0, at(A))
    ended, following = s.tick(2.0, at(B))
    assert (ended.index, ended.lap) == (1, 1)
    assert (following.index, following.lap) == (0, 2)
    assert (s.index, s.lap, s.done) == (0, 2, False)


def test_an_edit_keeps_an_unchanged_active_goal():
    s = flying(A, B, C)
    s.tick(1.0, at(A))
    s.replace_sequence(GoalSequence((C, B, Goal(9.0, 9.0)), SequenceSettings(retries=0)))
    assert s.tick(2.0, at(A)) == []
    assert s.tick(3.0, at(B))[1].pose.x_m == 9.0
    assert s.sequence.settings.retries == 0


def test_an_edited_active_goal_is_sent_as_a_new_goal():
    s = flying(A, B)
    s.tick(5.0, START, [ABORTED])
    s.replace_sequence(GoalSequence((Goal(5.0, 0.0), B)))
    assert s.tick(6.0, START) == [SendGoal(0, 1, Pose2D(5.0, 0.0, 0.0), 1)]
    assert s.tick(9.0, Pose2D(5.0, 0.0))[0].time_s == 3.0


def test_an_edit_that_removes_the_rest_ends_the_sequence():
    s = flying(A, B, C)
    s.tick(1.0, at(A))
    s.replace_sequence(GoalSequence((A,)))
    assert s.tick(2.0, START) == [SequenceDone()]


def test_goals_appended_after_the_end_are_flown():
    s = flying(A)
    s.tick(1.0, at(A))
    assert s.done
    s.replace_sequence(GoalSequence((A, B)))
    assert s.tick(9.0, at(A)) == [SendGoal(1, 1, Pose2D(3.0, 8.0, math.pi / 2), 1)]


def test_the_end_of_another_nodes_goal_matters_only_if_it_has_replaced_ours():
    other_ended = NavigatorReport(Verdict.OTHER_ENDED)
    s = flying(A)
    assert s.tick(1.0, START, [other_ended]) == []
    assert s.tick(2.0, START, [NavigatorReport(Verdict.REPLACED)]) == []
    (sent,) = s.tick(3.0, START, [other_ended])
    assert (sent.attempt, sent.resend_reason) == (
        1,
        "the navigator has finished another node's goal",
    )
