"""Stop a mission on request, and resume it: `/mission/stop` and `/mission/resume`.

A stop cancels the goals of all navigators and sends no further ones. The parameter
`/mission/stopped` lets a sequencer that has been killed and restarted stay stopped.
"""

from __future__ import annotations

from typing import Sequence

import rospy
from actionlib_msgs.msg import GoalID
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse

from quad_nav.ros.sequencer.robot import MissionRobot

STOP_SERVICE, RESUME_SERVICE = "/mission/stop", "/mission/resume"
STOPPED_PARAMETER = "/mission/stopped"
LOCK_S = 1.0  # longest wait for a step of a robot that is in progress


class MissionStop:
    """The services that stop and resume the missions of all robots."""

    def __init__(self, robots: Sequence[MissionRobot], respawned: bool) -> None:
        """Advertise the services.

        Args:
            robots: The robots of the mission.
            respawned: Whether an earlier sequencer of this flight has been killed. Otherwise a
                stop of an earlier flight is forgotten.
        """
        self._robots = robots
        self._cancels = [
            rospy.Publisher(f"/move_base{i}/cancel", GoalID, queue_size=1)
            for i in range(len(robots))
        ]
        if respawned and rospy.get_param(STOPPED_PARAMETER, False) is True:
            self._set_stopped(True)
            rospy.logwarn("sequencer: the mission stays stopped; %s resumes it", RESUME_SERVICE)
        else:
            rospy.set_param(STOPPED_PARAMETER, False)
        self._services = [
            rospy.Service(STOP_SERVICE, Trigger, self._stop),
            rospy.Service(RESUME_SERVICE, Trigger, self._resume),
        ]

    def _set_stopped(self, is_stopped: bool) -> None:
        for robot in self._robots:
            robot.is_stopped = is_stopped

    def _stop(self, _: TriggerRequest) -> TriggerResponse:
        """Cancel at once, and again where a step has sent a goal meanwhile."""
        self._set_stopped(True)
        self._cancel()
        for robot in self._robots:
            if robot.lock.acquire(timeout=LOCK_S):
                robot.hold(rospy.get_time())
                robot.lock.release()
        self._cancel()
        rospy.set_param(STOPPED_PARAMETER, True)
        rospy.logwarn("sequencer: mission stopped; %s resumes it", RESUME_SERVICE)
        return TriggerResponse(True, f"mission stopped; {RESUME_SERVICE} resumes it")

    def _cancel(self) -> None:
        for publisher in self._cancels:
            publisher.publish(GoalID())  # without an id: all goals

    def _resume(self, _: TriggerRequest) -> TriggerResponse:
        if not any(robot.is_stopped for robot in self._robots):
            return TriggerResponse(True, "the mission is not stopped")
        rospy.set_param(STOPPED_PARAMETER, False)
        for robot in self._robots:
            with robot.lock:
                robot.release(rospy.get_time())
        rospy.loginfo("sequencer: mission resumed")
        return TriggerResponse(True, "mission resumed")
