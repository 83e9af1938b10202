"""Show a flight in rerun's 3D viewer, live or saved to a file.

rerun is an optional extra: ``pip install 'quad-nav[view]'``.
"""

from __future__ import annotations

import importlib
import os
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, List, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import InputError
from quad_nav.files.output import make_folder, output_faults
from quad_nav.geometry import Pose2D, Pose3D, Scan
from quad_nav.mission.actions import Action
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.recording.viewer_solids import colour_of, solid
from quad_nav.sim.colours import ROBOT_COLOURS
from quad_nav.sim.contacts import Contact
from quad_nav.topics.markers import ARROW, SPHERE, goal_markers, quadcopter_markers, scene_markers
from quad_nav.topics.publishing import FlownPath
from quad_web.view.items import hit_points

SUFFIX = ".rrd"
_TIMELINE = "flight"
_LOOPBACK, _PORT = "127.0.0.1", 9876
_STARTS_WITHIN_S = 30.0
_BACKGROUND_RGB = (250, 250, 250)


class View(FlightObserver):
    """Shows the scene, quadcopters, scans, plans, goals, trails and contacts.

    ``path`` is the file to save to. None opens the viewer and shows the flight live.

    Raises:
        InputError: rerun is not installed, the viewer does not start, or the file cannot be
            created.
    """

    needs_single_process = True

    def __init__(self, path: Optional[Path] = None) -> None:
        self._rr = _rerun()
        if path is not None:
            _check(path)
        self._rr.init("quad")
        if path is None:
            _spawn(self._rr)
        else:
            self._rr.save(path)
        layout = importlib.import_module("rerun.blueprint")
        self._rr.send_blueprint(
            layout.Blueprint(
                layout.Spatial3DView(origin="map", name="flight", background=_BACKGROUND_RGB),
                collapse_panels=True,
            )
        )

    def on_start(self, flight: Flight) -> None:
        """Log the scene, the bodies and the goals."""
        self._flight = flight
        self._altitude_m = flight.setup.scene.altitude_m
        self._trails: List[FlownPath[Tuple[float, float, float]]] = [
            FlownPath(_place) for _ in flight.robots
        ]
        self._rr.log("map", self._rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for marker in scene_markers(flight.setup.scene):
            self._rr.log(
                f"map/{marker.namespace}/{marker.number}", solid(self._rr, marker), static=True
            )
        for marker in quadcopter_markers(len(flight.robots)):
            self._rr.log(
                f"map/{marker.namespace}/body/{marker.number}", solid(self._rr, marker), static=True
            )
        self._show_goals(0.0)
        self.on_move(flight)

    def on_contact(self, contact: Contact) -> None:
        """Log a contact."""
        self._at(contact.time_s)
        self._rr.log(
            "map/contacts",
            self._rr.Points3D(
                [(contact.x_m, contact.y_m, self._altitude_m)],
                colors=[(220, 0, 0)],
                radii=[0.12],
                labels=[str(contact)],
            ),
        )
        self._rr.log("contacts", self._rr.TextLog(str(contact), level="WARN"))

    def on_scan(self, robot: int, scan: Scan, map_from_lidar: Pose3D) -> None:
        """Log a scan as points."""
        self._at(scan.stamp_s)
        self._rr.log(
            f"map/quad{robot}/scan",
            self._rr.Points3D(
                hit_points(scan, map_from_lidar), colors=[_colour(robot)], radii=[0.025]
            ),
        )

    def on_move(self, flight: Flight) -> None:
        """Log poses and trails."""
        self._at(flight.now_s)
        for robot, state in enumerate(flight.states):
            pose = state.map_from_base
            self._rr.log(
                f"map/quad{robot}/body",
                self._rr.Transform3D(
                    translation=(pose.x_m, pose.y_m, pose.z_m),
                    quaternion=self._rr.Quaternion(xyzw=pose.quaternion),
                ),
            )
            if self._trails[robot].add(flight.now_s, pose):
                self._line(
                    f"map/quad{robot}/trail",
                    np.array(self._trails[robot].poses),
                    _colour(robot),
                    0.02,
                )

    def on_action(self, robot: int, now_s: float, action: Action) -> None:
        """Log the goals again."""
        self._show_goals(now_s)

    def on_tick(self, robot: int, tick: Tick, located: RobotPoses, wall_s: float) -> None:
        """Log the plans of a tick."""
        self._at(tick.now_s)
        configuration = self._flight.setup.configurations[robot]
        if tick.plan is not None:
            plan = self._flight.plan_in_map(robot, tick.plan, configuration.global_costmap)
            self._line(f"map/quad{robot}/plan", self._lifted(plan), _colour(robot), 0.01)
        if tick.control is not None and len(tick.control.local_plan):
            plan = self._flight.plan_in_map(
                robot, tick.control.local_plan, configuration.local_costmap
            )
            self._line(f"map/quad{robot}/local_plan", self._lifted(plan), (40, 200, 40), 0.02)

    def on_end(self, flight: Flight) -> None:
        """Close the connection or the file."""
        self._rr.disconnect()

    def _at(self, time_s: float) -> None:
        self._rr.set_time_seconds(_TIMELINE, time_s)

    def _line(
        self,
        entity: str,
        points: NDArray[np.float64],
        colour: Tuple[int, int, int],
        radius_m: float,
    ) -> None:
        self._rr.log(entity, self._rr.LineStrips3D([points], colors=[colour], radii=[radius_m]))

    def _lifted(self, plan: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a plan's positions at the flight altitude, shape (n, 3)."""
        return np.column_stack((plan[:, :2], np.full(len(plan), self._altitude_m)))

    def _show_goals(self, now_s: float) -> None:
        self._at(now_s)
        markers = goal_markers([robot.sequencer for robot in self._flight.robots], self._altitude_m)
        spheres = [marker for marker in markers if marker.kind == SPHERE]
        self._rr.log(
            "map/goals",
            self._rr.Points3D(
                [marker.place_m for marker in spheres],
                colors=[colour_of(one) for one in spheres],
                # A reached goal is a dot: rerun draws no translucent spheres.
                radii=[one.size_m[0] / 2 if one.rgba[3] > 0.5 else 0.05 for one in spheres],
                labels=[str(one.number + 1) for one in spheres],
            ),
        )
        arrows = [marker for marker in markers if marker.kind == ARROW]
        self._rr.log(
            "map/goal_yaws",
            self._rr.Arrows3D(
                origins=[one.place_m for one in arrows],
                vectors=[
                    (*Pose2D(0.0, 0.0, one.yaw_rad).rotate(one.size_m[0], 0.0), 0.0)
                    for one in arrows
                ],
                colors=[colour_of(one) for one in arrows],
            ),
        )


def _rerun() -> Any:
    try:
        return importlib.import_module("rerun")
    except ImportError as error:
        raise InputError(
            [
                f"--view: rerun is not installed ({error}); install it with "
                "pip install 'quad-nav[view]', in a checkout with "
                ".venv/bin/pip install '.[view]'"
            ]
        ) from error


def _spawn(rr: Any) -> None:
    """Open the viewer, or connect to one that is open.

    rerun's own ``spawn`` listens on all network interfaces; this viewer listens on loopback.
    """
    if sys.platform == "linux" and not any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY"))):
        raise InputError(
            [
                "--view: no display for the viewer; expected one, or --view FILE.rrd to save "
                "the flight"
            ]
        )
    if not _is_listening():
        # pip installs it beside Python, which is not in PATH if the environment is not activated.
        places = os.pathsep.join(
            (str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath))
        )
        program = shutil.which("rerun", path=places) or "rerun"
        try:
            viewer = subprocess.Popen(
                [
                    program,
                    f"--bind={_LOOPBACK}",
                    f"--port={_PORT}",
                    "--memory-limit=75%",
                    "--expect-data-soon",
                ],
                start_new_session=True,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        except OSError as error:
            raise InputError([_no_viewer(error.strerror)]) from error
        _wait_for(viewer)
    rr.connect_tcp(f"{_LOOPBACK}:{_PORT}")


def _wait_for(viewer: subprocess.Popen[bytes]) -> None:
    end_s = time.monotonic() + _STARTS_WITHIN_S
    while not _is_listening():
        if viewer.poll() is not None:
            raise InputError([_no_viewer(f"rerun exited with status {viewer.returncode}")])
        if time.monotonic() > end_s:
            raise InputError([_no_viewer(f"rerun does not listen after {_STARTS_WITHIN_S:g} s")])
        time.sleep(0.05)


def _is_listening() -> bool:
    try:
        socket.create_connection((_LOOPBACK, _PORT), timeout=1.0).close()
    except OSError:
        return False
    return True


def _no_viewer(problem: Optional[str]) -> str:
    return (
        f"--view: the viewer does not start: {problem}; expected a display, or "
        "--view FILE.rrd to save the flight"
    )


def _check(path: Path) -> None:
    if path.suffix != SUFFIX:
        raise InputError(
            [f"{path}: unknown format of a view; expected a name that ends with {SUFFIX}"]
        )
    faults = output_faults(path, "--view", any_kind=False)
    if faults:
        raise InputError(faults)
    make_folder(path.parent)


def _colour(robot: int) -> Tuple[int, int, int]:
    return ROBOT_COLOURS[robot % len(ROBOT_COLOURS)]


def _place(_stamp_s: float, pose: Pose3D) -> Tuple[float, float, float]:
    return pose.x_m, pose.y_m, pose.z_m
