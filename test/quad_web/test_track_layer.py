"""The layer of tracks on a page: of a flight without ROS and of its recording."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fake_page import Clock, FakePage

from quad_nav.offline.run import fly
from quad_nav.recording.recorder import Recorder
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.sim.motion import Motion
from quad_nav.sim.obstacles import Cylinder
from quad_nav.sim.scene import MovingObstacle
from quad_nav.topics.tracked_obstacles import TrackKind
from quad_web.offline.actions import FlightActions
from quad_web.offline.view import WebView
from quad_web.replay.recorded_flight import SHOWN_FOR_S, RecordedFlight
from quad_web.view.state import Wanted

pytest.importorskip("quad_moving")
ROOT = Path(__file__).resolve().parents[2]
LAYER = Wanted(frozenset({"track"}), 0)
SPEED_MPS, RADIUS_M = 1.0, 0.3


def setup_of(time_limit_s: float):
    """The arena with a cylinder that goes north along x = 5 m from y = 2 m on, and out."""
    options = FlightOptions(
        ROOT / "scenes" / "arena.yaml",
        ROOT / "goals",
        parameters=(
            ("scan_filters", [{"name": "tracker", "type": "quad_moving/Tracker"}]),
            ("tracker/timeout", 1.5),
        ),
        time_limit_s=time_limit_s,
    )
    setup = read_setup(options)
    motion = Motion((0.0, 28.0), ((5.0, 2.0, 0.0), (5.0, 30.0, 0.0)), loop=False)
    walker = MovingObstacle(Cylinder("walker", 5.0, 2.0, RADIUS_M, 1.8), motion)
    return replace(setup, scene=replace(setup.scene, moving=(walker,)))


def assert_is_walker(rows, time_s: float) -> None:
    """Check that a row is the walker, known from scans up to a fifth of a second old."""
    nearest = rows[np.argmin(np.hypot(rows[:, 0] - 5.0, rows[:, 1] - 2.0 - time_s))]
    x_m, y_m, vx_mps, vy_mps, radius_m, kind = nearest.tolist()
    assert (x_m, y_m) == pytest.approx((5.0, 2.0 + SPEED_MPS * time_s), abs=0.3)
    assert (vx_mps, vy_mps) == pytest.approx((0.0, SPEED_MPS), abs=0.4)
    assert radius_m == pytest.approx(RADIUS_M, abs=0.1) and kind == TrackKind.SEEN


def page_after(seconds: float, processes: int) -> FakePage:
    clock = Clock(0.005)
    page = FakePage(clock, [LAYER])
    view = WebView(page, FlightActions(rate=0.0), clock)
    fly(setup_of(seconds), [view], processes=processes)
    return page


@pytest.mark.parametrize("processes", [1, 2])
def test_a_page_shows_the_tracks_of_a_flight_and_drops_those_that_have_ended(processes):
    assert_is_walker(page_after(4.0, processes).state.item("track/0").arrays["rows"], 4.0)
    assert page_after(14.0, processes).state.item("track/0") is None  # it left at 10 s


def test_a_recording_has_the_tracks_of_any_time(tmp_path):
    path = tmp_path / "flight.bag"
    fly(setup_of(14.0), [Recorder(path)])
    flight = RecordedFlight(path)

    def item_at(time_s: float):
        part = flight.parts(time_s, {"track": (0, 1)}).get("track/0")
        return part and part[1]()

    for time_s in (3.0, 4.5, 2.5):
        assert_is_walker(item_at(time_s).arrays["rows"], time_s)
    items = [item_at(time_s) for time_s in np.arange(8.0, 14.0, 0.1)]
    counts = [-1 if item is None else len(item.arrays["rows"]) for item in items]
    last = counts.index(0)  # the message that clears the display, shown for a second
    assert max(counts[:last]) >= 1 and SHOWN_FOR_S == 1.0
    assert set(counts[last : last + 9]) == {0} and counts[-1] == -1
    flight.close()
