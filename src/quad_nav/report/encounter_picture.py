"""Strip of frames around the closest moment of an encounter, to scale."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch
from numpy.typing import NDArray

from quad_nav.mission.distances import separations_m
from quad_nav.recording.trace import FlightTrace
from quad_nav.report.encounters import Encounter, separation_text
from quad_nav.report.measures import Tracks
from quad_nav.report.scene_drawing import draw_hull, draw_moving, draw_scene
from quad_nav.report.style import ALARM, QUIET, colour, new_figure

_FRAMES = 5
_HALF_SIZE_M = 1.6
_TRAIL_S = 6.0
_NEAR_M = 3.0  # robots farther outside of a frame are not drawn
_ARROW_S = 1.5  # velocity arrows show the displacement in this time
# Distance flown between two frames, and the longest time between them.
_STEP_M, _STEP_S = 0.45, 1.5


def encounter_picture(trace: FlightTrace, tracks: Tracks, encounter: Encounter) -> Figure:
    """Draw frames of equal size and place; the closest moment is framed in red."""
    times_s = frame_times(trace, tracks, encounter)
    figure = new_figure(2.05)
    row = figure.subplots(1, _FRAMES, sharex=True, sharey=True)
    for axes, time_s in zip(row, times_s):
        _draw_frame(axes, trace, tracks, encounter, float(time_s))
    for axes in row[len(times_s) :]:
        axes.set_visible(False)
    return figure


def frame_times(trace: FlightTrace, tracks: Tracks, encounter: Encounter) -> NDArray[np.float64]:
    """Return at most five times around the closest moment, within the flight, shape (f,)."""
    involved = [k for k in (encounter.robot, encounter.other) if k is not None]
    before, after = tracks.index_at(encounter.time_s - 2.0), tracks.index_at(encounter.time_s + 2.0)
    fastest_mps = 0.0
    for k in involved:
        displacement = np.diff(tracks.positions_m[k, before : after + 1], axis=0)
        time_s = tracks.times_s[after] - tracks.times_s[before]
        if time_s > 0:
            fastest_mps = max(fastest_mps, float(np.nansum(np.hypot(*displacement.T)) / time_s))
    step_s = min(_STEP_S, _STEP_M / fastest_mps) if fastest_mps > 0 else _STEP_S
    half = _FRAMES // 2
    times_s = encounter.time_s + step_s * np.arange(-half, half + 1)
    inside = (times_s >= tracks.times_s[0] - 1e-9) & (times_s <= tracks.times_s[-1] + 1e-9)
    return times_s[inside]


def _draw_frame(
    axes: Axes, trace: FlightTrace, tracks: Tracks, encounter: Encounter, time_s: float
) -> None:
    now = tracks.index_at(time_s)
    x_m, y_m = encounter.x_m, encounter.y_m
    half_m = max(_HALF_SIZE_M, 0.5 * encounter.separation_m + 3.0 * trace.robot_radius_m)
    shown = (x_m - half_m, x_m + half_m, y_m - half_m, y_m + half_m)
    draw_scene(axes, trace.scene, shown)
    draw_moving(axes, trace, time_s)
    offsets_m = np.abs(tracks.positions_m[:, now] - (encounter.x_m, encounter.y_m)).max(axis=1)
    for k in np.flatnonzero(offsets_m < half_m + _NEAR_M):
        _draw_robot(axes, tracks, int(k), now, trace.robot_radius_m)
    nearest = abs(time_s - encounter.time_s) < 1e-9
    ink = ALARM if nearest else QUIET
    if nearest and encounter.is_contact:
        axes.plot(encounter.x_m, encounter.y_m, "X", color=ALARM, mec="white", ms=10, zorder=9)
    axes.set(xlim=shown[:2], ylim=shown[2:], xticks=[], yticks=[])
    axes.set_title(f"{time_s:.1f} s", loc="center", fontsize=9, color=ALARM if nearest else "black")
    gap = _gap(trace, tracks, encounter, now, nearest)
    axes.set_xlabel(gap, fontsize=8.5, labelpad=3, color=ink)
    for spine in axes.spines.values():
        spine.set(visible=True, color=ALARM if nearest else "#a0a8b0", lw=1.8 if nearest else 0.8)


def _gap(trace: FlightTrace, tracks: Tracks, encounter: Encounter, now: int, nearest: bool) -> str:
    if nearest:
        return separation_text(encounter.separation_m)
    if encounter.other is None:
        return ""
    places = tracks.positions_m[:, now]
    both = places[encounter.robot], places[encounter.other]
    gap_m = float(separations_m(*both, trace.robot_radius_m))
    # Around a contact, hulls that overlap by millimetres touch.
    return separation_text(max(gap_m, 0.0) if encounter.separation_m == 0.0 else gap_m)


def _draw_robot(axes: Axes, tracks: Tracks, robot: int, now: int, radius_m: float) -> None:
    first = int(np.searchsorted(tracks.times_s, tracks.times_s[now] - _TRAIL_S))
    trail = tracks.positions_m[robot, first : now + 1]
    axes.plot(*trail.T, color=(*colour(robot), 0.6), lw=1.2, zorder=3)
    here = tracks.positions_m[robot, now]
    draw_hull(
        axes, robot, here, tracks.yaws_rad[robot, now], radius_m, numbered=len(tracks.yaws_rad) > 2
    )
    before, after = max(now - 4, 0), min(now + 4, len(tracks.times_s) - 1)
    time_s = tracks.times_s[after] - tracks.times_s[before]
    if time_s <= 0:
        return
    displacement = (
        (tracks.positions_m[robot, after] - tracks.positions_m[robot, before]) / time_s * _ARROW_S
    )
    if np.hypot(*displacement) > 0.05:
        axes.add_patch(
            FancyArrowPatch(
                tuple(here),
                tuple(here + displacement),
                arrowstyle="-|>",
                color="black",
                lw=1.1,
                mutation_scale=9,
                shrinkA=0,
                shrinkB=0,
                zorder=8,
            )
        )
