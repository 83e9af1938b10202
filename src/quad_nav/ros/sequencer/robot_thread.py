"""Hand out the goals of each quadcopter in a thread of its own.

What goes wrong in one thread ends the mission of its robot, with the reason; the other robots fly
on. A thread waits for odometry of its robot, and wakes up without it to notice that it is missing.
"""

from __future__ import annotations

import threading
import time
from typing import Optional

import rospy

from quad_nav.ros.sequencer.flight_record import FlightRecord
from quad_nav.ros.sequencer.robot import MissionRobot

WAIT_S = 0.5  # wall time, as the next; longest delay until a silent robot's thread does a step
GATHER_S = 0.02  # shortest time between two steps, of a few robots
STEPS_PER_S = 200.0  # of all robots of a fleet together, which share one interpreter
JOIN_S = 1.0  # longest wait for the end of a thread that has failed
STUCK_S = 30.0
"""A step that takes longer, such as a file on a disk that hangs, ends the robot's mission."""


class RobotThread:
    """The thread of one robot.

    Attributes:
        robot: The robot.
        failure: Why its mission has ended early, "" if it has not.
        goals_changed: Whether the goals or their states have changed; the reader resets it.
    """

    def __init__(
        self, robot: MissionRobot, record: FlightRecord, news: threading.Event, robots: int
    ) -> None:
        """Prepare the thread.

        Args:
            robot: The robot.
            record: Record of the mission.
            news: Set when the goals have changed or the robot's mission has ended.
            robots: Number of robots of the mission.
        """
        self.robot = robot
        self.failure = ""
        self.goals_changed = False
        self._record, self._news = record, news
        self._gather_s = max(GATHER_S, robots / STEPS_PER_S)
        self._thread: Optional[threading.Thread] = None
        self._began_s: Optional[float] = None  # start of the step that runs now

    @property
    def is_done(self) -> bool:
        """True when the robot's mission has ended, with all goals or early."""
        return bool(self.failure) or self.robot.is_done

    def start(self) -> None:
        """Start the thread, again if it has ended; a thread that is stuck stays as it is."""
        if self._thread is not None:
            if self.failure:
                self._thread.join(JOIN_S)
            if self._thread.is_alive():
                return
        self.failure, self._began_s = "", None
        self._thread = threading.Thread(target=self._run, name=self.robot.name, daemon=True)
        self._thread.start()

    def check(self) -> None:
        """End the robot's mission if its thread is stuck."""
        began_s = self._began_s
        if not self.failure and began_s is not None and time.monotonic() - began_s > STUCK_S:
            self._fail(f"its thread has been stuck for {STUCK_S:g} s")

    def _run(self) -> None:
        received = self.robot.link.received
        while not (self.failure or rospy.is_shutdown()):
            received.wait(WAIT_S)
            received.clear()
            self._began_s = time.monotonic()
            try:
                self._step()
            except Exception as error:  # ends the mission of this robot alone, with the reason
                if rospy.core.is_shutdown_requested():
                    return  # rospy has closed the topics
                rospy.logerr("%s: its thread has failed", self.robot.name, exc_info=True)
                self._fail(f"internal error: {error!r}")
            self._began_s = None
            time.sleep(self._gather_s)

    def _step(self) -> None:
        changed = self.robot.poll_file()
        with self.robot.lock:
            was_done = self.robot.is_done
            if not self.failure:
                changed = self.robot.step(self._record) or changed
        if changed:
            self.goals_changed = True
        if changed or self.robot.is_done != was_done or self.robot.clock_went_back:
            self._news.set()

    def _fail(self, reason: str) -> None:
        self.failure = reason
        rospy.logerr(
            "%s: mission ended early: %s; its navigator keeps the last goal, the other robots fly"
            " on",
            self.robot.name,
            reason,
        )
        self._news.set()
