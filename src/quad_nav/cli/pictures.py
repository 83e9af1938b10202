"""Report, pictures and animation of a flight that ``quad fly`` flies."""

from __future__ import annotations

from functools import partial
from typing import Iterator, Tuple

from quad_nav.cli import add_ons
from quad_nav.cli.outputs import Outputs
from quad_nav.errors import InputError
from quad_nav.mission.summary import MissionSummary
from quad_nav.offline.flight import FlightObserver
from quad_nav.recording.trace import TraceObserver
from quad_nav.scenario.flight_setup import FlightSetup


class FlightPictures:
    """Writes ``--report``, ``--pictures`` and ``--animate`` of the outputs, if any.

    Nothing is traced, and no plotting library imported, if none is requested.

    Raises:
        InputError: The animation cannot be written.
    """

    def __init__(self, setup: FlightSetup, outputs: Outputs) -> None:
        self._outputs = outputs
        count = len(setup.robots)
        self._observer = TraceObserver(
            f"{setup.scene.name}, {count} quadcopter{'s' * (count > 1)}, {setup.config_name}"
        )
        if self.observers:
            add_ons.load("quad_nav.report.page", "reports")
        animation = outputs.path("--animate")
        if animation is not None:
            from quad_nav.report.animation import animation_faults

            faults = animation_faults(animation)
            if faults:
                raise InputError(faults)

    @property
    def observers(self) -> Tuple[FlightObserver, ...]:
        """Observer of the flight; empty if nothing is requested."""
        requested = map(self._outputs.path, ("--report", "--pictures", "--animate"))
        return (self._observer,) if any(requested) else ()

    def write(self, summary: MissionSummary, instead: str) -> Iterator[str]:
        """Write what is requested, yield a line for each; print ``instead`` if that fails."""
        outputs = self._outputs
        if not self.observers:
            return
        trace = self._observer.trace(summary.contacts, summary.reason)
        if outputs.path("--report") is not None or outputs.path("--pictures") is not None:
            from quad_nav.report.flight_page import flight_page
            from quad_nav.report.page import write_page, write_pictures

            content = flight_page(trace, summary.wall_time_s)
            for option, write in (("--report", write_page), ("--pictures", write_pictures)):
                for line in outputs.save(option, partial(write, content), instead):
                    yield line
                    instead = ""
        if outputs.path("--animate") is not None:
            from quad_nav.report.animation import animate_flight

            yield from outputs.save("--animate", partial(animate_flight, trace), instead)
