"""Stop a mission on request, and resume it: `/mission/stop` and `/mission/resume`.

A stop cancels the goals of all navigators and sends no further ones. `/mission/quad{i}/stop` and
`/mission/quad{i}/resume` do so for one robot, such as one that its pilot has taken over. The
parameters `/mission/stopped` and `/mission/quad{i}/stopped` let a sequencer that has been killed
and restarted stay stopped.
"""

from __future__ import annotations

from typing import Sequence

import rospy
from actionlib_msgs.msg import GoalID
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse

from quad_nav.ros.sequencer.robot import MissionRobot

ALL = "/mission"
STOP_SERVICE, RESUME_SERVICE = f"{ALL}/stop", f"{ALL}/resume"
STOPPED_PARAMETER = f"{ALL}/stopped"
LOCK_S = 1.0  # longest wait for a step of a robot that is in progress


class MissionStop:
    """The services that stop and resume the missions of all robots, and of each robot."""

    def __init__(self, robots: Sequence[MissionRobot], respawned: bool) -> None:
        """Advertise the services.

        Args:
            robots: The robots of the mission.
            respawned: Whether an earlier sequencer of this flight has been killed. Otherwise a
                stop of an earlier flight is forgotten.
        """
        cancels = [
            rospy.Publisher(f"/move_base{i}/cancel", GoalID, queue_size=1)
            for i in range(len(robots))
        ]
        self._groups = [_Group(ALL, robots, cancels, respawned)]
        self._groups += [
            _Group(f"{ALL}/{robot.name}", [robot], [cancel], respawned)
            for robot, cancel in zip(robots, cancels)
        ]


class _Group:
    """The services that stop and resume the missions of some robots together."""

    def __init__(
        self,
        prefix: str,
        robots: Sequence[MissionRobot],
        cancels: Sequence[rospy.Publisher],
        respawned: bool,
    ) -> None:
        self._robots, self._cancels = robots, cancels
        self._stopped, self._resume_service = f"{prefix}/stopped", f"{prefix}/resume"
        self._subject = "mission" if prefix == ALL else f"mission of {robots[0].name}"
        if respawned and rospy.get_param(self._stopped, False) is True:
            self._set_stopped()
            rospy.logwarn(
                "sequencer: the %s stays stopped; %s resumes it",
                self._subject,
                self._resume_service,
            )
        else:
            rospy.set_param(self._stopped, False)
        self._services = [
            rospy.Service(f"{prefix}/stop", Trigger, self._stop),
            rospy.Service(self._resume_service, Trigger, self._resume),
        ]

    def _set_stopped(self) -> None:
        for robot in self._robots:
            robot.is_stopped = True

    def _stop(self, _: TriggerRequest) -> TriggerResponse:
        """Cancel at once, and again where a step has sent a goal meanwhile."""
        self._set_stopped()
        self._cancel()
        for robot in self._robots:
            if robot.lock.acquire(timeout=LOCK_S):
                robot.hold(rospy.get_time())
                robot.lock.release()
        self._cancel()
        rospy.set_param(self._stopped, True)
        text = f"{self._subject} stopped; {self._resume_service} resumes it"
        rospy.logwarn("sequencer: %s", text)
        return TriggerResponse(True, text)

    def _cancel(self) -> None:
        for publisher in self._cancels:
            publisher.publish(GoalID())  # without an id: all goals

    def _resume(self, _: TriggerRequest) -> TriggerResponse:
        if not any(robot.is_stopped for robot in self._robots):
            return TriggerResponse(True, f"the {self._subject} is not stopped")
        for robot in self._robots:
            rospy.set_param(f"{ALL}/{robot.name}/stopped", False)
        rospy.set_param(self._stopped, False)
        for robot in self._robots:
            with robot.lock:
                robot.release(rospy.get_time())
        rospy.loginfo("sequencer: %s resumed", self._subject)
        return TriggerResponse(True, f"{self._subject} resumed")
