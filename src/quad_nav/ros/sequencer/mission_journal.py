"""Write the journal of a mission in a thread of its own, and resume the mission from it.

A robot's thread waits until its record is on the disk before it acts on it, but not longer than
`PATIENCE_S`. A slow disk delays no goal by more, and the goals of the other robots not at all
once it is known to be slow.
"""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence

import rospy

from quad_nav.mission.checkpoint import (
    MissionCheckpoint,
    contact_record,
    head_record,
    read_checkpoint,
)
from quad_nav.mission.journal import Journal, encode
from quad_nav.sim.contacts import Contact

PATIENCE_S = 0.5  # wall time, as the next


class JournalWriter:
    """Thread that appends records to a journal."""

    def __init__(self, journal: Journal) -> None:
        """Start the thread."""
        self._journal = journal
        self._changed = threading.Condition()
        self._lines: List[bytes] = []
        self._clears = self._retries = False
        self._put = self._written = 0  # numbers of records
        self._began_s: Optional[float] = None  # start of the write that runs now
        self._is_slow = False
        threading.Thread(target=self._run, name="journal", daemon=True).start()

    def put(self, record: Dict[str, Any], clears: bool = False) -> int:
        """Hand over a record and return its number.

        Args:
            record: The record.
            clears: Whether it replaces all records before.

        Raises:
            ValueError: A number in it is not finite.
        """
        line = encode(record)
        with self._changed:
            if clears:
                self._lines, self._clears = [], True
            self._lines.append(line)
            self._put += 1
            self._changed.notify_all()
            return self._put

    def retry(self) -> None:
        """Try to write the records again that could not be written."""
        with self._changed:
            self._retries = True
            self._changed.notify_all()

    def wait(self, number: Optional[int] = None, patience_s: float = PATIENCE_S) -> bool:
        """Wait until a record has been written, or all of them.

        Returns:
            False if the disk is too slow. The record will be written later.
        """
        with self._changed:
            wanted = self._put if number is None else number
            self._changed.wait_for(
                lambda: self._written >= wanted or self._is_stuck(patience_s), patience_s
            )
            is_written = self._written >= wanted
            warns, self._is_slow = not (is_written or self._is_slow), not is_written
        if warns:
            rospy.logwarn(
                "%s: disk is slow, no answer for %g s; goals are sent before they are in the "
                "journal",
                self._journal.path,
                patience_s,
            )
        return is_written

    def _is_stuck(self, patience_s: float) -> bool:
        return self._began_s is not None and time.monotonic() - self._began_s >= patience_s

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._lines or self._retries)
                lines, self._lines = self._lines, []
                clears, self._clears, self._retries = self._clears, False, False
                number, self._began_s = self._put, time.monotonic()
            if clears:
                self._journal.clear()
            problem = self._journal.append_lines(lines)
            with self._changed:
                self._written, self._began_s = number, None
                self._changed.notify_all()
            if problem:
                rospy.logwarn("%s", problem)


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
        self._writer: Optional[JournalWriter] = None
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
        """Start the mission from its first goals and replace the journal, without a wait."""
        self.start_s, self.start_epoch_s = now_s, time.time()
        self._start_writer().put(self._head(), clears=True)

    def resume(self, before: MissionCheckpoint, now_s: float, same_clock: bool) -> None:
        """Resume the mission from a checkpoint, without a wait for the disk.

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
        self.put(self._head(), now_s)

    def put(self, record: Dict[str, Any], now_s: float) -> int:
        """Hand a record to the thread that writes; return its number."""
        times = {"mission_s": now_s - self.start_s, "wall_s": self.wall_time_s}
        return self._start_writer().put({**record, **times})

    def put_contact(self, contact: Contact, now_s: float) -> None:
        """Hand a contact to the thread that writes."""
        self.put(contact_record(contact, self.start_s), now_s)

    def wait(self, number: Optional[int] = None, patience_s: float = PATIENCE_S) -> None:
        """Wait until a record is on the disk, or all of them; not longer than the patience."""
        if self._writer is not None:
            self._writer.wait(number, patience_s)

    def retry(self) -> None:
        """Retry writes that have failed."""
        if self._writer is not None:
            self._writer.retry()

    @property
    def wall_time_s(self) -> float:
        """Wall time since the start of the mission."""
        return time.time() - self.start_epoch_s

    def _start_writer(self) -> JournalWriter:
        if self._writer is None:
            self._writer = JournalWriter(self._journal)
        return self._writer

    def _head(self) -> Dict[str, Any]:
        return head_record(self._names, self.start_s, self.start_epoch_s)
