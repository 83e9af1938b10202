"""Curves and key metrics of flights that can be worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hand_made_traces import RADIUS_M, SCENE, TIMES_S, flight, goal, robot

from quad_nav.mission.distances import nearest_separations_m
from quad_nav.report.flight_metrics import flight_metrics
from quad_nav.report.measures import (
    clearances_m,
    resampled_tracks,
    spins,
    straight_length_m,
)
from quad_nav.sim.contacts import Contact


def test_gap_between_two_that_meet_head_on():
    """10 m apart, 1 m/s towards each other each: 10 - 2 t - 0.6."""
    tracks = resampled_tracks(
        flight(robot(0, (1.0, 2.0), (1.0, 0.0)), robot(1, (11.0, 2.0), (-1.0, 0.0)))
    )
    gaps_m = nearest_separations_m(tracks.positions_m, RADIUS_M)
    assert gaps_m[0] == pytest.approx(np.abs(10.0 - 2.0 * TIMES_S) - 0.6)
    assert gaps_m[1] == pytest.approx(gaps_m[0])


@pytest.mark.parametrize("x_m, gaps_m", [([1.0, 4.0, 6.0], [2.4, 1.4, 1.4]), ([1.0], [math.nan])])
def test_gap_is_to_the_nearest_other_robot(x_m, gaps_m):
    tracks = resampled_tracks(flight(*(robot(k, (x, 1.0)) for k, x in enumerate(x_m))))
    assert nearest_separations_m(tracks.positions_m, RADIUS_M)[:, 0] == pytest.approx(
        gaps_m, nan_ok=True
    )


def test_clearance_is_to_the_pillar_or_a_wall():
    """From (2, 6) eastwards: 2 m to the wall, then 3.5 m - t to the pillar; less the radius."""
    scene = replace(SCENE, obstacles=SCENE.obstacles[:1])
    flown = replace(flight(robot(0, (2.0, 6.0), (0.3, 0.0))), scene=scene)
    tracks = resampled_tracks(flown)
    expected = np.minimum(2.0 + 0.3 * TIMES_S, 3.5 - 0.3 * TIMES_S) - RADIUS_M
    assert clearances_m(tracks, flown)[0] == pytest.approx(expected)
    assert np.isnan(clearances_m(tracks, replace(flown, scene=None))).all()


def test_robots_with_different_samples_are_compared_at_the_same_times():
    slow = np.arange(1, 5) * 2.0
    tracks = resampled_tracks(
        flight(robot(0, (1.0, 1.0), (0.5, 0.0), times_s=slow), robot(1, (1.0, 3.0)))
    )
    assert len(tracks.times_s) == len(TIMES_S)
    assert np.isnan(tracks.positions_m[0, tracks.index_at(1.9)]).all()
    assert tracks.positions_m[0, tracks.index_at(3.0)] == pytest.approx([2.5, 1.0])


def test_yaw_is_resampled_the_short_way_round():
    times_s = np.array([0.0, 1.0])
    turning = robot(0, (1.0, 1.0), turn_radps=3.0, times_s=times_s * 2)
    tracks = resampled_tracks(flight(turning, robot(1, (5.0, 5.0), times_s=times_s)))
    assert tracks.yaws_rad[0, 1] == pytest.approx((6.0 - 2.0 * math.pi) / 2.0)


@pytest.mark.parametrize(
    "velocity, turn_radps, has_goal, expected",
    [
        ((0.0, 0.0), 0.5, True, [(2.0, 6.0)]),
        ((0.0, 0.0), 0.5, False, []),
        ((0.1, 0.0), 0.5, True, []),  # it flies
        ((0.0, 0.0), 0.1, True, []),  # it stands
    ],
)
def test_spins_count_while_a_goal_is_flown(velocity, turn_radps, has_goal, expected):
    goals = (goal(0, (1.0, 1.0), 2.0, 6.0),) if has_goal else ()
    found = spins(robot(0, (1.0, 1.0), velocity, turn_radps, goals=goals))
    assert found == [pytest.approx(span) for span in expected]


def test_straight_length_is_between_sending_and_end():
    flown = robot(
        0, (1.0, 1.0), (0.5, 0.0), goals=(goal(0, (9.0, 9.0), 1.0, 4.0), goal(1, (9.0, 9.0), 4.0))
    )
    assert straight_length_m(flown) == pytest.approx(1.5 + 3.0)


def test_metrics_of_a_flight():
    done = robot(
        0,
        (1.0, 2.0),
        (0.5, 0.0),
        pitch_rad=0.1,
        recoveries=((3.0, "rotate_recovery"),),
        goals=(goal(0, (3.0, 2.0), 1.0, 4.0), goal(1, (5.0, 2.0), 4.0, 9.0)),
    )
    found = flight_metrics(flight(done, robot(1, (1.0, 4.0))))
    assert (found.goals, found.reached, found.contacts, found.recoveries) == (2, 2, 0, 1)
    assert found.mission_s == pytest.approx(8.0)
    assert found.detour == pytest.approx(1.0)
    assert found.min_separation_m == pytest.approx(2.0 - 0.6)
    assert found.min_clearance_m == pytest.approx(1.0 - 0.3)
    first = found.robots[0]
    assert first.path_length_m == pytest.approx(4.0)
    assert (first.top_speed_mps, first.top_tilt_rad) == (pytest.approx(0.5), pytest.approx(0.1))
    assert found.success and not found.faults


def test_faults_say_why_a_flight_failed():
    failed = robot(0, (1.0, 2.0), goals=(goal(0, (3.0, 2.0), 1.0, 4.0, reached=False),))
    found = flight_metrics(
        flight(failed, contacts=[Contact(2.0, "quad0", "pillar", 1.0, 2.0)], reason="interrupted")
    )
    assert not found.success
    assert found.faults == ("ended early (interrupted)", "1 of 1 goals not reached", "1 contact")
    assert found.robots[0].contacts == 1
    for trace in (flight(robot(0, (1.0, 1.0))), flight()):
        assert flight_metrics(trace).remarks == ("goals are not recorded",)
