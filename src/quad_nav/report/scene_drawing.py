"""Draw the scene from above, with robots to scale."""

from __future__ import annotations

from dataclasses import replace
from typing import List, Optional, Sequence, Tuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.patches import Circle, Patch, Polygon
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D
from quad_nav.recording.trace import FlightTrace
from quad_nav.report.measures import Tracks
from quad_nav.report.style import centred_text, colour
from quad_nav.sim.movers import Motions
from quad_nav.sim.obstacles import Obstacle
from quad_nav.sim.scene import Scene

Extent = Tuple[float, float, float, float]
MOVING = "#cc5c33"
_SOLID, _EDGE = "#b9bfc6", "#7c858e"
_PATH_POINTS = 1000
_MOTION_STEP_S, _JUMP_M = 0.1, 1.0


def draw_scene(axes: Axes, scene: Optional[Scene], near: Optional[Extent] = None) -> None:
    """Draw obstacles and walls; those above or below the flight altitude are outlined.

    Args:
        axes: Axes to draw in.
        scene: Scene, or None to draw nothing.
        near: Visible part, if that is a small part of the scene.
    """
    axes.set_aspect("equal")
    if scene is None:
        return
    z_m = scene.altitude_m
    solids: List[Patch] = []
    passed: List[Patch] = []
    for solid in (*scene.wall_boxes(), *scene.obstacles):
        if near is not None and not _is_near(solid, near):
            continue
        (solids if solid.crosses(z_m) else passed).append(Polygon(solid.outline_m()))
    axes.add_collection(
        PatchCollection(solids, facecolor=_SOLID, edgecolor=_EDGE, lw=0.8, zorder=1)
    )
    axes.add_collection(
        PatchCollection(passed, facecolor="none", edgecolor=_EDGE, lw=0.8, linestyle=":", zorder=1)
    )


def draw_motions(axes: Axes, trace: FlightTrace, span: Tuple[float, float]) -> None:
    """Draw the paths of moving obstacles in a time span, and where they are at its end."""
    movers = trace.movers
    if movers is None:
        return
    times_s = np.arange(span[0], span[1], _MOTION_STEP_S)
    for track in np.swapaxes(movers.poses_at(np.append(times_s, span[1])), 0, 1):
        steps_m = np.hypot(*np.diff(track[:, :2], axis=0).T)
        track[1:][steps_m > _JUMP_M] = np.nan  # no line where a loop starts again
        axes.plot(track[:, 0], track[:, 1], color=MOVING, lw=0.6, alpha=0.25, zorder=2)
    draw_moving(axes, trace, span[1])


def draw_moving(axes: Axes, trace: FlightTrace, time_s: float) -> List[Patch]:
    """Draw the moving obstacles where they are at a time; return what is drawn."""
    solids = [] if trace.movers is None else trace.movers.at(time_s)
    patches = [moving_patch(solid) for solid in solids]
    for patch in patches:
        axes.add_patch(patch)
    return patches


def draw_starting(axes: Axes, scene: Scene, moving: Sequence[Obstacle]) -> None:
    """Draw the paths along keyframes, and moving obstacles where they start.

    Args:
        axes: Axes to draw in.
        scene: Scene, whose moving obstacles have the keyframes.
        moving: The obstacles and people where they start.
    """
    for track in keyframe_paths(scene):
        axes.plot(track[:, 0], track[:, 1], color=MOVING, lw=1.0, alpha=0.35, zorder=2)
    for solid in moving:
        axes.add_patch(moving_patch(solid))


def keyframe_paths(scene: Scene) -> List[NDArray[np.float64]]:
    """Return the paths, shape (k, 2) in ``map``, of the obstacles that follow keyframes."""
    paths = []
    for obstacle in scene.moving:
        motion = replace(obstacle.motion, loop=False)  # no line where it starts again
        times_s = np.linspace(0.0, motion.length_s, _PATH_POINTS)
        paths.append(Motions([motion], [0.0]).poses(times_s)[:, 0, :2])
    return paths


def moving_patch(solid: Obstacle) -> Patch:
    """Return the outline of a moving obstacle."""
    patch = Polygon(solid.outline_m())
    patch.set(facecolor=MOVING, edgecolor=_EDGE, lw=0.8, alpha=0.7, zorder=3)
    return patch


def outlines(
    scene: Scene,
) -> Tuple[List[NDArray[np.float64]], List[NDArray[np.float64]]]:
    """Return closed outlines, shape (k, 2) in ``map``, of all obstacles and walls.

    Returns:
        Those at the flight altitude, and those above or below it.
    """
    solids: List[NDArray[np.float64]] = []
    passed: List[NDArray[np.float64]] = []
    for solid in (*scene.wall_boxes(), *scene.obstacles):
        (solids if solid.crosses(scene.altitude_m) else passed).append(solid.outline_m())
    return solids, passed


def _is_near(solid: Obstacle, near: Extent) -> bool:
    x0, x1, y0, y1 = near
    reach_m = solid.reach_m
    return x0 - reach_m <= solid.x_m <= x1 + reach_m and y0 - reach_m <= solid.y_m <= y1 + reach_m


def extent(scene: Optional[Scene], tracks: Tracks) -> Extent:
    """Return (x from, x to, y from, y to) in ``map``: the scene, or without one the paths."""
    return scene_extent(scene, tracks.positions_m.reshape(-1, 2))


def scene_extent(scene: Optional[Scene], flown: NDArray[np.float64]) -> Extent:
    """Return ``extent`` for positions ``flown``, shape (k, 2), NaN if unknown."""
    if scene is not None:
        west, east, south, north = scene.wall_boxes()
        return (
            west.x_m - west.size_x_m / 2,
            east.x_m + east.size_x_m / 2,
            south.y_m - south.size_y_m / 2,
            north.y_m + north.size_y_m / 2,
        )
    flown = flown[np.isfinite(flown).all(axis=1)]
    if len(flown) == 0:
        return (0.0, 1.0, 0.0, 1.0)
    (x0, y0), (x1, y1) = flown.min(axis=0) - 1.0, flown.max(axis=0) + 1.0
    return (float(x0), float(x1), float(y0), float(y1))


def draw_hull(
    axes: Axes,
    robot: int,
    position_m: NDArray[np.float64],
    yaw_rad: float,
    radius_m: float,
    numbered: bool = False,
) -> None:
    """Draw a robot as a disc to scale, with a line from its centre to its nose."""
    if not np.isfinite(position_m).all():
        return
    axes.add_patch(
        Circle(
            tuple(position_m),
            radius_m,
            facecolor=(*colour(robot), 0.35),
            edgecolor=colour(robot),
            lw=1.2,
            zorder=6,
        )
    )
    ahead = np.array(Pose2D(0.0, 0.0, yaw_rad).rotate(radius_m, 0.0))
    axes.plot(
        *np.transpose([position_m, position_m + ahead]),
        color=colour(robot),
        lw=1.6,
        zorder=7,
        solid_capstyle="round",
    )
    if numbered:
        x_m, y_m = position_m - 0.5 * ahead
        centred_text(axes, (x_m, y_m), str(robot), 6.5, colour(robot), zorder=9)
