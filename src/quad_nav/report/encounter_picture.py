"""A strip of frames about the closest moment of an encounter, to scale."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch

from quad_nav.recording.trace import FlightTrace
from quad_nav.report.encounters import Encounter, gap_text
from quad_nav.report.measures import Tracks, pair_separations_m
from quad_nav.report.scene_drawing import draw_hull, draw_scene
from quad_nav.report.style import ALARM, QUIET, colour, new_figure

_FRAMES = 5
_HALF_SIZE_M = 1.6
_TRAIL_S = 6.0
_ARROW_S = 1.5  # velocity arrows show the way of this time
# Frames are this way apart, but no longer than this time.
_STEP_M, _STEP_S = 0.45, 1.5


def encounter_picture(trace: FlightTrace, among: Tracks, one: Encounter) -> Figure:
    """Frames of equal size and place; the closest moment has a frame around it."""
    times_s = frame_times(trace, among, one)
    figure = new_figure(2.05)
    row = figure.subplots(1, _FRAMES, sharex=True, sharey=True)
    for axes, time_s in zip(row, times_s):
        _draw_frame(axes, trace, among, one, float(time_s))
    for axes in row[len(times_s) :]:
        axes.set_visible(False)
    return figure


def frame_times(trace: FlightTrace, among: Tracks, one: Encounter) -> np.ndarray:
    """At most five times about the closest moment, fewer where the flight begins or ends."""
    involved = [k for k in (one.robot, one.other) if k is not None]
    before, after = among.index_at(one.time_s - 2.0), among.index_at(one.time_s + 2.0)
    fastest_mps = 0.0
    for k in involved:
        way = np.diff(among.positions_m[k, before : after + 1], axis=0)
        time_s = among.times_s[after] - among.times_s[before]
        if time_s > 0:
            fastest_mps = max(fastest_mps, float(np.nansum(np.hypot(*way.T)) / time_s))
    step_s = min(_STEP_S, _STEP_M / fastest_mps) if fastest_mps > 0 else _STEP_S
    half = _FRAMES // 2
    times_s = one.time_s + step_s * np.arange(-half, half + 1)
    inside = (times_s >= among.times_s[0] - 1e-9) & (times_s <= among.times_s[-1] + 1e-9)
    return times_s[inside]


def _draw_frame(
    axes: Axes, trace: FlightTrace, among: Tracks, one: Encounter, time_s: float
) -> None:
    now = among.index_at(time_s)
    shown = (
        one.x_m - _HALF_SIZE_M,
        one.x_m + _HALF_SIZE_M,
        one.y_m - _HALF_SIZE_M,
        one.y_m + _HALF_SIZE_M,
    )
    draw_scene(axes, trace.scene, shown)
    for k in range(len(trace.robots)):
        _draw_robot(axes, among, k, now, trace.robot_radius_m)
    nearest = abs(time_s - one.time_s) < 1e-9
    if nearest and one.other is None:
        axes.plot(one.x_m, one.y_m, "X", color=ALARM, mec="white", ms=10, zorder=9)
    axes.set(xlim=shown[:2], ylim=shown[2:], xticks=[], yticks=[])
    axes.set_title(f"{time_s:.1f} s", loc="center", fontsize=9, color=ALARM if nearest else "black")
    axes.set_xlabel(
        _gap(trace, among, one, now, nearest),
        fontsize=8.5,
        labelpad=3,
        color=ALARM if nearest else QUIET,
    )
    for spine in axes.spines.values():
        spine.set(visible=True, color=ALARM if nearest else "#a0a8b0", lw=1.8 if nearest else 0.8)


def _gap(trace: FlightTrace, among: Tracks, one: Encounter, now: int, nearest: bool) -> str:
    if one.other is None:
        return ""
    if nearest:
        return gap_text(one.gap_m)
    return gap_text(pair_separations_m(among, one.robot, one.other, trace.robot_radius_m)[now])


def _draw_robot(axes: Axes, among: Tracks, robot: int, now: int, radius_m: float) -> None:
    first = int(np.searchsorted(among.times_s, among.times_s[now] - _TRAIL_S))
    trail = among.positions_m[robot, first : now + 1]
    axes.plot(*trail.T, color=(*colour(robot), 0.6), lw=1.2, zorder=3)
    here = among.positions_m[robot, now]
    draw_hull(
        axes, robot, here, among.yaws_rad[robot, now], radius_m, numbered=len(among.yaws_rad) > 2
    )
    before, after = max(now - 4, 0), min(now + 4, len(among.times_s) - 1)
    time_s = among.times_s[after] - among.times_s[before]
    if time_s <= 0:
        return
    way = (among.positions_m[robot, after] - among.positions_m[robot, before]) / time_s * _ARROW_S
    if np.hypot(*way) > 0.05:
        axes.add_patch(
            FancyArrowPatch(
                tuple(here),
                tuple(here + way),
                arrowstyle="-|>",
                color="black",
                lw=1.1,
                mutation_scale=9,
                shrinkA=0,
                shrinkB=0,
                zorder=8,
            )
        )
