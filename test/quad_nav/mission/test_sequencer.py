"""Sequencer: the actions for each event."""

import math

import pytest

from quad_nav.geometry import Pose2D
from quad_nav.mission.actions import GoalEnded, SendGoal, SequenceDone
from quad_nav.mission.goal import Goal
from quad_nav.mission.goal_file import GoalSequence, SequenceSettings
from quad_nav.mission.sequencer import Dwell, NavigatorReport, Sequencer, Verdict

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


# Goals with a yaw: (0, 8), facing -1 rad.


def facing(yaw_rad, off_m=0.0):
    return Pose2D(C.x_m + off_m, C.y_m, yaw_rad)


def test_a_goal_with_a_yaw_is_reached_in_position_and_yaw():
    s = flying(C, yaw_tolerance_rad=0.05)
    assert s.tick(1.0, facing(-1.0, off_m=0.41)) == []  # the yaw alone
    assert s.tick(2.0, facing(-0.94)) == []  # the position alone
    ended, done = s.tick(3.0, facing(-1.04, off_m=0.4))
    assert (ended.reached, ended.time_s, done) == (True, 3.0, SequenceDone())
    assert ended.yaw_error_rad == pytest.approx(-0.04)


def test_the_error_of_a_yaw_does_not_count_full_turns():
    s = flying(Goal(0.0, 8.0, 2 * math.pi - 0.01), yaw_tolerance_rad=0.05)
    assert s.tick(1.0, facing(0.02))[0].yaw_error_rad == pytest.approx(0.03)


def test_without_a_yaw_only_the_position_counts():
    for goal in (Goal(0.0, 8.0), Goal(0.0, 8.0, yaw_tolerance_rad=0.01)):
        assert flying(goal).tick(1.0, facing(3.0))[0].yaw_error_rad is None


def test_a_goal_has_tolerances_of_its_own():
    s = flying(Goal(0.0, 8.0, -1.0, tolerance_m=0.1, yaw_tolerance_rad=0.5))
    assert s.tick(1.0, facing(-1.0, off_m=0.11)) == []
    assert s.tick(2.0, facing(-0.6, off_m=0.1))[0].reached
    s = flying(Goal(0.0, 8.0, tolerance_m=0.1), retries=0)
    ended = s.tick(1.0, facing(0.0, off_m=0.15), [SUCCEEDED])[0]
    assert ended.reason == "the navigator stopped 0.15 m from it (tolerance 0.10 m)"


def test_a_navigator_that_stops_beside_the_yaw_may_settle():
    s = flying(C, yaw_tolerance_rad=0.05)
    assert s.tick(5.0, facing(-0.93), [SUCCEEDED]) == []
    assert s.tick(5.9, facing(-0.94)) == []
    assert s.tick(5.95, facing(-0.96))[0].reached


def test_a_navigator_that_stays_beside_the_yaw_gets_the_goal_again_then_it_is_skipped():
    s = flying(C, yaw_tolerance_rad=0.05, retries=1)
    assert s.tick(5.0, facing(-0.93), [SUCCEEDED]) == []
    reason = "the navigator stopped at it with a yaw error of 0.07 rad (yaw_tolerance 0.05 rad)"
    assert s.tick(6.0, facing(-0.93)) == [SendGoal(0, 1, C.pose, 2, reason)]
    assert s.tick(6.5, facing(-0.93), [SUCCEEDED]) == []
    ended = s.tick(7.5, facing(-0.93))[0]
    assert (ended.reached, ended.attempts, ended.reason) == (False, 2, reason)
    assert ended.yaw_error_rad == pytest.approx(0.07)


def test_a_goal_whose_yaw_is_not_reached_in_time_says_so():
    s = flying(C, goal_timeout_s=30.0, retries=0)
    ended = s.tick(30.0, facing(0.5))[0]
    assert ended.reason == (
        "not reached in 30 s, at it with a yaw error of 1.50 rad (yaw_tolerance 0.10 rad)"
    )


# Goals at which the robot stays.

STAY = Goal(3.0, 4.0, wait_s=5.0)


def test_the_next_goal_is_sent_after_the_dwell():
    s = flying(STAY, B)
    assert s.tick(20.0, at(STAY, 0.3)) == [GoalEnded(0, 1, STAY, True, 20.0, 1)]
    assert (s.dwell, s.active_goal, s.index) == (Dwell(STAY, 20.0), None, 1)
    assert s.tick(24.9, at(STAY), [SUCCEEDED], navigator_idle=True) == []
    (sent,) = s.tick(25.0, at(STAY, 2.0), [NavigatorReport(Verdict.OTHER_ENDED)])
    assert (sent.index, s.dwell) == (1, None)
    # The dwell does not count for the time of the next goal.
    assert s.tick(31.0, at(B))[0].time_s == 6.0


def test_the_mission_ends_after_the_last_dwell():
    s = flying(STAY)
    assert len(s.tick(1.0, at(STAY))) == 1 and not s.done
    assert s.tick(5.9, at(STAY)) == [] and not s.done
    assert s.tick(6.0, at(STAY)) == [SequenceDone()] and s.done


def test_a_lap_ends_after_the_last_dwell():
    s = flying(B, STAY, loop=True)
    s.tick(1.0, at(B))
    s.tick(2.0, at(STAY))
    assert (s.index, s.lap) == (2, 1)
    (sent,) = s.tick(7.0, at(STAY))
    assert (sent.index, sent.lap) == (0, 2)


def test_a_robot_does_not_stay_at_a_goal_that_is_skipped():
    s = flying(STAY, B, retries=0)
    assert [type(one) for one in s.tick(1.0, START, [ABORTED])] == [GoalEnded, SendGoal]


def test_a_dwell_counts_as_time_of_no_attempt():
    s = flying(Goal(3.0, 4.0, wait_s=500.0), B, goal_timeout_s=30.0)
    s.tick(1.0, at(STAY))
    assert s.tick(500.0, at(STAY)) == []


@pytest.mark.parametrize("wait_s, until_s", [(0.0, 2.0), (2.5, 3.5), (9.0, 10.0)])
def test_an_edited_wait_applies_to_the_dwell(wait_s, until_s):
    s = flying(STAY, B)
    s.tick(1.0, at(STAY))
    s.replace_sequence(GoalSequence((Goal(3.0, 4.0, wait_s=wait_s), B)))
    if until_s > 2.0:
        assert s.tick(until_s - 0.01, at(STAY)) == []
    assert s.tick(until_s, at(STAY))[0].index == 1


def test_an_edit_that_moves_the_goal_leaves_its_dwell():
    s = flying(STAY, B)
    s.tick(1.0, at(STAY))
    s.replace_sequence(GoalSequence((Goal(9.0, 9.0), C)))
    assert s.tick(5.9, at(STAY)) == []
    assert s.tick(6.0, at(STAY))[0].pose == C.pose


def test_edited_settings_of_the_active_goal_apply_without_sending_it_again():
    s = flying(A, B)
    s.replace_sequence(GoalSequence((Goal(3.0, 4.0, wait_s=5.0, tolerance_m=0.1), B)))
    assert s.tick(1.0, at(A, 0.3)) == []
    assert len(s.tick(2.0, at(A, 0.09))) == 1
    assert s.dwell == Dwell(Goal(3.0, 4.0, wait_s=5.0, tolerance_m=0.1), 2.0)


def test_a_stop_lets_no_time_pass():
    s = flying(A, B, goal_timeout_s=30.0, retries=1)
    sent = s.active_goal.pose
    s.hold(10.0)
    assert s.tick(100.0, at(A), [ABORTED], navigator_idle=True) == []
    s.hold(100.0)  # stopped twice
    s.release(200.0)
    assert s.tick(200.0, START) == [SendGoal(0, 1, sent, 1, "the mission was stopped and resumed")]
    assert s.tick(219.9, START) == []
    assert s.tick(220.0, START) == [SendGoal(0, 1, sent, 2, "not reached in 30 s")]
    assert s.tick(225.0, at(A))[0] == GoalEnded(0, 1, A, True, 35.0, 2)


def test_a_resumption_of_what_is_not_stopped_changes_nothing():
    s = flying(A, goal_timeout_s=30.0, retries=0)
    s.release(20.0)
    assert s.tick(20.0, START) == []
    assert s.tick(30.0, START)[0] == GoalEnded(0, 1, A, False, 30.0, 1, "not reached in 30 s")


def test_a_stop_interrupts_a_stay():
    stay = Goal(3.0, 4.0, wait_s=10.0)
    s = flying(stay, B)
    s.tick(5.0, at(stay))
    s.hold(8.0)
    assert s.tick(50.0, at(stay)) == []
    s.release(100.0)
    assert s.dwell == Dwell(stay, 97.0)
    assert s.tick(106.9, at(stay)) == []
    assert [action.index for action in s.tick(107.0, at(stay))] == [1]


@pytest.mark.parametrize("verdict", Verdict)
def test_reports_on_the_goal_that_a_stop_has_cancelled_do_not_count(verdict):
    s = flying(A, B, retries=0)
    s.hold(5.0)
    s.release(6.0)
    (sent,) = s.tick(6.0, START, [NavigatorReport(verdict)])
    assert (sent.index, sent.attempt) == (0, 1) and not s.active_goal.replaced


def test_a_stop_before_the_first_goal_and_of_a_mission_that_has_ended():
    s = sequencer(A)
    s.hold(0.0)
    assert s.tick(5.0, START) == []
    s.release(10.0)
    assert [type(one) for one in s.tick(10.0, START)] == [SendGoal]
    s.tick(12.0, at(A))
    later = Sequencer(s.sequence, s.progress)  # of a sequencer that restarts
    later.hold(20.0)
    assert later.tick(21.0, at(A)) == [SequenceDone()] and later.done


def test_an_edited_file_does_not_end_a_stop():
    s = flying(A)
    s.hold(5.0)
    s.replace_sequence(GoalSequence((B,), SequenceSettings()))
    assert s.tick(10.0, START) == []
    s.release(20.0)
    (sent,) = s.tick(20.0, START)
    assert (sent.pose.y_m, sent.resend_reason, s.active_goal.first_sent_s) == (8.0, "", 20.0)
