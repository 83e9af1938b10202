"""Who watches a flight: the recorder, the trace for reports, the view, the progress bar."""

from __future__ import annotations

from typing import TYPE_CHECKING

from quad_nav.geometry import Pose3D, Scan
from quad_nav.mission.sequencer import Action
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.sim.contacts import Contact

if TYPE_CHECKING:
    from quad_nav.offline.flight import Flight


class FlightObserver:
    """Is told what happens, in the order in which it does; each method may do nothing.

    ``robot`` is the quadcopter's number. What is handed over must not be changed. One that
    ``looks_inside`` wants the scans, or the navigators in ``flight.pilots``.
    """

    looks_inside = False

    @property
    def stop_reason(self) -> str:
        """Why the flight must end, "" while it may go on."""
        return ""

    def began(self, flight: Flight) -> None:
        """Everything is in place at time 0 and nothing has moved yet."""

    def touched(self, contact: Contact) -> None:
        """A contact begins."""

    def scanned(self, robot: int, scan: Scan, map_from_lidar: Pose3D) -> None:
        """A LIDAR has turned once; ``map_from_lidar`` is its pose at the scan's stamp."""

    def moved(self, flight: Flight) -> None:
        """The odometry's period is over: ``flight.states`` are new."""

    def acted(self, robot: int, now_s: float, action: Action) -> None:
        """The sequencer sends a goal, or a goal or all of them have ended."""

    def ticked(self, robot: int, tick: Tick, located: RobotPoses, wall_s: float) -> None:
        """The navigator has done what was due, in ``wall_s`` seconds of wall time."""

    def ended(self, flight: Flight) -> None:
        """The flight is over, or was interrupted."""
