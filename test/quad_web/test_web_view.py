"""Offline flights on a page: what is sampled when, what people do, and that the flight is same."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from fake_page import EVERYTHING, Clock, FakePage

from quad_nav.geometry import Pose2D
from quad_nav.mission.summary import to_json
from quad_nav.offline.flight import FlightObserver
from quad_nav.offline.run import fly
from quad_nav.scenario.flight_setup import FlightOptions, FlightSetup, read_setup
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.movers import Movers
from quad_nav.sim.simulation_params import SimulationParams
from quad_web.offline.actions import STARTED_AGAIN, STOPPED, FlightActions
from quad_web.offline.view import WebView
from quad_web.view.actions import GoalChange
from quad_web.view.state import LAYERS, Wanted

ROOT = Path(__file__).resolve().parents[2]


class Track(FlightObserver):
    """Stores all bodies' states, and does something at steps of odometry."""

    def __init__(self) -> None:
        self.rows = []
        self.doings = {}

    def on_move(self, flight) -> None:
        self.rows.append(flight.simulation.body_state.rows)
        do = self.doings.pop(len(self.rows), None)
        if do is not None:
            do()


def setup_of(goals: Path = ROOT / "goals", time_limit_s: float = 2.0, **given) -> FlightSetup:
    beams = LidarParams(step_size_rad=2 * np.pi / 128)
    options = FlightOptions(
        ROOT / "scenes" / "arena.yaml",
        goals,
        time_limit_s=time_limit_s,
        simulation=SimulationParams(beams),
        **given,
    )
    return read_setup(options)


def figures(summary) -> dict:
    """Return the summary without values that depend on the machine's speed."""
    kept = to_json(summary)
    return {key: kept[key] for key in kept if key not in ("wall_time_s", "real_time_factor")}


def write_goals(folder: Path, *robots) -> Path:
    folder.mkdir()
    for index, goals in enumerate(robots):
        (folder / f"quad{index}_goals.json").write_text(json.dumps({"goals": goals}))
    return folder


def test_moving_obstacles_are_where_the_simulation_has_them():
    beams = LidarParams(step_size_rad=2 * np.pi / 16)
    options = FlightOptions(
        ROOT / "scenes" / "examples" / "walkers.yaml",
        ROOT / "goals",
        time_limit_s=1.0,
        seed=3,
        simulation=SimulationParams(beams),
    )
    setup, clock = read_setup(options), Clock(0.005)
    people = replace(setup.scene.walkers, reacting=False)  # else only the flight knows where
    setup = replace(setup, scene=replace(setup.scene, walkers=people))
    page = FakePage(clock)
    fly(setup, [WebView(page, FlightActions(rate=0.0), clock)])
    last = page.state.item("obstacles").arrays["poses"]
    now_s = page.state.item("poses").data["stamp_s"]
    expected = Movers(setup.scene, 3).poses(now_s)
    assert len(last) == len(page.state.item("scene").data["moving"]) == 8
    assert last[:, :2] == pytest.approx(expected[:, :2], abs=1e-5)
    sent = [item for batch in page.batches for item in batch.items if item.key == "obstacles"]
    assert np.hypot(*(sent[0].arrays["poses"] - last)[:, :2].T).min() > 0.01  # all have moved


@pytest.mark.parametrize("processes", [1, 2])
def test_a_flight_on_a_page_is_the_same_flight_bit_for_bit(processes):
    setup, plain, shown = setup_of(time_limit_s=6.0), Track(), Track()
    clock = Clock(0.005)
    page = FakePage(clock)
    expected = figures(fly(setup, [plain], processes=processes))
    view = WebView(page, FlightActions(rate=0.0), clock)
    assert figures(fly(setup, [shown, view], processes=processes)) == expected
    assert np.array_equal(plain.rows, shown.rows)
    kinds = {item.key.partition("/")[0] for batch in page.batches for item in batch.items}
    layers = set(LAYERS) - {"track", "localization"}  # nothing moves, all know their places
    assert kinds >= {*layers, "scene", "robots", "flight", "poses", "status", "goals", "samples"}
    assert len(page.batches) > 3


def test_samples_are_at_least_a_tenth_of_a_second_of_wall_time_apart():
    clock = Clock()
    page = FakePage(clock)
    fly(setup_of(time_limit_s=1.0), [WebView(page, FlightActions(rate=1.0), clock)])
    # At 0, 0.1, ... 0.9 s, and the end: a period of odometry lasts 0.025 s.
    assert np.diff(page.times_s)[:-1].min() >= 0.1 - 1e-9
    assert len(page.batches) == 11
    assert clock.now_s - 100.0 == pytest.approx(1.0, abs=0.11)


def test_samples_are_further_apart_at_full_speed():
    clock = Clock(0.005)
    page = FakePage(clock)
    fly(setup_of(time_limit_s=6.0), [WebView(page, FlightActions(rate=0.0), clock)])
    gaps_s = np.diff(page.times_s)[:-1]  # the last one is sent at the end of the flight
    assert len(gaps_s) >= 3
    assert gaps_s.min() >= 0.35 - 1e-9
    assert gaps_s.max() < 0.35 + 0.1 + 4 * 0.005  # people's actions are looked for each 0.1 s


@pytest.mark.parametrize("rate, wall_s", [(0.5, 2.0), (4.0, 0.25)])
def test_the_rate_is_simulated_seconds_per_second(rate, wall_s):
    clock = Clock()
    fly(setup_of(time_limit_s=1.0), [WebView(FakePage(clock), FlightActions(rate), clock)])
    assert clock.now_s - 100.0 == pytest.approx(wall_s, abs=0.11)


def test_without_a_server_the_flight_goes_on_as_fast_as_it_goes():
    clock = Clock()
    page = FakePage(clock)
    track = Track()
    track.doings = {20: lambda: setattr(page, "is_alive", False)}
    summary = fly(setup_of(time_limit_s=2.0), [track, WebView(page, FlightActions(1.0), clock)])
    assert summary.sim_time_s == 2.0
    assert clock.now_s - 100.0 == pytest.approx(0.5, abs=0.11)


def test_nothing_is_sampled_before_the_last_batch_has_arrived():
    clock = Clock()
    page = FakePage(clock)

    class Slow(Track):
        def on_start(self, flight):
            page.can_take = False

    fly(setup_of(time_limit_s=1.0), [WebView(page, FlightActions(1.0), clock), Slow()])
    assert len(page.batches) == 1  # the one of the start


def test_without_a_page_that_is_open_the_flight_waits_and_nothing_is_sampled():
    clock = Clock()
    page = FakePage(clock, wanted=())
    page.on_wait = lambda page: setattr(page, "wanted", (EVERYTHING,) if clock.now_s > 105 else ())
    actions = FlightActions(0.0)
    summary = fly(setup_of(time_limit_s=0.5), [WebView(page, actions, clock)])
    assert page.times_s[0] == 100.0 and page.times_s[1] >= 105.0
    assert summary.sim_time_s == 0.5


def test_only_what_the_pages_show_is_sampled():
    clock = Clock(0.005)
    page = FakePage(clock, [Wanted(frozenset({"scan", "local_costmap"}), 1)])
    fly(setup_of(time_limit_s=3.0), [WebView(page, FlightActions(0.0), clock)])
    keys = {item.key for batch in page.batches[:-1] for item in batch.items if item.layer}
    assert keys == {"scan/0", "scan/1", "local_costmap/1"}
    last = {item.key for item in page.batches[-1].items}
    assert {"plan/0", "global_costmap/0", "local_costmap/0"} <= last  # all of the end stays there


def test_the_items_tell_where_the_robots_are_and_what_they_do():
    clock = Clock(0.005)
    page = FakePage(clock)
    track = Track()
    fly(setup_of(time_limit_s=3.0), [WebView(page, FlightActions(0.0), clock), track])
    state = page.state
    pose = state.item("poses").arrays["pose"]
    np.testing.assert_allclose(pose[:, :3], track.rows[-1][:, :3], atol=1e-6)
    flight = state.item("flight").data
    assert (flight["state"], flight["time_s"]) == ("ended", 3.0)
    assert flight["reason"] == "time limit of 3 s"
    first, second = state.item("status").data["rows"]
    assert (first["goal"], first["goals"], first["state"]) == (1, 3, "stopped")
    assert first["goal_distance"] == pytest.approx(np.hypot(*(pose[0, :2] - (3.0, 6.5))), abs=1e-5)
    assert second["gap_m"] == pytest.approx(np.hypot(*(pose[0, :2] - pose[1, :2])) - 0.6, abs=1e-5)
    states = [goal["state"] for goal in state.item("goals").data["goals"]]
    assert states == ["active", "pending", "pending"] * 2
    texts = [event[1] for batch in page.batches for event in batch.events]
    assert texts[:2] == ["goal 1: sent (3.00, 6.50)", "goal 1: sent (4.00, 3.50)"]
    assert texts[-1] == "the flight has ended: time limit of 3 s"


def test_a_pause_stands_until_somebody_starts_the_flight():
    clock = Clock()
    page = FakePage(clock)

    def start(page):
        if page.clock.now_s > 130.0:
            page.on_wait = None
            page.do("start")

    def pause():
        page.do("pause")
        page.on_wait = start

    track = Track()
    track.doings = {20: pause}
    summary = fly(setup_of(time_limit_s=1.0), [track, WebView(page, FlightActions(1.0), clock)])
    assert summary.sim_time_s == 1.0
    assert clock.now_s == pytest.approx(130.5, abs=0.5)
    assert [answer.ok for answer in page.answers] == [True, True]
    assert summary.interventions == ()


def flown(setup, doings, processes=1, rate=0.0):
    """Fly with actions at steps of odometry; return summary, actions, page and track."""
    clock = Clock(0.05)  # more than a look at each step
    page, actions, track = FakePage(clock), FlightActions(rate), Track()
    track.doings = {step: partial(do, page) for step, do in doings.items()}
    summary = fly(setup, [track, WebView(page, actions, clock)], processes=processes)
    return summary, actions, page, track


@pytest.mark.parametrize("processes", [1, 2])
def test_a_goal_of_a_person_is_flown_and_the_mission_goes_on(tmp_path, processes):
    goals = write_goals(tmp_path / "g", [[6.0, 2.0]], [[4.0, 3.5]])
    setup = setup_of(goals, time_limit_s=60.0)
    start = [setup.scene.starts[0].x_m, setup.scene.starts[0].y_m]
    pose = Pose2D(start[0] + 1.0, start[1], 0.0)
    summary, actions, page, track = flown(
        setup, {40: lambda page: page.do("send_goal", 0, pose)}, processes
    )
    assert page.answers[0].ok and page.answers[0].text.startswith("quad0: sent to (")
    assert actions.done[0].endswith(page.answers[0].text)
    places = np.array(track.rows)[:, 0, :2]
    assert np.hypot(*(places - (pose.x_m, pose.y_m)).T).min() < 0.3
    assert summary.success  # the sequencer's own goal is reached after it
    texts = [event[1] for batch in page.batches for event in batch.events]
    assert any("the navigator has finished another node's goal" in text for text in texts)


def test_a_cancelled_goal_is_skipped(tmp_path):
    goals = write_goals(tmp_path / "g", [[9.0, 5.5]], [[4.0, 3.5]])
    summary, actions, page, _ = flown(
        setup_of(goals, time_limit_s=60.0), {40: lambda page: page.do("cancel", 0)}
    )
    first, second = summary.robots
    assert first.legs[0].reason == "cancelled by another node" and second.legs[0].reached
    assert actions.done[0].endswith("quad0: goal cancelled")


def test_stopped_quadcopters_hover_until_they_are_resumed(tmp_path):
    goals = write_goals(tmp_path / "g", [[3.0, 3.0]], [[9.0, 3.5]])
    seen = []

    def look(page):
        rows = page.state.item("status").data["rows"]
        seen.append((page.state.item("flight").data["state"], {row["state"] for row in rows}))
        seen.append({row["reason"] for row in rows})
        page.do("start")

    doings = {40: lambda page: page.do("stop_all"), 160: look}
    summary, actions, page, track = flown(setup_of(goals, time_limit_s=60.0), doings)
    assert seen == [("stopped", {"stopped"}), {STOPPED}]
    speeds_mps = np.hypot(*np.array(track.rows)[:, :, 7:9].transpose(2, 0, 1))
    assert speeds_mps[35].min() > 0.2 and speeds_mps[100:160].max() < 0.05
    assert summary.success and summary.sim_time_s > 4.0
    assert [line.split(": ")[1] for line in actions.done] == [
        "missions stopped",
        "missions resumed",
    ]
    refused = actions.call("cancel", 0)
    assert not refused.ok and "has ended" in refused.text
    assert actions.call("start").ok and actions.stop_reason == STARTED_AGAIN


@pytest.mark.parametrize("processes", [1, 2])
def test_parameters_lidars_and_costmaps_change_in_flight(processes):
    def look(page):
        page.do("parameters", 1)
        page.do("set_parameters", 1, "", {"planner_patience": 7.5})
        page.do("set_parameters", 1, "", {"planner_patience": "x"})
        page.do("enable_lidar", 1, False)
        page.do("clear_costmaps", 0)
        page.do("parameters", 1)
        page.do("clear_costmaps", 9)

    _, actions, page, _ = flown(setup_of(time_limit_s=3.0), {40: look}, processes)
    before, changed, refused, lidar, cleared, after, unknown = page.answers
    values = {(one.namespace, one.name): one for one in before}
    seen = {(one.namespace, one.name): one for one in after}
    assert values["", "planner_patience"].value != 7.5
    assert seen["", "planner_patience"].value == 7.5
    assert seen["", "planner_patience"].file_value == values["", "planner_patience"].value
    assert changed.ok and lidar.ok and cleared.ok
    assert not refused.ok and "planner_patience" in refused.text
    assert not unknown.ok and "expected 0 to 1" in unknown.text
    row = page.state.item("status").data["rows"][1]
    assert (row["lidar"], row["state"]) == (False, "stopped")
    assert row["reason"].startswith("stopping: ")


def test_a_goal_off_the_arena_is_refused_as_in_files():
    def send(page):
        page.do("send_goal", None, Pose2D(-50.0, 0.0, 0.0))
        page.do("send_goal", None, Pose2D(float("nan"), 0.0, 0.0))

    summary, actions, page, _ = flown(setup_of(), {20: send})
    assert [answer.ok for answer in page.answers] == [False, False]
    assert "(-50.00, 0.00) is outside" in page.answers[0].text
    assert summary.interventions == () and actions.done == []


def test_saved_goals_are_flown(tmp_path):
    goals = write_goals(tmp_path / "g", [[9.0, 5.5]], [[4.0, 3.5]])
    setup = setup_of(goals, time_limit_s=60.0)
    x_m, y_m = setup.scene.starts[0].x_m + 1.0, setup.scene.starts[0].y_m

    def save(page):
        goals = [GoalChange(0, x_m, y_m, None)]
        page.do("save_goals", 0, page.answers[0][0].version, goals)

    summary, _, page, _ = flown(setup, {10: lambda page: page.do("goal_files"), 14: save})
    assert page.answers[1].ok, page.answers[1].text
    assert summary.success and summary.robots[0].legs[0].goal.x_m == x_m
    assert json.loads((goals / "quad0_goals.json").read_text()) == {"goals": [[x_m, y_m]]}
