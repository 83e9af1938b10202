"""Flight log and summary, with figures that can be computed by hand."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest

from quad_nav.geometry import Pose2D
from quad_nav.mission.actions import SendGoal
from quad_nav.mission.flight_log import FlightLog, Leg, unflown_legs
from quad_nav.mission.goal import Goal
from quad_nav.mission.goal_file import GoalSequence
from quad_nav.mission.sequencer import Sequencer
from quad_nav.mission.summary import (
    MissionSummary,
    RobotSummary,
    summarize,
    summarize_robot,
    to_json,
    write_json,
)
from quad_nav.mission.summary_table import table
from quad_nav.sim.contacts import Contact, ContactLog, Touch
from quad_nav.topics.contacts import contact_fields, contact_from_message

# From (0, 0) over (3, 0) to the goal: 7 m where the straight line has 5 m.
DETOUR = [(0.0, Pose2D(0, 0)), (10.0, Pose2D(3, 0)), (20.0, Pose2D(3, 4))]
GOALS = GoalSequence((Goal(3.0, 4.0), Goal(9.0, 4.0), Goal(9.0, 9.0)))


def add_pose(log, name, now_s, pose):
    log.add_track(name, np.array([now_s]), np.array([(pose.x_m, pose.y_m, pose.yaw_rad)]))


def fly(log, name, sequencer, samples):
    for now_s, pose in samples:
        add_pose(log, name, now_s, pose)
        for action in sequencer.tick(now_s, pose):
            log.robots[name].add_action(action)


def leg(reached=True, **fields):
    return Leg(
        0,
        1,
        Goal(3.0, 4.0),
        reached,
        **{
            "reason": "",
            "attempts": 1,
            "time_s": 10.0,
            "path_length_m": 7.0,
            "straight_length_m": 5.0,
            **fields,
        },
    )


def mission(*legs, **fields):
    return MissionSummary((RobotSummary("quad0", legs or (leg(),), 7.0),), **fields)


def test_legs_measure_the_path_and_the_straight_distance():
    log, sequencer = FlightLog(["quad0"], 0.3), Sequencer(GOALS)
    fly(log, "quad0", sequencer, [*DETOUR, (25.0, Pose2D(5, 4))])
    legs = log.robots["quad0"].all_legs(sequencer, 26.0)
    assert legs[0] == Leg(0, 1, GOALS.goals[0], True, "", 1, 20.0, 7.0, 5.0)
    assert legs[1] == Leg(1, 1, GOALS.goals[1], False, "interrupted", 1, 6.0, 2.0, 2.0)
    assert legs[2] == Leg(2, 1, GOALS.goals[2], False, "not sent", 0)
    robot = summarize_robot(log, "quad0", legs)
    assert (robot.path_length_m, robot.straight_length_m) == (9.0, 7.0)
    assert (robot.reached, robot.skipped) == (1, 0)


def test_the_path_lasts_from_the_first_goal_to_the_last():
    log, sequencer = FlightLog(["quad0"], 0.3), Sequencer(GoalSequence((Goal(3.0, 4.0),)))
    add_pose(log, "quad0", 0.0, Pose2D(-9, 0))
    fly(log, "quad0", sequencer, [(1.0, Pose2D(0, 0))])
    add_pose(log, "quad0", 1.0, Pose2D(5, 0))
    fly(log, "quad0", sequencer, [(2.0, Pose2D(3, 4)), (3.0, Pose2D(3.3, 4))])
    assert sequencer.done
    assert log.robots["quad0"].path_length_m == 5.0


def test_poses_that_are_not_newer_are_ignored():
    log = FlightLog(["quad0"], 0.3)
    log.robots["quad0"].add_action(SendGoal(0, 1, Pose2D(1.0, 0.0), 1))
    log.add_track("quad0", np.array([1.0, 2.0, 1.5, 3.0]), np.diag([0.0, 1.0, 1.0, 1.0])[:, :3])
    assert log.robots["quad0"].path_length_m == pytest.approx(1.0 + 1.0)


def test_a_contact_that_is_reported_again_or_by_both_robots_counts_once():
    log = FlightLog(["quad0", "quad1"], 0.3)
    assert log.add_contact(Contact(5.0, "quad0", "quad1", 1.0, 2.0))
    assert not log.add_contact(Contact(5.01, "quad1", "quad0", 1.0, 2.0))
    assert log.add_contact(Contact(5.6, "quad0", "quad1", 1.0, 2.0))
    assert not log.add_contact(Contact(5.0, "quad0", "quad1", 1.0, 2.0))
    assert log.add_contact(Contact(5.6, "quad0", "pillar", 1.0, 2.0))
    assert log.contacts_of("quad0") == 3 and log.contacts_of("quad1") == 2


@pytest.mark.parametrize(
    "period_s, contacts",
    [(0.7, 5), (0.4, 1)],
    ids=["apart", "lasting"],
)
def test_both_shells_count_the_same_contacts(period_s, contacts):
    """Offline the flight log gets the simulation's contacts, under ROS their messages."""
    simulation = ContactLog()
    offline, ros = FlightLog(["quad0"], 0.3), FlightLog(["quad0"], 0.3)
    for count in range(5):
        for contact in simulation.update(
            1.0 + count * period_s, [Touch(0, "pillar", (1.0, 2.0, 1.0))]
        ):
            offline.add_contact(contact)
            message = SimpleNamespace(**contact_fields(contact))
            ros.add_contact(contact_from_message(message, contact.time_s + 4321.0))
            ros.add_contact(contact_from_message(message, contact.time_s + 4321.0))  # sent twice
    assert len(offline.contacts) == len(ros.contacts) == contacts


CONTACT = Contact(5.0, "quad0", "pillar", 1.0, 2.0)


@pytest.mark.parametrize(
    "summary, status",
    [
        (mission(), 0),
        (mission(leg(), leg(False, reason="aborted")), 1),
        (mission(contacts=(CONTACT,)), 1),
        (mission(reason="interrupted"), 130),
        (mission(reason="time limit of 5 s"), 1),
        (mission(problems=("f.json: goals: is empty",)), 2),
    ],
)
def test_only_a_complete_flight_without_contact_is_a_success(summary, status):
    assert summary.exit_status == status
    assert summary.success is (status == 0)


LONG_REASON = "aborted: Failed to find a valid plan. Even after executing recovery behaviors."
SUMMARY = mission(
    leg(),
    leg(False, reason=LONG_REASON, attempts=2),
    Leg(2, 1, Goal(9.0, 9.0), False, "not sent", 0),
    contacts=(CONTACT,),
    sim_time_s=20.0,
    wall_time_s=10.0,
)


def test_the_table_ends_with_the_errors_of_localized_robots():
    figures = {
        "position_error_m": {"median": 0.0164, "p95": 0.035},
        "yaw_error_rad": {"median": 0.002, "p95": 0.01},
    }
    *before, last = table(mission(leg(), facts={"localization": figures})).splitlines()
    assert before[-1].startswith("Mission succeeded")
    assert last == (
        "Localization: 0.016 m and 0.002 rad from the truth, in 95 % of the time below 0.035 m and"
        " 0.010 rad."
    )
    assert "Localization" not in table(mission(leg(), facts={"localization": None}))


def test_the_table_has_figures_and_reasons():
    text = table(SUMMARY)
    assert max(map(len, text.splitlines())) <= 100
    assert f"quad0: goal 1: {LONG_REASON}" in text
    assert "interrupted" in table(mission(leg(False, reason="interrupted")))
    assert "pillar" in text and "not sent" in text and "1.40" in text
    for head in ("path (m)", "detour", "recoveries", "contacts", "attempts", "separation (m)"):
        assert head in text
    assert text.splitlines()[-1] == (
        "Mission FAILED: 1 of 3 goals reached, 1 contact in 20.0 s "
        "(wall 10.0 s, real-time factor 2.00)."
    )
    assert table(SUMMARY, 80).endswith("20.0 s (wall 10.0 s,\nreal-time factor 2.00).")


def test_goals_with_a_yaw_have_its_error():
    log = FlightLog(["quad0"], 0.3)
    goals = (Goal(3.0, 4.0, 1.0), Goal(9.0, 4.0), Goal(9.0, 9.0, -3.0), Goal(9.0, 9.0, 0.0))
    sequencer = Sequencer(GoalSequence(goals))
    fly(log, "quad0", sequencer, [(0.0, Pose2D(0, 0)), (9.0, Pose2D(3, 4, 0.92))])
    fly(log, "quad0", sequencer, [(12.0, Pose2D(9, 4, 2.0)), (15.0, Pose2D(9, 8, 3.0))])
    legs = log.robots["quad0"].all_legs(sequencer, 20.0)
    errors = (-0.08, None, 6.0 - 2 * math.pi, None)  # reached, without, interrupted, not sent
    assert [one.yaw_error_rad for one in legs] == [
        None if error is None else pytest.approx(error) for error in errors
    ]
    summary = summarize(log, {"quad0": sequencer}, 20.0, sim_time_s=20.0, wall_time_s=1.0)
    assert to_json(summary)["robots"][0]["goals"][0]["yaw_error_rad"] == -0.08
    text = table(summary)
    assert "yaw error" in text and "-0.08" in text and "-0.28" in text
    assert "yaw error" not in table(SUMMARY)


def test_a_narrow_terminal_drops_columns_and_names_them():
    goals, robots, *_ = table(SUMMARY, 60).split("\n\n")
    lines = goals.splitlines()
    assert lines[0].split() == "robot goal x (m) y (m) result time (s) path (m)".split()
    assert lines[-2] == "Not shown in 60 columns: attempts, straight (m), detour"
    assert max(map(len, lines[:-1])) <= 60
    heads = robots.splitlines()[1].split()
    assert heads == "robot reached contacts clearance (m) separation (m)".split()
    assert "Not shown in 60 columns: skipped, recoveries, path (m), detour" in robots


def test_columns_that_matter_most_are_never_dropped():
    assert table(SUMMARY, 10).splitlines()[0].split() == "robot goal result time (s)".split()


DOCUMENTED = {
    "success": False,
    "exit_status": 1,
    "reason": "",
    "problems": [],
    "airframe": None,
    "sim_time_s": 20.0,
    "wall_time_s": 10.0,
    "real_time_factor": 2.0,
    "robot_radius_m": 0.3,
    "robots": [
        {
            "robot": "quad0",
            "reason": "",
            "goals": [
                {
                    "goal": 1,
                    "lap": 1,
                    "x_m": 3.0,
                    "y_m": 4.0,
                    "yaw_rad": None,
                    "yaw_error_rad": None,
                    "wait_s": 0.0,
                    "reached": True,
                    "time_s": 10.0,
                    "reason": "",
                    "attempts": 1,
                    "path_length_m": 7.0,
                    "straight_length_m": 5.0,
                }
            ],
            "path_length_m": 7.0,
            "straight_length_m": 5.0,
            "min_clearance_m": None,
            "min_separation_m": None,
            "recoveries": 0,
            "contacts": 0,
            "aborts": 0,
            "spin_s": 0.0,
        }
    ],
    "contacts": [{"time_s": 5.0, "robot": "quad0", "with": "pillar", "x_m": 1.0, "y_m": 2.0}],
    "contacts_reported": True,
    "interventions": [],
    "min_separation_m": None,
    "seed": None,
    "versions": {},
    "command": ["quad", "fly"],
    "configuration": None,
    "scene": None,
    "goals": None,
    "jitter_m": "inf",
    "odom_drift": None,
    "localization": None,
    "lidar": None,
    "time_limit_s": None,
}


def test_the_json_has_the_documented_keys(tmp_path):
    summary = mission(
        leg(time_s=10.00049),
        contacts=(CONTACT,),
        sim_time_s=20.0,
        wall_time_s=10.0,
        robot_radius_m=0.3,
        facts={"command": ("quad", "fly"), "jitter_m": float("inf")},
    )
    path = tmp_path / "deep" / "result.json"
    write_json(summary, path)
    assert json.loads(path.read_text()) == to_json(summary) == DOCUMENTED
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize(
    "contact, clearance_m, separation_m",
    [(None, 2.7, 0.4), ("pillar", 0.0, 0.4), ("quad1", 2.7, 0.0)],
)
def test_the_gap_of_a_contact_is_zero(contact, clearance_m, separation_m):
    """The obstacle is 3 m from quad0, whose hull has 0.3 m; quad1 is 1 m beside it."""
    log = FlightLog(["quad0", "quad1"], 0.3, lambda places_m, _: np.full(places_m.shape[:-1], 3.0))
    for now_s in (0.0, 20.0):
        add_pose(log, "quad0", now_s, Pose2D(0, 0))
        add_pose(log, "quad1", now_s, Pose2D(1, 0))
    if contact is not None:
        log.add_contact(Contact(5.0, contact, "quad0", 1.0, 2.0))
    robot = summarize_robot(log, "quad0", [])
    assert robot.min_clearance_m == pytest.approx(clearance_m)
    assert robot.min_separation_m == pytest.approx(separation_m)


def test_a_mission_that_did_not_start_lists_its_goals():
    assert [(leg.index, leg.reached, leg.reason) for leg in unflown_legs(GOALS)] == [
        (0, False, "not sent"),
        (1, False, "not sent"),
        (2, False, "not sent"),
    ]


def test_a_robot_whose_mission_ended_early_fails_the_mission():
    log = FlightLog(["quad0", "quad1"], 0.3)
    sequencers = {name: Sequencer(GoalSequence(GOALS.goals[:1])) for name in log.robots}
    for name, sequencer in sequencers.items():
        fly(log, name, sequencer, DETOUR)
    reasons = {"quad1": "internal error: OSError(5, 'disk')"}
    times = {"sim_time_s": 20.0, "wall_time_s": 20.0}
    assert summarize(log, sequencers, 20.0, **times).exit_status == 0
    flown = summarize(log, sequencers, 20.0, reasons=reasons, **times)
    assert (flown.success, flown.exit_status, flown.reason) == (False, 1, "")
    robots = to_json(flown)["robots"]
    assert [robot["reason"] for robot in robots] == ["", "internal error: OSError(5, 'disk')"]
    assert "quad1 ended early: internal error: OSError(5, 'disk')." in table(flown)


def test_a_summary_with_a_number_that_is_not_finite_is_written(tmp_path):
    odd = leg(path_length_m=float("nan"))
    write_json(mission(odd, sim_time_s=float("inf")), tmp_path / "result.json")
    written = json.loads((tmp_path / "result.json").read_text())
    assert written["sim_time_s"] is None
    assert written["robots"][0]["goals"][0]["path_length_m"] is None
