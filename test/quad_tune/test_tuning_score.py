"""The score of a flight, and statistics of many, worked out by hand."""

from __future__ import annotations

from dataclasses import replace

import pytest
from study_flights import FLOWN

from quad_tune.flight_result import FlightResult
from quad_tune.score import TERMS, cost, mean_cost
from quad_tune.statistics import flight_statistics


@pytest.mark.parametrize(
    "change, expected",
    [
        ({}, 4.1),  # 40 s / 10 m, and 0.5 x 0.2 m/s2
        ({"time_s": 20.0}, 2.1),
        ({"time_s": 9999.0}, 30.1),
        ({"clearance_m": 0.15}, 4.6),  # half of what is comfortable
        ({"separation_m": 0.0}, 5.1),
        ({"clearance_m": None}, 4.1),
        ({"contacts": 1, "clearance_m": -0.01}, 55.1),
        ({"contacts": 2, "clearance_m": -0.01}, 80.1),
        ({"reached": 1}, 10000.0 * 0.75 + 4.1),
        ({"reached": 0}, 10000.0 + 4.1),
    ],
)
def test_the_cost_of_a_flight(change, expected):
    assert cost(replace(FLOWN, **change)) == pytest.approx(expected)


def test_what_comes_first_outweighs_everything_after_it():
    worst = {"time_s": 1e9, "clearance_m": 0.0, "roughness_mps2": 1e9}
    touched = cost(replace(FLOWN, contacts=1, time_s=0.0, roughness_mps2=0.0))
    touched_often = cost(replace(FLOWN, contacts=1000, **worst))
    nearly_all = cost(replace(FLOWN, goals=1000, reached=999, time_s=0.0))
    assert cost(replace(FLOWN, **worst)) < touched
    assert touched_often < nearly_all
    assert [term.name for term in TERMS] == ["goals", "contacts", "time", "clearance", "smoothness"]


def test_statistics_of_three_flights():
    flights = [
        FLOWN,
        replace(FLOWN, time_s=50.0, clearance_m=0.1, recoveries=2),
        replace(FLOWN, reached=1, time_s=300.0, contacts=2),
    ]
    found = flight_statistics(flights)
    assert (found.flights, found.completed, found.succeeded) == (3, 2, 2)
    assert (found.contacts, found.touched, found.recoveries) == (2, 1, 2)
    assert (found.mean_time_s, found.least_gap_m) == (45.0, 0.1)
    assert found.mean_gap_m == pytest.approx((0.5 + 0.1 + 0.5) / 3)
    assert found.cost == mean_cost(flights)


def test_statistics_without_a_completed_mission():
    found = flight_statistics([replace(FLOWN, reached=0, clearance_m=None)])
    assert (found.mean_time_s, found.least_gap_m) == (None, None)


def test_a_flight_is_the_same_after_json():
    flight = replace(FLOWN, time_s=1 / 3, reason="time limit of 300 s")
    assert FlightResult.from_json(flight.to_json()) == flight
