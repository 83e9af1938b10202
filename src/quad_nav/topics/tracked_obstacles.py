"""Tracked moving obstacles as topics: markers for people, ``quad/MovingObstacles`` for programs.

The page in the browser shows the rows that ``rows_of_markers`` reads from the markers.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.tracks import Tracks
from quad_nav.timing import Schedule
from quad_nav.topics.markers import ARROW, CYLINDER, TEXT, Marker, Rgba
from quad_nav.topics.validation import MAX_MAGNITUDE

MARKERS_TOPIC, TRACKS_TOPIC = "moving_obstacles", "moving_obstacle_tracks"
"""Names below ``/move_base{i}``."""
RATE_HZ = 10.0
SIGMAS = 2.0
"""Half axes of the ellipse of the position, in standard deviations."""

MAX_ROWS = 1000
"""Tracks and suspects that ``rows_of_markers`` takes: the page draws each of them."""

_DISC, _VELOCITY = "disc", "velocity"
_SUSPECT, _SUSPECT_VELOCITY = "suspect", "suspect velocity"
_ARROWS_OF = {_DISC: _VELOCITY, _SUSPECT: _SUSPECT_VELOCITY}

_DISC_RGBA: Rgba = (0.95, 0.35, 0.10, 0.45)
_HIDDEN_RGBA: Rgba = (0.95, 0.35, 0.10, 0.18)
_SUSPECT_RGBA: Rgba = (0.95, 0.75, 0.05, 0.6)
_ELLIPSE_RGB = (0.55, 0.10, 0.60)
_ELLIPSE_ALPHA = 0.40
_PALER_BEYOND_M = 0.3  # ellipses with a larger mean radius are paler, to hide less of the scene
_ARROW_RGBA: Rgba = (0.75, 0.10, 0.05, 0.9)
_TEXT_RGBA: Rgba = (0.1, 0.1, 0.1, 0.9)
_HEIGHT_M, _ELLIPSE_M, _TEXT_M, _ARROW_M = 0.5, 0.02, 0.25, 0.08
_ARROW_S = 1.0  # the arrow leads to where the obstacle is after this time
_SLOWEST_MPS = 0.05


class TrackKind(IntEnum):
    """Kinds of obstacles in ``track_rows``: a track seen now or hidden, or a suspect."""

    SEEN, HIDDEN, SUSPECT = range(3)


class TrackSchedule:
    """Decides when tracks and suspects are published: at a rate, and once more when they end."""

    def __init__(self) -> None:
        """Publish nothing yet."""
        self._schedule = Schedule(RATE_HZ)
        self._had_any = False
        self.restart(0.0)

    def restart(self, now_s: float) -> None:
        """Restart after a clock jump."""
        self._schedule.start(now_s)

    def pop(self, now_s: float, tracks: Optional[Tracks]) -> Optional[Tracks]:
        """Return the tracks to publish now, None if nothing is due or nothing has changed."""
        tracks = Tracks.none(now_s) if tracks is None else tracks
        has_any = tracks.any_may_move
        if not (has_any or self._had_any) or not self._schedule.pop(now_s):
            return None
        self._had_any = has_any
        return tracks


def track_markers(tracks: Tracks, frame: str) -> List[Marker]:
    """Return discs, arrows of the velocities, ellipses of two sigma and numbers.

    Suspects have discs of another colour and arrows only.

    Args:
        tracks: The tracks and suspects; discs of those that are not seen now are paler.
        frame: Their frame.
    """
    markers = [
        marker
        for number, state, covariance, radius_m, hidden_s in zip(
            tracks.numbers.tolist(),
            tracks.states.tolist(),
            tracks.covariances,
            tracks.radii_m.tolist(),
            tracks.unseen_s.tolist(),
        )
        for marker in _markers(frame, number, state, covariance, radius_m, hidden_s > 0.0)
    ]
    for number, (*state, radius_m) in enumerate(tracks.suspects.tolist()):
        disc = _disc(frame, _SUSPECT, number, state, radius_m, _SUSPECT_RGBA)
        markers += [disc, *_arrows(frame, _SUSPECT_VELOCITY, number, state)]
    return markers


def _markers(
    frame: str,
    number: int,
    state: List[float],
    covariance: NDArray[np.float64],
    radius_m: float,
    is_hidden: bool,
) -> List[Marker]:
    x_m, y_m = state[:2]
    number %= 2**31  # an int32 in the message
    rgba = _HIDDEN_RGBA if is_hidden else _DISC_RGBA
    (major_m, minor_m), turn_rad = ellipse(covariance[:2, :2])
    flat = (2.0 * SIGMAS * major_m, 2.0 * SIGMAS * minor_m, _ELLIPSE_M)
    mean_m = SIGMAS * math.sqrt(major_m * minor_m)
    alpha = _ELLIPSE_ALPHA * _PALER_BEYOND_M / max(mean_m, _PALER_BEYOND_M)
    text, name = (0.0, 0.0, _TEXT_M), str(number)
    top, above = (x_m, y_m, _HEIGHT_M), (x_m, y_m, _HEIGHT_M + _TEXT_M)
    return [
        _disc(frame, _DISC, number, state, radius_m, rgba),
        Marker(frame, "ellipse", number, CYLINDER, top, flat, (*_ELLIPSE_RGB, alpha), turn_rad),
        Marker(frame, "number", number, TEXT, above, text, _TEXT_RGBA, text=name),
        *_arrows(frame, _VELOCITY, number, state),
    ]


def _disc(
    frame: str, namespace: str, number: int, state: List[float], radius_m: float, rgba: Rgba
) -> Marker:
    middle = (state[0], state[1], 0.5 * _HEIGHT_M)
    size = (2.0 * radius_m, 2.0 * radius_m, _HEIGHT_M)
    return Marker(frame, namespace, number, CYLINDER, middle, size, rgba)


def _arrows(frame: str, namespace: str, number: int, state: List[float]) -> List[Marker]:
    """Return the arrow of a velocity, none for what stands."""
    x_m, y_m, vx_mps, vy_mps = state
    speed_mps = math.hypot(vx_mps, vy_mps)
    if speed_mps <= _SLOWEST_MPS:
        return []
    top, turn_rad = (x_m, y_m, _HEIGHT_M), math.atan2(vy_mps, vx_mps)
    arrow = (_ARROW_S * speed_mps, _ARROW_M, _ARROW_M)
    return [Marker(frame, namespace, number, ARROW, top, arrow, _ARROW_RGBA, turn_rad)]


def ellipse(covariance: NDArray[np.float64]) -> Tuple[Tuple[float, float], float]:
    """Return the standard deviations along the axes, the larger first, and its direction.

    Args:
        covariance: float64[2, 2].
    """
    (xx, xy), (_, yy) = covariance.tolist()
    middle, half = 0.5 * (xx + yy), math.hypot(0.5 * (xx - yy), xy)
    axes = math.sqrt(middle + half), math.sqrt(max(middle - half, 0.0))
    return axes, 0.5 * math.atan2(2.0 * xy, xx - yy)


def obstacle_fields(tracks: Tracks) -> List[Dict[str, Any]]:
    """Return the fields of a ``quad/MovingObstacle`` for each track; suspects have none."""
    return [
        {
            "number": number % 2**32,
            **dict(zip(("x", "y", "vx", "vy"), state)),
            "radius": radius_m,
            "covariance": covariance.ravel(),
        }
        for number, state, radius_m, covariance in zip(
            tracks.numbers.tolist(),
            tracks.states.tolist(),
            tracks.radii_m.tolist(),
            tracks.covariances,
        )
    ]


def track_rows(tracks: Tracks) -> NDArray[np.float64]:
    """Return tracks and suspects as one table.

    Args:
        tracks: The tracks and suspects.

    Returns:
        float64[k, 6], columns x and y (m), their velocities (m/s), radius (m) and ``TrackKind``.
    """
    kinds = np.where(tracks.unseen_s > 0.0, TrackKind.HIDDEN, TrackKind.SEEN)
    known = np.column_stack((tracks.states, tracks.radii_m, kinds))
    kinds = np.full(len(tracks.suspects), TrackKind.SUSPECT)
    return np.vstack((known, np.column_stack((tracks.suspects, kinds))))


def rows_of_markers(markers: Sequence[Any]) -> Tuple[str, NDArray[np.float64]]:
    """Return what a message on ``MARKERS_TOPIC`` says, the inverse of ``track_markers``.

    Args:
        markers: Of type `visualization_msgs/Marker`.

    Returns:
        The frame, "" if there is no track and no suspect, and rows as of ``track_rows``.

    Raises:
        ValueError: A marker is nowhere, has no size, or there are more than ``MAX_ROWS``.
    """
    velocities = {(one.ns, one.id): _velocity(one) for one in markers if one.type == ARROW}
    frame, rows = "", []
    for marker in markers:
        arrow = _ARROWS_OF.get(marker.ns)
        if arrow is None:
            continue
        place, velocity = marker.pose.position, velocities.get((arrow, marker.id), (0.0, 0.0))
        row = (place.x, place.y, *velocity, marker.scale.x / 2.0, _kind(marker))
        if not (np.abs(row) <= MAX_MAGNITUDE).all() or marker.scale.x < 0.0:
            raise ValueError(f"marker {marker.ns} {marker.id}: {row}; expected a disc in the world")
        frame = marker.header.frame_id
        rows.append(row)
    if len(rows) > MAX_ROWS:
        raise ValueError(f"{len(rows)} tracks and suspects; expected {MAX_ROWS} at most")
    return frame, np.array(rows, np.float64).reshape(-1, 6)


def _velocity(arrow: Any) -> Tuple[float, float]:
    turn, speed_mps = arrow.pose.orientation, arrow.scale.x / _ARROW_S
    turn_rad = 2.0 * math.atan2(turn.z, turn.w)  # it turns about z only
    return speed_mps * math.cos(turn_rad), speed_mps * math.sin(turn_rad)


def _kind(disc: Any) -> TrackKind:
    if disc.ns == _SUSPECT:
        return TrackKind.SUSPECT
    is_pale = disc.color.a < 0.5 * (_DISC_RGBA[3] + _HIDDEN_RGBA[3])
    return TrackKind.HIDDEN if is_pale else TrackKind.SEEN
