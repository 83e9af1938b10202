"""Report, pictures and animation of a flight that ``quad fly`` flies."""

from __future__ import annotations

from pathlib import Path
from typing import Iterator, Optional, Tuple

from quad_nav.cli.outputs import Outputs
from quad_nav.errors import InputError
from quad_nav.mission.summary import MissionSummary
from quad_nav.offline.flight import FlightObserver
from quad_nav.recording.trace import TraceObserver
from quad_nav.scenario.flight_setup import FlightSetup


class FlightPictures:
    """Writes the report, the pictures and the animation that were requested, if any.

    Nothing is traced, and no plotting library imported, if neither is requested.

    Args:
        setup: Flight that is going to be flown.
        report: HTML file of the report, or None.
        pictures: Folder for the report's pictures, or None.
        animation: GIF or MP4 file of the animation, or None.

    Raises:
        InputError: The animation cannot be written.
    """

    def __init__(
        self,
        setup: FlightSetup,
        report: Optional[Path],
        pictures: Optional[Path],
        animation: Optional[Path],
    ) -> None:
        self._report, self._pictures, self._animation = report, pictures, animation
        count = len(setup.robots)
        self._observer = TraceObserver(
            f"{setup.scene.name}, {count} quadcopter{'s' * (count > 1)}, {setup.config_name}"
        )
        if animation is not None:
            from quad_nav.report.animation import animation_faults

            faults = animation_faults(animation)
            if faults:
                raise InputError(faults)

    @property
    def observers(self) -> Tuple[FlightObserver, ...]:
        """Observer of the flight; empty if nothing is requested."""
        requested = self._report or self._pictures or self._animation
        return (self._observer,) if requested else ()

    def write(self, summary: MissionSummary, outputs: Outputs, instead: str) -> Iterator[str]:
        """Write the requested files and yield a line for each.

        Args:
            summary: Summary of the flight.
            outputs: The command's outputs, which report what cannot be written.
            instead: Text that is printed if something cannot be written.
        """
        if not self.observers:
            return
        trace = self._observer.trace(summary.contacts, summary.reason)
        if self._report is not None or self._pictures is not None:
            from quad_nav.report.flight_page import flight_page
            from quad_nav.report.page import write_page, write_pictures

            page = flight_page(trace, summary.wall_time_s)
            if self._report is not None:
                with outputs.attempt("--report", self._report, instead):
                    write_page(page, self._report)
                    yield f"report: {self._report}"
                    instead = ""
            if self._pictures is not None:
                with outputs.attempt("--pictures", self._pictures, instead):
                    write_pictures(page, self._pictures)
                    yield f"pictures: {self._pictures}"
                    instead = ""
        if self._animation is not None:
            from quad_nav.report.animation import animate_flight

            with outputs.attempt("--animate", self._animation, instead):
                animate_flight(trace, self._animation)
                yield f"animation: {self._animation}"
