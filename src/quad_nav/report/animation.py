"""Write an animation of a flight, as GIF or MP4."""

from __future__ import annotations

import math
import shutil
import subprocess
from pathlib import Path
from typing import Any, List, Optional, Tuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch
from numpy.typing import NDArray
from PIL import Image

from quad_nav.files.output import replacing
from quad_nav.geometry import Pose2D
from quad_nav.recording.trace import FlightTrace
from quad_nav.report.measures import Tracks, resampled_tracks
from quad_nav.report.scene_drawing import draw_moving, draw_scene, extent
from quad_nav.report.style import ALARM, centred_text, colour, styled

_WIDTH_IN, _DPI = 5.4, 100
_FRAMES_PER_S = 10
_SPEEDS = (1, 2, 4, 8, 16, 32, 64)
_LONGEST_S = 25.0
_TRAIL_S = 10.0
_CONTACT_S = 2.0  # how long a contact is shown
_COLOURS = 128


def animation_faults(path: Path, flights: int = 1) -> List[str]:
    """Return the reasons why an animation cannot be written.

    These are several flights, an unknown suffix, or a missing ffmpeg.
    """
    problems = []
    if flights != 1:
        problems.append(f"animation: {flights} flights, expected one")
    if path.suffix.lower() not in (".gif", ".mp4"):
        problems.append(f"animation: {path}, expected a name that ends in .gif or .mp4")
    elif path.suffix.lower() == ".mp4" and shutil.which("ffmpeg") is None:
        problems.append(
            f"animation: {path} needs the program ffmpeg, which is not in the PATH;"
            " install it or write a .gif"
        )
    return problems


def animate_flight(trace: FlightTrace, path: Path) -> None:
    """Write the animation atomically; ``animation_faults`` must be empty.

    Raises:
        OSError: The file cannot be written.
    """
    write = _write_gif if path.suffix.lower() == ".gif" else _write_mp4
    with styled(), replacing(path) as partial:
        write(_View(trace), partial)


def _write_gif(view: _View, path: Path) -> None:
    """Write all frames with one palette, which avoids flicker and compresses well."""
    palette = view.sample().quantize(_COLOURS, method=Image.Quantize.FASTOCTREE)
    frames = [
        view.image(time_s).quantize(palette=palette, dither=Image.Dither.NONE)
        for time_s in view.times_s
    ]
    frames[0].save(
        path,
        format="GIF",
        save_all=True,
        append_images=frames[1:],
        loop=0,
        optimize=False,
        duration=1000 // _FRAMES_PER_S,
    )


def _write_mp4(view: _View, path: Path) -> None:
    from matplotlib.animation import FFMpegWriter

    writer = FFMpegWriter(fps=_FRAMES_PER_S, extra_args=["-pix_fmt", "yuv420p", "-f", "mp4"])
    try:
        with writer.saving(view.figure, str(path), _DPI):
            for time_s in view.times_s:
                view.show(time_s)
                writer.grab_frame()
    except subprocess.CalledProcessError as error:
        raise OSError(None, f"ffmpeg exited with status {error.returncode}") from error


class _View:
    """Scene from above; ``times_s`` are the times of the frames, shape (f,)."""

    def __init__(self, trace: FlightTrace) -> None:
        self._trace = trace
        self._tracks = resampled_tracks(trace)
        self._speed = _speed(self._tracks)
        self.times_s = _frame_times(self._tracks, self._speed)
        self.figure, self._axes = _empty_scene(trace, self._tracks)
        self._canvas: Any = FigureCanvasAgg(self.figure)
        self._title = self._axes.set_title("")
        self._moving: List[Patch] = []
        self._robots = [_MovingRobot(self._axes, k, trace) for k in range(len(trace.robots))]
        self._contacts: Line2D = self._axes.plot(
            [], [], "X", color=ALARM, mec="white", ms=14, zorder=11
        )[0]

    def show(self, time_s: float) -> None:
        touched = [
            contact
            for contact in self._trace.contacts
            if contact.time_s <= time_s < contact.time_s + _CONTACT_S
        ]
        self._contacts.set_data(
            [contact.x_m for contact in touched], [contact.y_m for contact in touched]
        )
        for robot in self._robots:
            robot.show(self._tracks, time_s)
        for patch in self._moving:
            patch.remove()
        self._moving = draw_moving(self._axes, self._trace, time_s)
        speed = f"   × {self._speed}" if self._speed > 1 else ""
        self._title.set_text(f"{time_s:.1f} s{speed}")

    def image(self, time_s: float) -> Image.Image:
        self.show(time_s)
        self._canvas.draw()
        return Image.fromarray(np.asarray(self._canvas.buffer_rgba())).convert("RGB")

    def sample(self) -> Image.Image:
        """Return frames with all colours side by side: first, middle, last, first contact."""
        times_s = [float(self.times_s[k]) for k in (0, len(self.times_s) // 2, -1)]
        images = [
            self.image(time_s)
            for time_s in times_s + [contact.time_s for contact in self._trace.contacts[:1]]
        ]
        together = Image.new("RGB", (images[0].width * len(images), images[0].height))
        for k, image in enumerate(images):
            together.paste(image, (k * image.width, 0))
        return together


class _MovingRobot:
    """Hull, nose, trail, number and active goal of one robot."""

    def __init__(self, axes: Axes, number: int, trace: FlightTrace) -> None:
        self._number, self._radius_m = number, trace.robot_radius_m
        self._goals = trace.robots[number].goals
        ink = colour(number)
        self._hull = Circle(
            (0, 0), trace.robot_radius_m, facecolor=(*ink, 0.4), edgecolor=ink, lw=1.5, zorder=6
        )
        axes.add_patch(self._hull)
        self._nose: Line2D = axes.plot([], [], color=ink, lw=2, zorder=7)[0]
        self._trail: Line2D = axes.plot([], [], color=(*ink, 0.6), lw=1.5, zorder=4)[0]
        self._goal: Line2D = axes.plot([], [], "o", ms=11, color="none", mec=ink, mew=2, zorder=5)[
            0
        ]
        self._label = centred_text(axes, (0.0, 0.0), str(number), 9, ink, zorder=8)

    def show(self, tracks: Tracks, time_s: float) -> None:
        now = tracks.index_at(time_s) if len(tracks.times_s) else None
        there = now is not None and bool(np.isfinite(tracks.yaws_rad[self._number, now]))
        for artist in (self._hull, self._nose, self._trail, self._label):
            artist.set_visible(there)
        if now is not None and there:
            self._show_body(tracks, now, tracks.positions_m[self._number, now])
        goal = self._goal_at(time_s)
        self._goal.set_data(*(([], []) if goal is None else ([goal[0]], [goal[1]])))

    def _show_body(self, tracks: Tracks, now: int, here: NDArray[np.float64]) -> None:
        yaw_rad = float(tracks.yaws_rad[self._number, now])
        ahead = np.array(Pose2D(0.0, 0.0, yaw_rad).rotate(self._radius_m, 0.0))
        self._hull.set(center=tuple(here))
        self._nose.set_data(*np.transpose([here + 0.5 * ahead, here + ahead]))
        self._label.set_position(tuple(here - 0.15 * ahead))
        first = int(np.searchsorted(tracks.times_s, tracks.times_s[now] - _TRAIL_S))
        self._trail.set_data(*tracks.positions_m[self._number, first : now + 1].T)

    def _goal_at(self, time_s: float) -> Optional[List[float]]:
        for goal in self._goals:
            if goal.sent_s <= time_s and (goal.ended_s is None or time_s < goal.ended_s):
                return [goal.pose.x_m, goal.pose.y_m]
        return None


def _speed(tracks: Tracks) -> int:
    duration_s = float(tracks.times_s[-1] - tracks.times_s[0]) if len(tracks.times_s) else 0.0
    return next(
        (speed for speed in _SPEEDS if duration_s / speed <= _LONGEST_S),
        math.ceil(duration_s / _LONGEST_S),
    )


def _frame_times(tracks: Tracks, speed: int) -> NDArray[np.float64]:
    if len(tracks.times_s) == 0:
        return np.zeros(1)
    first_s, last_s = tracks.times_s[[0, -1]]
    return np.append(np.arange(first_s, last_s, speed / _FRAMES_PER_S), last_s)


def _empty_scene(trace: FlightTrace, tracks: Tracks) -> Tuple[Figure, Axes]:
    x0, x1, y0, y1 = extent(trace.scene, tracks)
    height_in = _WIDTH_IN * min(max((y1 - y0) / (x1 - x0), 0.3), 1.6)
    # MP4 wants even numbers of pixels.
    figure = Figure(figsize=(_WIDTH_IN, 2 * round(height_in * _DPI / 2) / _DPI), dpi=_DPI)
    axes = figure.add_axes((0.01, 0.01, 0.98, 0.93))
    draw_scene(axes, trace.scene)
    axes.set(xlim=(x0, x1), ylim=(y0, y1), xticks=[], yticks=[])
    for spine in axes.spines.values():
        spine.set_visible(trace.scene is None)
    return figure, axes
