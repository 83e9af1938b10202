"""The mission's journal on ROS: what goes into it, when it began, and what becomes of it."""

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
    """``start_s`` is what the clock said when the mission began, ``start_epoch_s`` Unix time.

    While no sequencer was there, a mission that is taken over on another clock stood still.
    """

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        self._journal = Journal(path)
        self._names = list(names)
        self.start_s = 0.0
        self.start_epoch_s = time.time()

    def read(self) -> Optional[MissionCheckpoint]:
        """How the mission stands, None when it has not begun. Raises InputError."""
        records = self._journal.resume()
        if not records:
            rospy.loginfo(
                "%s: there is no journal of this mission yet: it begins with the first goals",
                self._journal.path,
            )
        return read_checkpoint(records, self._names, str(self._journal.path))

    def begin(self, now_s: float) -> None:
        """The mission begins, again perhaps: what the journal had counts for nothing."""
        self.start_s, self.start_epoch_s = now_s, time.time()
        self._say(self._journal.start(self._head()))

    def resume(self, before: MissionCheckpoint, now_s: float, same_clock: bool) -> None:
        """The mission goes on; ``same_clock`` says that the clock has run on meanwhile."""
        if same_clock and now_s >= before.clock_s + before.mission_s:
            self.start_s, self.start_epoch_s = before.clock_s, before.epoch_s
        else:
            self.start_s = now_s - before.mission_s
            self.start_epoch_s = time.time() - before.wall_s
        self._keep(self._head(), now_s)

    def keep_robot(
        self, name: str, sequencer: Sequencer, log: FlightLog, leg: Optional[Leg], now_s: float
    ) -> None:
        """Before a quadcopter is told where to fly next."""
        self._keep(robot_record(name, sequencer, log, leg, self.start_s), now_s)

    def keep_contact(self, contact: Contact, now_s: float) -> None:
        self._keep(contact_record(contact, self.start_s), now_s)

    def flush(self) -> None:
        """What could not be written before."""
        self._say(self._journal.flush())

    @property
    def wall_time_s(self) -> float:
        return time.time() - self.start_epoch_s

    def _head(self) -> Dict[str, Any]:
        return head_record(self._names, self.start_s, self.start_epoch_s)

    def _keep(self, record: Dict[str, Any], now_s: float) -> None:
        self._say(
            self._journal.append(
                {**record, "mission_s": now_s - self.start_s, "wall_s": self.wall_time_s}
            )
        )

    @staticmethod
    def _say(news: str) -> None:
        if news:
            rospy.logwarn("%s", news)
