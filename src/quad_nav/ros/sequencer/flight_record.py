"""Flight log and journal of a mission, shared by the threads of its quadcopters.

One lock guards the log. It is held for calculations only, never while a file is written.
"""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Callable, List, Optional, Sequence

import numpy as np

from quad_nav.mission.actions import Action
from quad_nav.mission.checkpoint import (
    MissionCheckpoint,
    RobotCheckpoint,
    robot_record,
)
from quad_nav.mission.flight_log import FlightLog, Leg
from quad_nav.mission.progress import SequenceProgress
from quad_nav.mission.sequencer import NavigatorReport, Sequencer, Verdict
from quad_nav.ros.sequencer.mission_journal import MissionJournal
from quad_nav.ros.sequencer.odometry import Track
from quad_nav.ros.sequencer.truth import TruthTopic
from quad_nav.sim.contacts import Contact


class FlightRecord:
    """Events of a mission, for its summary and for a sequencer that resumes it.

    Attributes:
        log: Flight log; hold `lock` to use it.
        lock: Lock of the log.
        journal: Journal of the mission.
        truth: Errors of the poses, where somebody knows the true ones.
    """

    def __init__(self, new_log: Callable[[], FlightLog], journal: MissionJournal) -> None:
        """Start with an empty log.

        Args:
            new_log: Makes an empty log.
            journal: Journal of the mission.
        """
        self._new_log = new_log
        self.log = new_log()
        self.lock = threading.Lock()
        self.journal = journal
        self.truth = TruthTopic()

    def begin(self, now_s: float) -> None:
        """Start with an empty log and journal."""
        with self.lock:  # what others add now comes after both
            self.log = self._new_log()
            self.journal.begin(now_s)
            self.truth.forget()
        self.journal.wait()

    def add_flight(
        self,
        name: str,
        track: Track,
        reports: Sequence[NavigatorReport],
        recoveries: int,
    ) -> None:
        """Add the poses of a robot, what its navigator reports and the number of recoveries."""
        aborts = sum(report.verdict is Verdict.ABORTED for report in reports)
        with self.lock:
            self.truth.compare(list(self.log.robots).index(name), track)
            log = self.log.robots[name]
            log.recoveries += recoveries
            log.aborts += aborts
            starts = np.flatnonzero(track.relocated).tolist()
            ends = [*starts, len(track.stamps_s)]
            for start, end in zip([0, *starts], ends):
                if start in starts:
                    log.relocate()
                self.log.add_track(name, track.stamps_s[start:end], track.planar[start:end])

    def add_actions(
        self, name: str, sequencer: Sequencer, actions: Sequence[Action], now_s: float
    ) -> List[Optional[Leg]]:
        """Add the actions of a sequencer, and wait until they are in the journal.

        Returns:
            The leg that each action has ended, if it has ended one.
        """
        if not actions:
            return []
        with self.lock:
            legs = [self.log.robots[name].add_action(action) for action in actions]
            ended = next((leg for leg in legs if leg is not None), None)
            record = robot_record(name, sequencer, self.log, ended, self.journal.start_s)
            number = self.journal.put(record, now_s)
        self.journal.wait(number)
        return legs

    def add_progress(self, name: str, sequencer: Sequencer, now_s: float) -> None:
        """Add that the mission of a robot has been stopped or resumed."""
        with self.lock:
            record = robot_record(name, sequencer, self.log, None, self.journal.start_s)
            self.journal.put(record, now_s)

    def add_contact(self, contact: Contact, now_s: float) -> bool:
        """Add a contact; return False if it is known already."""
        with self.lock:
            is_new = self.log.add_contact(contact)
            if is_new:
                self.journal.put_contact(contact, now_s)
        return is_new

    def checkpoint(self, now_s: float, progress: Sequence[SequenceProgress]) -> MissionCheckpoint:
        """Return the state of the mission in a form that does not depend on the clock.

        Args:
            now_s: Last time of the clock.
            progress: The progress of each robot.
        """
        start_s = self.journal.start_s
        with self.lock:
            robots = {
                name: RobotCheckpoint(
                    one.shifted(-start_s),
                    self.log.robots[name].state,
                    self.log.distances.min_clearance_m(name),
                    self.log.distances.min_separation_m(name),
                )
                for name, one in zip(self.log.robots, progress)
            }
            contacts = [replace(one, time_s=one.time_s - start_s) for one in self.log.contacts]
        journal = self.journal
        return MissionCheckpoint(
            start_s, journal.start_epoch_s, now_s - start_s, journal.wall_time_s, robots, contacts
        )

    def resume(self, before: MissionCheckpoint, now_s: float, same_clock: bool) -> None:
        """Resume from a checkpoint.

        Args:
            before: The checkpoint.
            now_s: Present time on the clock.
            same_clock: Whether the clock has continued to run since, and the robots have flown on.
        """
        with self.lock:
            self.journal.resume(before, now_s, same_clock)
            start_s = self.journal.start_s
            self.log = self._new_log()
            for name, robot in before.robots.items():
                state = robot.log if same_clock else replace(robot.log, pose=None)
                self.log.resume(name, state, robot.clearance_m, robot.separation_m)
            for contact in before.contacts:
                self.log.add_contact(replace(contact, time_s=contact.time_s + start_s))
        self.journal.wait()
