"""Stop a mission on request, and resume it: `/mission/stop` and `/mission/resume`.

A stop cancels the goals of all navigators and sends no further ones. `/mission/quad{i}/stop` and
`/mission/quad{i}/resume` do so for one robot, such as one that its pilot has taken over. A
resumption of all leaves alone the robots that were not stopped.

The journal and the parameters `/mission/quad{i}/stopped` let a restarted sequencer stay stopped.
`/mission/stopped` says that all are; a person may set it while there is no sequencer.
"""

from __future__ import annotations

import threading
import time
from functools import partial
from typing import Dict, Sequence

import rospy
from actionlib_msgs.msg import GoalID
from quad.msg import VehicleState
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse

from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.sequencer.robot import MissionRobot
from quad_nav.topics.vehicle_states import ON_GROUND, State, state_from_message

ALL = "/mission"
STOP_SERVICE, RESUME_SERVICE = f"{ALL}/stop", f"{ALL}/resume"
STOPPED_PARAMETER = f"{ALL}/stopped"
LOCK_S = 1.0  # longest wait for a step of a robot that is in progress
STATES_S = 2.0  # longest wait for the states of the vehicles; a robot without a bridge has none
_DOWN = (*ON_GROUND, State.LANDING)


class MissionStop:
    """The services that stop and resume the missions of all robots, and of each robot."""

    def __init__(self, robots: Sequence[MissionRobot], respawned: bool) -> None:
        """Advertise the services.

        Args:
            robots: The robots of the mission; `is_stopped` as the journal says.
            respawned: Whether an earlier sequencer of this flight has been killed: the parameters
                say which robots it has stopped. Otherwise they are of an earlier flight.
        """
        self._robots = robots
        self._lock = threading.Lock()  # held by a request, apart from the first part of a stop
        for robot in robots if respawned else ():
            is_stopped = rospy.get_param(_prefix(robot) + "/stopped", robot.is_stopped) is True
            robot.is_stopped = is_stopped or rospy.get_param(STOPPED_PARAMETER, False) is True
        self._store(robots)
        for prefix in [ALL] if self._are_all_stopped() else map(_prefix, self._stopped(robots)):
            subject = _subject(prefix)
            rospy.logwarn("sequencer: the %s stays stopped; %s/resume resumes it", subject, prefix)
        groups = {ALL: robots, **{_prefix(robot): [robot] for robot in robots}}
        self._services = [
            rospy.Service(f"{prefix}/{name}", Trigger, partial(handler, prefix, group))
            for prefix, group in groups.items()
            for name, handler in (("stop", self._stop), ("resume", self._resume))
        ]

    def stop(self, robots: Sequence[MissionRobot]) -> None:
        """Stop the missions of some robots."""
        self._cancel(robots)  # at once
        with self._lock:
            for robot in robots:
                if robot.lock.acquire(timeout=LOCK_S):
                    robot.hold(rospy.get_time())
                    robot.lock.release()
            self._cancel(robots)  # a step or a resumption may have come between
            self._store(robots)

    def _cancel(self, robots: Sequence[MissionRobot]) -> None:
        for robot in robots:
            robot.is_stopped = True
            robot.link.cancels.publish(GoalID())  # without an id: all goals

    def _store(self, robots: Sequence[MissionRobot]) -> None:
        rospy.set_param(STOPPED_PARAMETER, self._are_all_stopped())
        for robot in robots:
            rospy.set_param(_prefix(robot) + "/stopped", robot.is_stopped)

    def _are_all_stopped(self) -> bool:
        return all(robot.is_stopped for robot in self._robots)

    @staticmethod
    def _stopped(robots: Sequence[MissionRobot]) -> Sequence[MissionRobot]:
        return [robot for robot in robots if robot.is_stopped]

    def _stop(
        self, prefix: str, robots: Sequence[MissionRobot], _: TriggerRequest
    ) -> TriggerResponse:
        self.stop(robots)
        text = f"{_subject(prefix)} stopped; {prefix}/resume resumes it"
        rospy.logwarn("sequencer: %s", text)
        return TriggerResponse(True, text)

    def _resume(
        self, prefix: str, robots: Sequence[MissionRobot], _: TriggerRequest
    ) -> TriggerResponse:
        with self._lock:
            stopped = self._stopped(robots)
            for robot in stopped:  # first: a sequencer that is killed now has resumed them
                rospy.set_param(_prefix(robot) + "/stopped", False)
            rospy.set_param(STOPPED_PARAMETER, self._are_all_stopped() and not stopped)
            for robot in stopped:
                with robot.lock:
                    robot.release(rospy.get_time())
        text = (
            f"{_subject(prefix)} resumed" if stopped else f"the {_subject(prefix)} is not stopped"
        )
        rospy.loginfo("sequencer: %s", text)
        return TriggerResponse(True, text)


class VehicleStates:
    """States of the real vehicles, as their bridges tell them."""

    def __init__(self, robots: int) -> None:
        """Subscribe to the states of some robots."""
        self._robots = robots
        self._states: Dict[int, State] = {}
        self._warnings = ThrottledWarnings()
        self._subscribers = [
            rospy.Subscriber(f"/vehicle{i}/state", VehicleState, self._on_state, i)
            for i in range(robots)
        ]

    def are_down(self) -> Sequence[bool]:
        """Return for each robot whether it is known to stand on the ground or to land."""
        end_s = time.monotonic() + STATES_S
        while len(self._states) < self._robots and time.monotonic() < end_s:
            time.sleep(0.05)
        return [self._states.get(i) in _DOWN for i in range(self._robots)]

    def _on_state(self, message: VehicleState, robot: int) -> None:
        try:
            self._states[robot] = state_from_message(message)
        except ValueError as error:
            self._warnings.warn(f"/vehicle{robot}/state: message dropped: {error}")


def _prefix(robot: MissionRobot) -> str:
    return f"{ALL}/{robot.name}"


def _subject(prefix: str) -> str:
    return "mission" if prefix == ALL else f"mission of {prefix.rpartition('/')[2]}"
