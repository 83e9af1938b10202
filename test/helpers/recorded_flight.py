"""A short flight of two quadcopters that is recorded and traced, for several tests."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple, Sequence

from quad_nav.files.shipped import shipped
from quad_nav.mission.summary import MissionSummary
from quad_nav.offline.flight import FlightObserver
from quad_nav.offline.run import fly
from quad_nav.recording.trace import FlightTrace, TraceObserver
from quad_nav.scenario.flight_setup import FlightOptions, FlightSetup, read_setup

# Near the start poses (1.5, 1.5) and (10.0, 2.0) of the arena.
GOALS = ([[2.1, 1.9], [2.6, 2.3, 0.5]], [[9.4, 2.3]])


class Flown(NamedTuple):
    summary: MissionSummary
    trace: FlightTrace


def setup(folder: Path, **options) -> FlightSetup:
    for robot, goals in enumerate(GOALS):
        text = json.dumps({"goals": goals})
        (folder / f"quad{robot}_goals.json").write_text(text, encoding="utf-8")
    return read_setup(FlightOptions(shipped("scenes", "arena.yaml"), folder, **options))


def flown(flight_setup: FlightSetup, observers: Sequence[FlightObserver] = ()) -> Flown:
    trace = TraceObserver()
    summary = fly(flight_setup, [trace, *observers])
    return Flown(summary, trace.trace(summary.contacts, summary.reason))
