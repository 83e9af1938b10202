"""Reports of flights among people who react to quadcopters know where these were."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hand_made_traces import SCENE, flight, robot
from matplotlib.patches import Polygon
from recorded_flight import setup

from quad_nav.files.shipped import shipped
from quad_nav.offline.run import fly
from quad_nav.recording.bag_trace import read_trace
from quad_nav.recording.recorder import Recorder
from quad_nav.recording.trace import TraceObserver
from quad_nav.report.encounter_picture import encounter_picture
from quad_nav.report.encounters import encounters
from quad_nav.report.matplotlib_figures import paths_picture
from quad_nav.report.measures import clearances_m, resampled_tracks
from quad_nav.report.paths import flown_paths
from quad_nav.report.plotly_figures import paths_plot
from quad_nav.scenario import mission_setup
from quad_nav.scenario.rules import START_S
from quad_nav.sim.contacts import Contact
from quad_nav.sim.crowd_record import CrowdRecord
from quad_nav.sim.motion import Walkers

PEOPLE = Walkers(20, reacting=True)


def places_of(record, *times_s):
    return record.poses(np.array(times_s))[:, :, :2].tolist()


def test_a_record_interpolates():
    record = CrowdRecord(2)
    record.add(1.0, np.array([[0.0, 0.0], [4.0, 1.0]]))
    record.add(1.2, np.array([[0.2, 0.0], [4.0, 2.0]]))
    assert places_of(record, 1.0, 1.2) == [[[0.0, 0.0], [4.0, 1.0]], [[0.2, 0.0], [4.0, 2.0]]]
    assert np.allclose(places_of(record, 1.05), [[[0.05, 0.0], [4.0, 1.25]]])
    assert np.isnan(places_of(record, 0.99, 1.21)).all()


def test_a_record_does_not_bridge_a_gap():
    record = CrowdRecord(1)
    for time_s in (0.0, 0.5, 1.1):
        record.add(time_s, np.array([[time_s, 0.0]]))
    assert np.allclose(
        places_of(record, 0.25, 0.5, 1.1), [[[0.25, 0.0]], [[0.5, 0.0]], [[1.1, 0.0]]]
    )
    assert np.isnan(places_of(record, 0.8)).all()


def test_a_record_begins_anew_when_time_goes_back():
    record = CrowdRecord(1)
    record.add(5.0, np.array([[5.0, 0.0]]))
    record.add(5.0, np.array([[6.0, 0.0]]))
    assert places_of(record, 5.0) == [[[6.0, 0.0]]]
    record.add(1.0, np.array([[1.0, 0.0]]))
    assert np.isnan(places_of(record, 4.0, 5.0)).all() and places_of(record, 1.0) == [[[1.0, 0.0]]]


def test_a_record_without_places_and_one_that_forgets():
    assert np.isnan(places_of(CrowdRecord(2), 0.0)).all()
    record = CrowdRecord(1, kept=2)
    for time_s in (0.0, 0.1, 0.2):
        record.add(time_s, np.zeros((1, 2)))
    assert np.isnan(places_of(record, 0.05)).all() and places_of(record, 0.15) == [[[0.0, 0.0]]]


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """The summary of a flight among people who react, its trace and the one that was recorded."""
    folder = tmp_path_factory.mktemp("people")
    path = folder / "flight.bag"
    given = setup(folder, seed=2, time_limit_s=6.0)
    given = replace(given, scene=replace(given.scene, walkers=PEOPLE))
    observer = TraceObserver()
    summary = fly(given, [observer, Recorder(path)])
    return summary, observer.trace(summary.contacts, summary.reason), read_trace(path)


def test_clearances_are_those_of_the_summary(flown):
    """The places of people are recorded every 0.1 s; between, they turn with up to 3 m/s^2."""
    summary, seen, read = flown
    for trace, within_m in ((seen, 1e-3), (read, 4e-3)):
        tracks = resampled_tracks(trace)
        least = np.nanmin(clearances_m(tracks, trace), axis=1)
        expected = [one.min_clearance_m for one in summary.robots]
        assert least == pytest.approx(expected, abs=within_m)
        alone = replace(trace, scene=replace(trace.scene, walkers=None))
        assert np.nanmin(clearances_m(tracks, alone), axis=1).min() > least.min() + 0.05


def test_pictures_and_pages_have_them(flown):
    _, _, trace = flown
    tracks = resampled_tracks(trace)
    last_s = float(tracks.times_s[-1])
    people = trace.movers.poses(last_s)[:, :2]
    assert np.isfinite(people).all()
    drawn = paths_picture(flown_paths(trace, tracks, [])).axes[0].patches
    places = patch_middles(drawn)
    assert all(np.hypot(*(places - person).T).min() < 1e-9 for person in people)
    plot = paths_plot(flown_paths(trace, tracks, []))
    (shown,) = (one for one in plot.traces if one.get("name") == "moving obstacle")
    number = list(plot.traces).index(shown)
    for frame in plot.frames:
        assert len(frame["data"]) == len(frame["traces"]) and frame["traces"][0] == number
        then = trace.movers.poses(float(frame["name"]))[:, :2]  # a time in tenths of a second
        assert middles(frame["data"][0]) == pytest.approx(then, abs=0.05 * 1.3 * 1.5)
    assert middles(shown) == pytest.approx(people, abs=0.01)


def test_frames_of_a_contact_show_the_person():
    record = CrowdRecord(1)
    for time_s in np.arange(101) / 10.0:
        record.add(time_s, np.array([[3.0 + 0.1 * time_s, 2.0]]))
    touch = Contact(5.0, "quad0", "person_0", 3.25, 2.0)
    scene = replace(SCENE, walkers=replace(PEOPLE, count=1))
    trace = flight(robot(0, (2.95, 2.0)), contacts=[touch], scene=scene, people=record)
    tracks = resampled_tracks(trace)
    figure = encounter_picture(trace, tracks, encounters(trace, tracks)[0])
    assert patch_middles(figure.axes[2].patches)[0] == pytest.approx((3.5, 2.0))


def patch_middles(patches):
    """Return the means of the corners of each drawn obstacle."""
    drawn = [patch for patch in patches if isinstance(patch, Polygon)]
    return np.array([patch.get_xy()[:-1].mean(axis=0) for patch in drawn])


def middles(outlines):
    """Return the means of the corners of each outline, without the closing ones."""
    x, y = (np.array(outlines[key], float) for key in "xy")
    ends = np.append(np.flatnonzero(np.isnan(x)), len(x))
    starts = np.append(0, ends[:-1] + 1)
    return np.array([[v[a : b - 1].mean() for v in (x, y)] for a, b in zip(starts, ends)])


@pytest.mark.parametrize("reacting", [False, True])
def test_a_mission_under_ros_measures_the_distance_from_what_stands_and_from_people(
    tmp_path, reacting
):
    """A wall is 1.5 m from the start (1.5, 1.5); a person of 0.25 m stands 1 m from it."""
    scene, goals = "arena.yaml", shipped("goals")
    if reacting:
        scene, goals = "examples/walkers.yaml", shipped("goals", "examples/walkers")
    parameters = {"goals": str(goals), "scene": str(shipped("scenes", scene))}
    mission = mission_setup.read_setup(parameters, "sequencer", tmp_path / "r.json", tmp_path)
    place, now_s = np.array([[1.5, 1.5]]), np.array([START_S + 2.0])
    assert mission.surface_distance(place, now_s) == pytest.approx(1.5)
    assert (mission.people is not None) == reacting
    if reacting:
        mission.people.add(2.0, np.array([[2.5, 1.5], *5 * [[6.0, 9.0]]]))
        assert mission.surface_distance(place, now_s) == pytest.approx(0.75)


def test_people_of_whom_nothing_is_recorded_are_left_out():
    trace = flight(robot(0, (1.0, 1.0)), scene=replace(SCENE, walkers=PEOPLE))
    tracks = resampled_tracks(trace)
    assert np.isfinite(clearances_m(tracks, trace)).all()
    assert paths_plot(flown_paths(trace, tracks, [])).frames[-1]["data"][0] == {"x": [], "y": []}


def test_an_animation_among_many_people_has_fewer_corners():
    record = CrowdRecord(100)
    for time_s in np.arange(101) / 10.0:
        record.add(time_s, np.column_stack([np.linspace(1.0, 11.0, 100), np.full(100, time_s)]))
    scene = replace(SCENE, walkers=replace(PEOPLE, count=100))
    trace = flight(robot(0, (1.0, 1.0)), scene=scene, people=record)
    plot = paths_plot(flown_paths(trace, resampled_tracks(trace), []))
    outlines = plot.frames[50]["data"][0]
    assert len(outlines["x"]) == 100 * (6 + 1 + 1) - 1  # a hexagon, its closing corner and a gap
