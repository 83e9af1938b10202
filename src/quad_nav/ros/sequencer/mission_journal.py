"""Write the journal of a mission, and resume the mission from it."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any, Dict, Optional, Sequence

import rospy

from quad_nav.mission.checkpoint import (
    MissionCheckpoint,
    contact_record,
    head_record,
    read_checkpoint,
    robot_record,
)
from quad_nav.mission.flight_log import FlightLog, Leg
from quad_nav.mission.journal import Journal
from quad_nav.mission.sequencer import Sequencer
from quad_nav.sim.contacts import Contact


class MissionJournal:
    """Journal of a mission with its start times.

    A mission that is resumed with another clock counts as paused in between.

    Attributes:
        start_s: Time on the clock at the start of the mission.
        start_epoch_s: Unix time at the start of the mission.
    """

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        """Name the file and the robots of the mission."""
        self._journal = Journal(path)
        self._names = list(names)
        self.start_s = 0.0
        self.start_epoch_s = time.time()

    def read(self) -> Optional[MissionCheckpoint]:
        """Return the last checkpoint; None if the mission has not begun.

        Raises:
            InputError: If the journal is not valid.
        """
        records = self._journal.resume()
        if not records:
            rospy.loginfo(
                "%s: no journal of this mission yet; starting with the first goals",
                self._journal.path,
            )
        return read_checkpoint(records, self._names, str(self._journal.path))

    def begin(self, now_s: float) -> None:
        """Start the mission from its first goals and replace the journal."""
        self.start_s, self.start_epoch_s = now_s, time.time()
        self._warn(self._journal.start(self._head()))

    def resume(self, before: MissionCheckpoint, now_s: float, same_clock: bool) -> None:
        """Resume the mission from a checkpoint.

        Args:
            before: The checkpoint.
            now_s: Present time on the clock.
            same_clock: Whether the clock has continued to run in between.
        """
        if same_clock and now_s >= before.clock_s + before.mission_s:
            self.start_s, self.start_epoch_s = before.clock_s, before.epoch_s
        else:
            self.start_s = now_s - before.mission_s
            self.start_epoch_s = time.time() - before.wall_s
        self._write(self._head(), now_s)

    def write_robot(
        self, name: str, sequencer: Sequencer, log: FlightLog, leg: Optional[Leg], now_s: float
    ) -> None:
        """Write a robot's progress; call this before sending its next goal."""
        self._write(robot_record(name, sequencer, log, leg, self.start_s), now_s)

    def write_contact(self, contact: Contact, now_s: float) -> None:
        """Write a contact."""
        self._write(contact_record(contact, self.start_s), now_s)

    def flush(self) -> None:
        """Retry writes that have failed."""
        self._warn(self._journal.flush())

    @property
    def wall_time_s(self) -> float:
        """Wall time since the start of the mission."""
        return time.time() - self.start_epoch_s

    def _head(self) -> Dict[str, Any]:
        return head_record(self._names, self.start_s, self.start_epoch_s)

    def _write(self, record: Dict[str, Any], now_s: float) -> None:
        self._warn(
            self._journal.append(
                {**record, "mission_s": now_s - self.start_s, "wall_s": self.wall_time_s}
            )
        )

    @staticmethod
    def _warn(problem: str) -> None:
        if problem:
            rospy.logwarn("%s", problem)
