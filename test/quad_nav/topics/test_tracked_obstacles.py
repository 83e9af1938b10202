"""Tracked moving obstacles on topics: markers, numbers, when they are published."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from quad_nav.costmap.tracks import Tracks
from quad_nav.recording import messages
from quad_nav.topics.markers import ARROW, CYLINDER
from quad_nav.topics.tracked_obstacles import (
    TrackKind,
    TrackSchedule,
    ellipse,
    obstacle_fields,
    rows_of_message,
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


def test_a_track_has_a_disc_an_ellipse_and_if_it_moves_an_arrow_to_its_place_in_a_second():
    markers = track_markers(TRACKS, "odom0")
    moving = {one.namespace: one for one in markers if one.number == 7}
    assert set(moving) == {"disc", "ellipse", "number", "velocity"}
    assert moving["disc"].kind == CYLINDER and moving["disc"].size_m[:2] == (0.6, 0.6)
    assert moving["ellipse"].size_m[:2] == pytest.approx((0.8, 0.4))
    arrow = moving["velocity"]
    assert arrow.kind == ARROW and arrow.size_m[0] == 1.5
    assert arrow.yaw_rad == pytest.approx(math.pi / 2)
    assert all(one.frame == "odom0" for one in markers)
    standing = {one.namespace: one for one in markers if one.number == 9}
    assert "velocity" not in standing
    assert standing["disc"].rgba[3] < moving["disc"].rgba[3]  # it is hidden


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


def message_of(tracks):
    rows = {
        name: [messages.stamped("quad/MovingObstacle", fields, 0) for fields in each]
        for name, each in obstacle_fields(tracks).items()
    }
    message = messages.stamped("quad/MovingObstacles", rows, 0, "odom0")
    return messages.decode(messages.encode(message), "quad/MovingObstacles")


def test_messages_tell_the_rows_of_tracks_and_suspects():
    known = replace(TRACKS, suspects=SUSPECTS)
    expected = [
        (1.0, 2.0, 0.0, 1.5, 0.3, TrackKind.SEEN),
        (4.0, 5.0, 0.0, 0.0, 0.5, TrackKind.HIDDEN),
        (1.0, 2.0, 0.0, 0.0, 0.25, TrackKind.SUSPECT),
        (3.0, 4.0, -0.8, 0.0, 0.3, TrackKind.SUSPECT),
    ]
    message = message_of(known)
    assert track_rows(known).tolist() == [list(map(float, row)) for row in expected]
    assert rows_of_message(message).tolist() == track_rows(known).tolist()
    first, second = message.obstacles
    assert (first.number, second.number, second.unseen) == (7, 9, 0.4)
    assert first.covariance.tolist() == COVARIANCE.ravel().tolist()
    none = Tracks.none(0.0)
    assert rows_of_message(message_of(none)).shape == track_rows(none).shape == (0, 6)


@pytest.mark.parametrize("x_m, radius_m", [(math.nan, 0.3), (1e7, 0.3), (1.0, -0.3)])
def test_an_obstacle_that_is_nowhere_or_has_no_size_is_refused(x_m, radius_m):
    message = message_of(TRACKS)
    message.obstacles[0].x, message.obstacles[0].radius = x_m, radius_m
    with pytest.raises(ValueError, match="expected a disc in the world"):
        rows_of_message(message)


def test_more_than_a_page_can_draw_are_refused():
    message = message_of(TRACKS)
    message.obstacles *= 500
    assert len(rows_of_message(message)) == 1000
    message.suspects.append(message.obstacles[0])
    with pytest.raises(ValueError, match="1001 tracks and suspects; expected 1000 at most"):
        rows_of_message(message)


def test_the_ellipse_is_turned_to_its_larger_axis():
    """Variances 9 and 1 along axes at 30 and 120 degrees."""
    cos, sin = math.cos(math.pi / 6), math.sin(math.pi / 6)
    turn = np.array([[cos, -sin], [sin, cos]])
    axes, direction_rad = ellipse(turn @ np.diag([9.0, 1.0]) @ turn.T)
    assert axes == pytest.approx((3.0, 1.0)) and direction_rad == pytest.approx(math.pi / 6)


def test_tracks_and_suspects_are_published_at_10_hz_and_once_more_when_they_end():
    schedule = TrackSchedule()
    assert schedule.pop(0.0, None) is None
    assert schedule.pop(0.1, Tracks.none(0.0)) is None
    published = [k for k in range(40) if schedule.pop(3.0 + k / 40, TRACKS) is not None]
    assert published == [0, 4, 8, 12, 16, 20, 24, 28, 32, 36]
    ended = [schedule.pop(4.0 + k / 40, None) for k in range(40)]
    assert [len(one) for one in ended if one is not None] == [0]
    suspected = replace(Tracks.none(5.0), suspects=SUSPECTS)
    assert schedule.pop(5.0, suspected) is suspected
    ended = [schedule.pop(5.0 + k / 40, Tracks.none(5.0)) for k in range(40)]
    assert len([one for one in ended if one is not None]) == 1
