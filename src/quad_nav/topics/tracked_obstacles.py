"""Tracked moving obstacles as topics: markers for RViz, ``quad/MovingObstacles`` for programs.

The page in the browser shows the rows that ``rows_of_message`` reads.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any, Dict, List, Mapping, Optional, Tuple

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
"""Tracks and suspects that ``rows_of_message`` takes: the page draws each of them."""

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
        disc = _disc(frame, "suspect", number, state, radius_m, _SUSPECT_RGBA)
        markers += [disc, *_arrows(frame, "suspect velocity", number, state)]
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
        _disc(frame, "disc", number, state, radius_m, rgba),
        Marker(frame, "ellipse", number, CYLINDER, top, flat, (*_ELLIPSE_RGB, alpha), turn_rad),
        Marker(frame, "number", number, TEXT, above, text, _TEXT_RGBA, text=name),
        *_arrows(frame, "velocity", number, state),
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


def obstacle_fields(tracks: Tracks) -> Mapping[str, List[Dict[str, Any]]]:
    """Return the fields of each ``quad/MovingObstacle``: of the tracks and of the suspects."""
    known = zip(
        tracks.numbers % 2**32,
        tracks.states,
        tracks.radii_m,
        tracks.covariances.reshape(-1, 16),
        tracks.unseen_s,
    )
    suspects = (
        (number, row[:4], row[4], np.zeros(16), 0.0) for number, row in enumerate(tracks.suspects)
    )
    return {
        name: [
            {
                "number": int(number),
                **dict(zip(("x", "y", "vx", "vy"), state.tolist())),
                "radius": float(radius_m),
                "covariance": covariance,
                "unseen": float(unseen_s),
            }
            for number, state, radius_m, covariance, unseen_s in obstacles
        ]
        for name, obstacles in (("obstacles", known), ("suspects", suspects))
    }


def track_rows(tracks: Tracks) -> NDArray[np.float64]:
    """Return tracks and suspects as one table.

    Returns:
        float64[k, 6], columns x and y (m), their velocities (m/s), radius (m) and ``TrackKind``.
    """
    kinds = np.where(tracks.unseen_s > 0.0, TrackKind.HIDDEN, TrackKind.SEEN)
    known = np.column_stack((tracks.states, tracks.radii_m, kinds))
    kinds = np.full(len(tracks.suspects), TrackKind.SUSPECT)
    return np.vstack((known, np.column_stack((tracks.suspects, kinds))))


def rows_of_message(message: Any) -> NDArray[np.float64]:
    """Return what a ``quad/MovingObstacles`` of rospy or of a recording says.

    Returns:
        Rows as of ``track_rows``, in the message's frame.

    Raises:
        ValueError: An obstacle is nowhere, has no size, or there are more than ``MAX_ROWS``.
    """
    count = len(message.obstacles) + len(message.suspects)
    if count > MAX_ROWS:
        raise ValueError(f"{count} tracks and suspects; expected {MAX_ROWS} at most")
    rows = [
        (one.x, one.y, one.vx, one.vy, one.radius, kind)
        for one, kind in (
            *((one, _kind(one)) for one in message.obstacles),
            *((one, TrackKind.SUSPECT) for one in message.suspects),
        )
    ]
    for row in rows:
        if not (np.abs(row) <= MAX_MAGNITUDE).all() or row[4] < 0.0:
            raise ValueError(f"obstacle {row}; expected a disc in the world")
    return np.array(rows, np.float64).reshape(-1, 6)


def _kind(track: Any) -> TrackKind:
    return TrackKind.HIDDEN if track.unseen > 0.0 else TrackKind.SEEN
