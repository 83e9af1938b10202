"""Missions that another sequencer resumes from their journals."""

from __future__ import annotations

import json

import pytest
from test_summary import add_pose

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.mission.actions import GoalEnded, SendGoal, SequenceDone
from quad_nav.mission.checkpoint import (
    contact_record,
    head_record,
    read_checkpoint,
    robot_record,
)
from quad_nav.mission.flight_log import FlightLog
from quad_nav.mission.goal import Goal
from quad_nav.mission.goal_file import GoalSequence, SequenceSettings
from quad_nav.mission.sequencer import Dwell, Sequencer
from quad_nav.sim.contacts import Contact

A, B, C = Goal(3.0, 0.0), Goal(3.0, 4.0), Goal(0.0, 4.0, 1.5)
START = Pose2D(0.0, 0.0)
START_S = 100.0
NAMES = ["quad0", "quad1"]


class JournaledRobot:
    """Quadcopter 0 of two, with a journal; every record goes through JSON text."""

    def __init__(self, *goals, **settings):
        self.log = FlightLog(NAMES, 0.3)
        self.sequencer = Sequencer(GoalSequence(goals or (A, B, C), SequenceSettings(**settings)))
        self.records = [head_record(NAMES, START_S, 1e9)]

    def fly(self, now_s, pose):
        add_pose(self.log, "quad0", now_s, pose)
        actions = self.sequencer.tick(now_s, pose)
        legs = [leg for leg in map(self.log.robots["quad0"].add_action, actions) if leg is not None]
        if actions:
            record = robot_record(
                "quad0", self.sequencer, self.log, legs[0] if legs else None, START_S
            )
            self.records.append({**record, "mission_s": now_s - START_S, "wall_s": 7.0})
        return actions

    def checkpoint(self):
        return read_checkpoint(json.loads(json.dumps(self.records)), NAMES, "journal")

    def taken_over(self, start_s=START_S, *goals, **settings):
        """Another sequencer and log."""
        checkpoint = self.checkpoint().robots["quad0"]
        log = FlightLog(NAMES, 0.3)
        log.resume("quad0", checkpoint.log, checkpoint.clearance_m, checkpoint.separation_m)
        other = JournaledRobot(*goals, **settings)
        other.sequencer = Sequencer(other.sequencer.sequence, checkpoint.progress.shifted(start_s))
        other.log = log
        return other


def a_mission_on_its_second_goal():
    mission = JournaledRobot()
    mission.fly(100.0, START)
    mission.fly(105.0, Pose2D(1.5, 0.0))
    mission.fly(110.0, Pose2D(2.8, 0.0))  # within 0.4 m of A
    return mission


def test_the_active_goal_is_sent_again_without_counting_an_attempt():
    mission = a_mission_on_its_second_goal()
    later = mission.taken_over()
    (sent,) = later.fly(120.0, Pose2D(2.9, 1.0))
    assert isinstance(sent, SendGoal)
    assert (sent.index, sent.attempt, sent.resend_reason) == (
        1,
        1,
        "the sequencer or the clock restarted",
    )
    assert sent.pose == mission.sequencer.active_goal.pose
    assert later.fly(121.0, Pose2D(2.9, 1.1)) == []
    ended, after = later.fly(125.0, Pose2D(3.0, 3.9))
    assert ended == GoalEnded(1, 1, B, True, 15.0, 1) and after.index == 2


def test_a_goal_that_was_reached_without_a_sequencer_is_not_flown_again():
    later = a_mission_on_its_second_goal().taken_over()
    ended, sent = later.fly(150.0, Pose2D(3.0, 4.1))
    assert ended == GoalEnded(1, 1, B, True, 40.0, 1)
    assert (sent.index, sent.resend_reason) == (2, "")


def test_times_continue_on_a_new_clock():
    later = a_mission_on_its_second_goal().taken_over(start_s=-10.0)  # 10 s flown, now it is 0
    later.fly(0.5, START)
    ended, _ = later.fly(20.0, Pose2D(3.0, 4.0))
    assert ended.time_s == pytest.approx(20.0)


def test_the_figures_add_up():
    later = a_mission_on_its_second_goal().taken_over()
    later.fly(121.0, Pose2D(2.8, 2.0))  # straight there without a sequencer
    later.fly(122.0, Pose2D(2.8, 4.0))
    first, second = later.log.robots["quad0"].legs
    assert (first.goal, first.path_length_m, first.time_s) == (A, pytest.approx(2.8), 10.0)
    assert (second.goal, second.path_length_m) == (B, pytest.approx(4.0))
    assert second.straight_length_m == pytest.approx(4.0)
    assert later.log.robots["quad0"].path_length_m == pytest.approx(6.8)


def test_smallest_distances_are_resumed():
    mission = a_mission_on_its_second_goal()
    mission.records[-1].update(clearance_m=0.25, separation_m=1.5)
    log = mission.taken_over().log
    assert (
        log.distances.min_clearance_m("quad0") == 0.25
        and log.distances.min_separation_m("quad0") == 1.5
    )
    assert log.distances.min_clearance_m("quad1") is None


def test_a_completed_mission_is_not_flown_again():
    mission = JournaledRobot(A)
    mission.fly(100.0, START)
    mission.fly(110.0, Pose2D(3.0, 0.0))
    later = mission.taken_over(START_S, A)
    assert later.fly(120.0, START) == [SequenceDone()]
    assert later.sequencer.done and len(later.log.robots["quad0"].legs) == 1


def test_laps_and_attempts_continue():
    mission = JournaledRobot(A, B, loop=True, goal_timeout_s=5.0)
    for now_s, pose in ((100.0, START), (101.0, A.pose), (102.0, B.pose), (108.0, B.pose)):
        mission.fly(now_s, pose)
    assert mission.sequencer.active_goal.attempt == 2
    later = mission.taken_over(START_S, A, B, loop=True, goal_timeout_s=5.0)
    (sent,) = later.fly(109.0, B.pose)
    assert (sent.index, sent.lap, sent.attempt) == (0, 2, 2)


def test_a_goal_file_edited_meanwhile_applies_from_the_active_goal():
    edited = Goal(5.0, 5.0)
    later = a_mission_on_its_second_goal().taken_over(START_S, A, edited, C)
    (sent,) = later.fly(120.0, Pose2D(2.8, 0.0))
    assert (sent.index, sent.resend_reason, sent.pose.x_m) == (1, "", 5.0)


def test_contacts_and_times_are_resumed():
    mission = a_mission_on_its_second_goal()
    contact = Contact(103.5, "quad0", "box", 1.0, 2.0)
    mission.records.append({**contact_record(contact, START_S), "mission_s": 12.0, "wall_s": 8.0})
    checkpoint = mission.checkpoint()
    assert checkpoint.contacts == (Contact(3.5, "quad0", "box", 1.0, 2.0),)
    assert (checkpoint.clock_s, checkpoint.epoch_s, checkpoint.mission_s, checkpoint.wall_s) == (
        100.0,
        1e9,
        12.0,
        8.0,
    )
    assert checkpoint.robots["quad1"].progress.index == 0


def test_a_journal_without_robots_has_no_checkpoint():
    assert read_checkpoint([], NAMES, "journal") is None
    assert read_checkpoint([head_record(NAMES, 0.0, 0.0)], NAMES, "journal") is None


def test_another_missions_journal_is_refused():
    with pytest.raises(
        InputError,
        match=r"journal: is the journal of \['quad0', 'quad1'\]; "
        r"expected one of \['quad0'\]",
    ):
        read_checkpoint(a_mission_on_its_second_goal().records, ["quad0"], "journal")


def test_a_dwell_continues_on_a_new_clock():
    stay = Goal(3.0, 0.0, wait_s=20.0)
    mission = JournaledRobot(stay, B)
    mission.fly(100.0, START)
    mission.fly(110.0, A.pose)
    later = mission.taken_over(-10.0, stay, B)  # 10 s flown, now it is 0
    assert later.sequencer.dwell == Dwell(stay, 0.0)
    assert later.fly(19.9, A.pose) == []
    (sent,) = later.fly(20.0, A.pose)
    assert (sent.index, sent.resend_reason) == (1, "")
    # A wait that was edited meanwhile applies.
    shorter = mission.taken_over(START_S, Goal(3.0, 0.0, wait_s=1.0), B)
    assert len(shorter.fly(111.0, A.pose)) == 1


def test_a_stop_continues_on_a_new_clock():
    mission = a_mission_on_its_second_goal()  # sent at 110 s
    mission.sequencer.hold(112.0)
    mission.fly(113.0, Pose2D(2.8, 0.0))
    record = robot_record("quad0", mission.sequencer, mission.log, None, START_S)
    mission.records.append({**record, "mission_s": 20.0, "wall_s": 9.0})
    later = mission.taken_over(-20.0)  # 20 s of the mission have passed, now it is 0
    assert later.sequencer.held_s == -8.0
    assert later.fly(30.0, Pose2D(2.8, 0.0)) == []
    later.sequencer.release(30.0)
    later.fly(30.0, Pose2D(2.8, 0.0))
    ended, _ = later.fly(33.0, B.pose)
    assert ended.time_s == pytest.approx(2.0 + 3.0)


def test_the_latest_record_tells_how_long_a_mission_lasts():
    """Two robots' threads may add their records in the other order."""
    mission = a_mission_on_its_second_goal()
    mission.records.append({**mission.records[-1], "leg": None, "mission_s": 9.8})
    assert mission.checkpoint().mission_s == 10.0


def test_journals_of_older_versions_are_resumed():
    mission = JournaledRobot(C, A)
    mission.fly(100.0, START)
    mission.fly(110.0, C.pose)
    for record in mission.records[1:]:
        del record["dwell"], record["held_s"]
        for part in (record["active_goal"]["goal"], *([record["leg"]] if record["leg"] else [])):
            for key in ("wait_s", "tolerance_m", "yaw_tolerance_rad", "yaw_error_rad"):
                part.pop(key, None)
                part.get("goal", {}).pop(key, None)
    later = mission.taken_over(START_S, C, A)
    assert (later.log.robots["quad0"].legs[0].goal, later.sequencer.active_goal.goal) == (C, A)


@pytest.mark.parametrize(
    "change",
    [
        {"index": -1},
        {"index": 0.5},
        {"lap": 0},
        {"log": []},
        {"active_goal": {"goal": 3}},
        {"dwell": {"since_s": 1.0}},
        {"held_s": "1"},
        {"leg": "none"},
        {"robot": "quad7"},
        {"contact": [1, 2, 3, 4, 5]},
        {"separation_m": [1.0]},
        {"mission_s": "nan"},
    ],
    ids=str,
)
def test_invalid_records_are_refused(change):
    mission = a_mission_on_its_second_goal()
    mission.records[-1].update(change)
    with pytest.raises(InputError, match="journal: cannot be read"):
        mission.checkpoint()


@pytest.mark.parametrize("part", ["active_goal", "log"])
@pytest.mark.parametrize(
    "value", ["1", [], {}, True, float("nan"), float("-inf"), 10**400], ids=lambda v: repr(v)[:9]
)
def test_every_value_of_a_record_is_checked(part, value):
    """A value of the wrong type would end the flight later, where it is used."""
    for key in a_mission_on_its_second_goal().records[-1][part]:
        if (key, value) in (("replaced", True), ("log", {})):
            continue
        mission = a_mission_on_its_second_goal()
        mission.records[-1][part][key] = value
        with pytest.raises(InputError, match="journal: cannot be read"):
            read_checkpoint(mission.records, NAMES, "journal")
