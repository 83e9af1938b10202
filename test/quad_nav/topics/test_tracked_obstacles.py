"""Tracked moving obstacles on topics: markers, numbers, when they are published."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from quad_nav.costmap.tracks import Tracks
from quad_nav.recording.messages import marker_array
from quad_nav.topics.markers import ARROW, CYLINDER
from quad_nav.topics.tracked_obstacles import (
    TrackKind,
    TrackSchedule,
    ellipse,
    obstacle_fields,
    rows_of_markers,
    track_markers,
    track_rows,
)

COVARIANCE = np.diag([0.04, 0.01, 0.09, 0.16])
TRACKS = Tracks(
    3.0,
    np.array([7, 9]),
    np.array([(1.0, 2.0, 0.0, 1.5), (4.0, 5.0, 0.0, 0.0)]),
    np.array([COVARIANCE, COVARIANCE]),
    np.array([0.3, 0.5]),
    np.array([0.0, 0.4]),
)
SUSPECTS = np.array([(1.0, 2.0, 0.0, 0.0, 0.25), (3.0, 4.0, -0.8, 0.0, 0.3)])


def test_a_track_has_a_disc_an_ellipse_and_an_arrow_to_where_it_is_in_a_second():
    markers = track_markers(TRACKS, "odom0")
    moving = {one.namespace: one for one in markers if one.number == 7}
    assert set(moving) == {"disc", "ellipse", "number", "velocity"}
    assert moving["disc"].kind == CYLINDER and moving["disc"].size_m[:2] == (0.6, 0.6)
    assert moving["ellipse"].size_m[:2] == pytest.approx((0.8, 0.4))
    arrow = moving["velocity"]
    assert arrow.kind == ARROW and arrow.size_m[0] == 1.5
    assert arrow.yaw_rad == pytest.approx(math.pi / 2)
    assert all(one.frame == "odom0" for one in markers)


def test_a_track_that_stands_has_no_arrow_and_a_hidden_one_is_paler():
    markers = track_markers(TRACKS, "map")
    standing = {one.namespace: one for one in markers if one.number == 9}
    seen = next(one for one in markers if one.number == 7 and one.namespace == "disc")
    assert "velocity" not in standing
    assert standing["disc"].rgba[3] < seen.rgba[3]


def test_ellipses_beyond_0_3_m_are_paler_by_the_ratio_of_their_radii():
    """Two standard deviations of 0.15 m and 0.6 m are 0.3 m and 1.2 m."""
    variances = np.array([np.eye(4) * sigma_m**2 for sigma_m in (0.05, 0.15, 0.6)])
    tracks = replace(
        TRACKS,
        numbers=np.arange(3),
        states=np.zeros((3, 4)),
        covariances=variances,
        radii_m=np.ones(3),
        unseen_s=np.zeros(3),
    )
    markers = track_markers(tracks, "map")
    alphas = [one.rgba[3] for one in markers if one.namespace == "ellipse"]
    assert alphas == pytest.approx([alphas[0], alphas[0], alphas[0] / 4.0])


def test_a_suspect_has_a_disc_of_another_colour_and_an_arrow_if_it_moves():
    markers = track_markers(replace(TRACKS, suspects=SUSPECTS), "map")
    assert markers[:-3] == track_markers(TRACKS, "map")
    still, disc, arrow = markers[-3:]
    assert still.namespace == disc.namespace == "suspect" and [still.number, disc.number] == [0, 1]
    assert still.kind == CYLINDER and still.size_m[:2] == (0.5, 0.5)
    assert still.rgba[:3] != markers[0].rgba[:3]
    assert disc.place_m[:2] == arrow.place_m[:2] == (3.0, 4.0)
    assert (arrow.kind, arrow.number, arrow.size_m[0]) == (ARROW, 1, 0.8)
    assert arrow.yaw_rad == pytest.approx(math.pi)


def test_markers_tell_the_rows_of_tracks_and_suspects():
    known = replace(TRACKS, suspects=SUSPECTS)
    expected = [
        (1.0, 2.0, 0.0, 1.5, 0.3, TrackKind.SEEN),
        (4.0, 5.0, 0.0, 0.0, 0.5, TrackKind.HIDDEN),
        (1.0, 2.0, 0.0, 0.0, 0.25, TrackKind.SUSPECT),
        (3.0, 4.0, -0.8, 0.0, 0.3, TrackKind.SUSPECT),
    ]
    assert track_rows(known).tolist() == [list(map(float, row)) for row in expected]
    shown = marker_array(track_markers(known, "odom0"), replaces_all=True)
    frame, rows = rows_of_markers(shown.markers)
    assert frame == "odom0" and rows == pytest.approx(np.array(expected))


def test_markers_without_tracks_have_no_frame_and_no_rows():
    frame, rows = rows_of_markers(marker_array([], replaces_all=True).markers)
    assert (frame, rows.shape) == ("", (0, 6))
    assert track_rows(Tracks.none(0.0)).shape == (0, 6)


@pytest.mark.parametrize("x_m, diameter_m", [(math.nan, 0.6), (1e7, 0.6), (1.0, -0.6)])
def test_a_marker_that_is_nowhere_or_has_no_size_is_refused(x_m, diameter_m):
    shown = marker_array(track_markers(TRACKS, "map"))
    shown.markers[0].pose.position.x, shown.markers[0].scale.x = x_m, diameter_m
    with pytest.raises(ValueError, match="marker disc 7: .*; expected a disc in the world"):
        rows_of_markers(shown.markers)


def test_more_markers_than_a_page_can_draw_are_refused():
    shown = marker_array(track_markers(TRACKS, "map"))
    assert len(rows_of_markers(shown.markers[:1] * 1000)[1]) == 1000
    with pytest.raises(ValueError, match="1001 tracks and suspects; expected 1000 at most"):
        rows_of_markers(shown.markers[:1] * 1001)


def test_the_ellipse_is_turned_to_its_larger_axis():
    """Variances 9 and 1 along axes at 30 and 120 degrees."""
    cos, sin = math.cos(math.pi / 6), math.sin(math.pi / 6)
    turn = np.array([[cos, -sin], [sin, cos]])
    axes, direction_rad = ellipse(turn @ np.diag([9.0, 1.0]) @ turn.T)
    assert axes == pytest.approx((3.0, 1.0)) and direction_rad == pytest.approx(math.pi / 6)


def test_the_messages_have_states_radii_numbers_and_covariances():
    fields = [dict(one) for one in obstacle_fields(TRACKS)]
    covariance = fields[0].pop("covariance")
    assert fields[0] == {"number": 7, "x": 1.0, "y": 2.0, "vx": 0.0, "vy": 1.5, "radius": 0.3}
    assert covariance.tolist() == COVARIANCE.ravel().tolist()
    assert [one["number"] for one in fields] == [7, 9]


def test_tracks_are_published_at_10_hz_and_once_more_when_they_end():
    schedule = TrackSchedule()
    assert schedule.pop(0.0, None) is None
    assert schedule.pop(0.1, Tracks.none(0.0)) is None
    published = [k for k in range(40) if schedule.pop(3.0 + k / 40, TRACKS) is not None]
    assert published == [0, 4, 8, 12, 16, 20, 24, 28, 32, 36]
    ended = [schedule.pop(4.0 + k / 40, None) for k in range(40)]
    assert [len(one) for one in ended if one is not None] == [0]


def test_suspects_are_published_without_any_track_and_once_more_when_they_end():
    schedule, suspected = TrackSchedule(), replace(Tracks.none(3.0), suspects=SUSPECTS)
    assert schedule.pop(3.0, suspected) is suspected
    ended = [schedule.pop(3.0 + k / 40, Tracks.none(4.0)) for k in range(40)]
    assert len([one for one in ended if one is not None]) == 1
