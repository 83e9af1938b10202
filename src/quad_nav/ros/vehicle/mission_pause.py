"""Pause and resume the mission of one robot, from a thread that must not wait for it."""

from __future__ import annotations

import queue
import threading
from typing import Optional

import rospy
from std_srvs.srv import Trigger

TIMEOUT_S = 2.0


class MissionPause:
    """Calls the sequencer's services of one robot, in the order in which they are asked for."""

    def __init__(self, robot: int) -> None:
        """Start the thread that calls.

        Args:
            robot: Number of the robot.
        """
        self._name = f"quad{robot}"
        self._calls: queue.Queue[Optional[str]] = queue.Queue()
        threading.Thread(target=self._run, name="mission pause", daemon=True).start()

    def pause(self) -> None:
        """Stop the robot's mission until somebody resumes it."""
        self._calls.put("stop")

    def resume(self) -> None:
        """Resume the robot's mission."""
        self._calls.put("resume")

    def _run(self) -> None:
        while not rospy.is_shutdown():
            try:
                action = self._calls.get(timeout=0.5)
            except queue.Empty:
                continue
            self._call(f"/mission/{self._name}/{action}")

    def _call(self, service: str) -> None:
        """Call a service; without a sequencer there is no mission to pause."""
        try:
            rospy.wait_for_service(service, TIMEOUT_S)
            response = rospy.ServiceProxy(service, Trigger)()
        except (rospy.ROSException, rospy.ServiceException) as error:
            if not rospy.is_shutdown():
                rospy.logwarn("%s: %s: %s", self._name, service, error)
            return
        rospy.loginfo("%s: %s", self._name, response.message)
