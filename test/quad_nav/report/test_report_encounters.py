"""Close encounters: when, where, how close, and in which frames they are shown."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hand_made_traces import TIMES_S, flight, robot

from quad_nav.report.distances import distance_panels
from quad_nav.report.encounter_picture import encounter_picture, frame_times
from quad_nav.report.encounters import closest_moment, encounters, separation_text
from quad_nav.report.matplotlib_figures import distance_picture, paths_picture
from quad_nav.report.measures import resampled_tracks
from quad_nav.report.paths import flown_paths
from quad_nav.report.style import styled
from quad_nav.sim.contacts import Contact


def found_in(trace, **options):
    return encounters(trace, resampled_tracks(trace), **options)


def passing(offset_m: float):
    """They pass each other at 5 s, ``offset_m`` apart sideways."""
    return flight(robot(0, (1.0, 2.0), (0.5, 0.0)), robot(1, (6.0, 2.0 + offset_m), (-0.5, 0.0)))


def test_two_pass_each_other():
    (one,) = found_in(passing(1.0))
    assert (one.robot, one.other, one.names) == (0, 1, ("quad0", "quad1"))
    assert (one.time_s, one.separation_m) == (pytest.approx(5.0), pytest.approx(0.4))
    assert (one.x_m, one.y_m) == (pytest.approx(3.5), pytest.approx(2.5))
    assert found_in(passing(1.2)) == ()
    assert len(found_in(passing(1.2), below_m=0.7)) == 1
    assert found_in(flight(robot(0, (1.0, 1.0)))) == found_in(flight()) == ()


def test_a_flight_without_encounters_has_a_closest_moment():
    trace = passing(4.6)
    tracks = resampled_tracks(trace)
    (one,) = closest_moment(trace, tracks)
    assert (one.robot, one.other, one.is_close) == (0, 1, False)
    assert (one.time_s, one.separation_m) == (pytest.approx(5.0), pytest.approx(4.0))
    assert (one.x_m, one.y_m) == (pytest.approx(3.5), pytest.approx(4.3))
    (left, right), *_ = [axes.get_xlim() for axes in encounter_picture(trace, tracks, one).axes]
    assert right - left == pytest.approx(4.0 + 6 * 0.3)  # both are inside
    assert closest_moment(flight(), resampled_tracks(flight())) == ()
    assert distance_picture(distance_panels(trace, tracks), "ab", ()).axes[0].get_ylim()[1] > 4.0


def test_what_repeats_soon_is_one_encounter():
    """The gap swings between 0.1 m and 1.1 m."""

    def swinging(period_s):
        other = robot(1, (2.2, 1.0))
        swing = 0.5 * (1.0 - np.cos(2.0 * math.pi * TIMES_S / period_s))
        other.positions_m[:, 0] = 1.0 + 0.7 + swing
        return flight(robot(0, (1.0, 1.0)), other)

    assert len(found_in(swinging(2.5))) == 1
    assert [one.time_s for one in found_in(swinging(10.0))] == [
        pytest.approx(0.0),
        pytest.approx(10.0),
    ]


def test_contacts_with_obstacles_come_first_and_the_closest_next():
    touched = [Contact(time_s, "quad2", "pillar", 5.0, 5.0) for time_s in (2.0, 3.0, 8.0)]
    robots = (robot(k, at) for k, at in enumerate([(1.0, 1.0), (2.0, 1.0), (1.0, 1.8)]))
    trace = flight(*robots, contacts=touched)
    found = found_in(trace)
    assert {one.names for one in found[:2]} == {("quad2", "pillar")}
    assert [one.time_s for one in found[:2]] == [2.0, 8.0]
    assert found[0].other is None and (found[0].x_m, found[0].y_m) == (5.0, 5.0)
    assert [one.names for one in found[2:]] == [("quad0", "quad2"), ("quad0", "quad1")]


@pytest.mark.parametrize("offset_m", [0.62, 0.58])
def test_those_that_touched_have_no_gap(offset_m):
    """They may have touched between two poses, also of a body that is no disc."""
    trace = passing(offset_m)
    touch = flight(*trace.robots, contacts=[Contact(5.01, "quad1", "quad0", 3.5, 2.3)])
    (apart,), (one,) = found_in(trace), found_in(touch)
    assert apart.separation_m == pytest.approx(offset_m - 0.6)
    assert one.separation_m == 0.0
    picture = encounter_picture(touch, resampled_tracks(touch), one)
    assert picture.axes[2].get_xlabel() == "touching"


def test_the_legend_of_paths_shows_the_letter():
    trace = passing(1.0)
    tracks = resampled_tracks(trace)
    with styled():
        (legend,) = paths_picture(flown_paths(trace, tracks, encounters(trace, tracks))).legends
        names = [text.get_text() for text in legend.get_texts()]
        letter = legend.legend_handles[names.index("close encounter")].get_marker()
    width, height = np.ptp(letter.vertices, axis=0)
    assert 0.8 < height / width < 1.3


def test_frames_are_a_way_of_45_cm_apart_or_1_5_s():
    standing = flight(robot(0, (1.0, 1.0)), robot(1, (2.0, 1.0)))
    for trace, times_s in (
        (passing(1.0), [3.2, 4.1, 5.0, 5.9, 6.8]),
        (standing, [0.0, 1.5, 3.0]),
    ):
        (one,) = found_in(trace)
        assert frame_times(trace, resampled_tracks(trace), one) == pytest.approx(times_s)


def test_gaps_in_words():
    texts = [separation_text(gap_m) for gap_m in (0.4, -0.02, -0.004, 0.004)]
    assert texts == ["gap 0.40 m", "overlap 0.02 m", "touching", "touching"]
