"""Robots on a circle that swap sides."""

import json
import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from quad_bench.circle.orca import Orca, OrcaParams
from quad_bench.circle.results import (
    CircleResults,
    circle_statistics,
    in_order,
    text,
    to_csv,
    to_json,
)
from quad_bench.circle.runs import CircleRun, Track, fly_orca, fly_orca_points, fly_quad
from quad_bench.circle.setup import (
    METHODS,
    CircleOptions,
    circle_starts,
    read_circles,
)
from quad_bench.cli import circle as command
from quad_nav.errors import InputError
from quad_nav.sim.scene import BODY_RADIUS_M

needs_orca = pytest.mark.skipif(
    sys.version_info < (3, 9), reason="there is no pyrvo for this version of Python"
)


def only(**given):
    usual = {"robots": (2,), "radius_m": 1.5, "methods": ("quad",)}
    (circle,) = read_circles(CircleOptions(**{**usual, **given}))
    return circle


def test_starts_are_spread_evenly_and_face_the_opposite_point():
    poses = [(one.x_m, one.y_m, one.yaw_rad) for one in circle_starts(4, 3.0)]
    half = math.pi / 2
    expected = [(3, 0, math.pi), (0, 3, -half), (-3, 0, 0), (0, -3, half)]
    for pose, (x_m, y_m, yaw_rad) in zip(poses, expected):
        assert pose[:2] == pytest.approx((x_m, y_m), abs=1e-9)
        assert math.cos(pose[2] - yaw_rad) == pytest.approx(1.0)


def test_goals_are_the_starts_of_those_opposite():
    circle = only(robots=(6,), radius_m=4.0)
    starts = [(start.x_m, start.y_m) for start in circle.starts]
    assert np.allclose(circle.goals_m, starts[3:] + starts[:3])
    assert [robot.sequence.goals[0].x_m for robot in circle.flight.robots] == [
        x_m for x_m, _ in circle.goals_m
    ]


@needs_orca
def test_every_method_has_the_same_displaced_starts():
    circle = only(robots=(8,), radius_m=4.0, seed=3)
    starts = circle.starts_of(2)
    for start, displaced in zip(circle.starts, starts):
        assert 0.0 < start.distance_to(displaced) <= 0.1
    assert circle.flight_of(2).seed == 5
    for fly in (fly_orca, fly_orca_points):
        run = fly(only(robots=(8,), radius_m=4.0, seed=3, time_limit_s=0.1), 2)
        assert run.tracks_m[0].tolist() == [[one.x_m, one.y_m] for one in starts]


def test_the_hull_sets_footprint_and_radius_of_orca():
    circle = only(body_radius_m=0.2)
    costmap = circle.flight.configurations[1].local_costmap
    assert circle.orca.radius_m == pytest.approx(0.25)
    assert costmap.robot_radius_m == pytest.approx(0.25)
    assert circle.flight.robot_radius_m == 0.2 and circle.orca.speed_mps == 0.3
    assert only().orca.radius_m == pytest.approx(BODY_RADIUS_M + 0.05)


@pytest.mark.parametrize(
    "given, problem",
    [
        ({"robots": (1, 4)}, "--robots 1: expected 2 to"),
        ({"robots": (30,), "radius_m": 2.0}, "leaves no free start"),
        ({"config": "nowhere"}, "nowhere"),
    ],
)
def test_faulty_options(given, problem):
    with pytest.raises(InputError, match=problem):
        only(**given)


def test_without_pyrvo_only_our_navigator_flies(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyrvo", None)
    with pytest.raises(InputError, match=r"pip install 'quad-nav\[orca\]'.*only --method quad"):
        only(methods=METHODS)
    assert only(methods=("quad",)).radius_m == 1.5


@needs_orca
def test_orca_prefers_the_straight_way_and_stops_at_the_goal():
    orca = Orca(OrcaParams(0.3, 0.5, 0.1), np.zeros((2, 2)), np.array([[3.0, 4.0], [0.02, 0.0]]))
    preferred = orca.preferred_mps(np.zeros((2, 2)))
    assert preferred == pytest.approx(np.array([[0.3, 0.4], [0.2, 0.0]]))


@needs_orca
def test_a_lone_pair_far_apart_flies_straight_by_orca():
    starts = np.array([[0.0, 0.0], [0.0, 50.0]])
    orca = Orca(OrcaParams(0.3, 0.5, 0.1), starts, starts + (10.0, 0.0))
    assert orca.step(starts, np.zeros((2, 2))) == pytest.approx(np.array([[0.5, 0.0]] * 2))


def test_a_track_measures_arrival_detour_and_gap():
    """One flies an L of 3 m and 4 m to (3, 4); the other one waits at (3, 0.8)."""
    track = Track(np.array([[0.0, 0.0], [3.0, 0.8]]), np.array([[3.0, 4.0], [9.0, 0.8]]), 0.25)
    places = [(3.0, 0.0), (3.0, 3.5), (3.0, 3.6), (3.0, 4.0)]
    for now_s, place in enumerate(places, start=1):
        track.add(now_s, np.array([place, (3.0, 0.8)]))
    assert track.arrivals_s.tolist() == [3.0, math.inf] and not track.all_arrived
    assert track.gap_m == pytest.approx(0.8 - 0.5)
    run = track.result(only(), "quad", 0, 4.0, [])
    assert run.detours[0] == pytest.approx(6.6 / 4.6)
    assert (run.arrived, run.succeeded, run.last_arrival_s) == (1, False, None)


@needs_orca
@pytest.mark.parametrize("fly", [fly_orca, fly_orca_points])
def test_two_swap_sides_by_orca(fly):
    """2.6 m at 0.3 m/s is 8.7 s."""
    run = fly(only(), 0)
    assert run.succeeded and 8.5 < run.mean_arrival_s <= run.last_arrival_s < 12.0
    assert 0.05 < run.gap_m < 0.3 and 1.0 <= run.detour < 1.1


def test_two_swap_sides_by_our_navigator():
    run = fly_quad(only(methods=("quad",)), 0)
    assert run.succeeded and 8.5 < run.last_arrival_s < 40.0
    assert run.gap_m > 0.05
    assert run.tracks_m.shape[1:] == (2, 2)


RUN = CircleRun("quad", 2, 4.0, 0, 7, (20.0, 30.0), (1.0, 1.2), 0.25, (), 30.0, np.zeros((3, 2, 2)))
LATE = replace(RUN, run=1, seed=8, arrivals_s=(40.0, 50.0), gap_m=0.1)
LOST = replace(RUN, run=2, seed=9, arrivals_s=(20.0, None), contacts=("quad0 touches quad1",))


@pytest.mark.slow
def test_four_that_meet_fly_round_the_middle_in_one_direction():
    """Straight on it takes 25 s to come within 0.4 m of the goals, 8 m away."""
    in_turn = only(robots=(4,), parameters=(("peers/roundabouts", False),), radius_m=4.0)
    rounds = only(robots=(4,), radius_m=4.0)
    before, now = fly_quad(in_turn, 0), fly_quad(rounds, 0)
    assert before.succeeded and now.succeeded
    assert now.last_arrival_s < 28.0 < before.last_arrival_s
    for k in range(4):  # counter-clockwise about (0, 0)
        x, y = now.tracks_m[:, k].T
        assert np.hypot(x, y).min() > 0.5
        turned = np.diff(np.unwrap(np.arctan2(y, x)))
        assert turned[np.hypot(x, y)[1:] < 2.0].min() > 0.0


def test_statistics_of_flights():
    row = circle_statistics([RUN, LATE, LOST])
    assert (row.runs, row.successes, row.touched) == (3, 2, 1)
    assert (row.mean_arrival_s, row.last_arrival_s, row.slowest_s) == (35.0, 40.0, 50.0)
    assert row.detour == pytest.approx(1.1) and row.gap_m == 0.1
    nothing = circle_statistics([LOST])
    assert nothing.mean_arrival_s is None and nothing.slowest_s is None


def test_results_as_text_json_and_csv():
    runs = in_order([LOST, replace(RUN, method="orca"), LATE, RUN])
    assert [(run.method, run.seed) for run in runs] == [
        ("quad", 7),
        ("quad", 8),
        ("quad", 9),
        ("orca", 7),
    ]
    results = CircleResults(CircleOptions((2,), seed=7), runs, 6, 3.0)
    shown = text(results)
    rows = [line.split() for line in shown.splitlines()]
    ours = "2, 4 m quad 3 66.7 20.8-93.9 33.3 35.0 40.0 50.0 1.10 0.10"
    assert ours.split() in rows
    assert "2 robots, quad, seed 9: quad0 touches quad1." in shown
    assert "2 robots, quad, seed 9: 1 arrived." in shown
    assert "Interrupted after 4 of 6 flights." in shown
    assert max(map(len, shown.splitlines())) <= 110
    figures = to_json(results)
    assert figures["figures"][0]["successes"] == 2 and figures["runs"][2]["contacts"]
    json.dumps(figures, allow_nan=False)
    assert len(to_csv(results).splitlines()) == 5
    header = to_csv(replace(results, runs=()))
    assert to_csv(results).startswith(header) and header.startswith("robots,radius_m,method,")


@needs_orca
def test_the_command(tmp_path):
    picture, table = tmp_path / "paths.svg", tmp_path / "runs.csv"
    given = ["--robots", "2", "--robots", "4", "--radius", "2", "--method", "orca-points"]
    outputs = ["--picture", str(picture), "--csv", str(table), "--json", "-", "--workers", "1"]
    done = CliRunner().invoke(command.circle, [*given, *outputs, "-q"])
    assert done.exit_code == 0, done.output
    assert [row["successes"] for row in json.loads(done.stdout)["figures"]] == [1, 1]
    assert picture.read_text().startswith("<?xml") and len(table.read_text().splitlines()) == 3
    bad = CliRunner().invoke(command.circle, ["--robots", "2", "--picture", "paths.bmp"])
    assert bad.exit_code == 2 and "expected a file .png or .svg" in bad.output


def test_the_command_knows_methods_and_radius():
    assert command.METHODS == METHODS
    assert command.BODY_RADIUS_M == BODY_RADIUS_M
