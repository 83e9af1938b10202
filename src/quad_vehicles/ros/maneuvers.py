"""What people ask a vehicle to do that takes a while, as an action.

Its goal begins it; the states of the vehicle tell how it has ended.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Callable, Optional, Tuple

import rospy
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback, MoveBaseGoal, MoveBaseResult

from quad_nav.ros.common.nav_messages import pose_stamped
from quad_nav.ros.common.polled_actions import PolledActionServer
from quad_nav.topics.vehicle_states import ON_GROUND, State
from quad_vehicles.link import VehicleLink
from quad_vehicles.orders import Response
from quad_vehicles.states import VehicleMachine

FEEDBACK_PERIOD_S = 0.2


@dataclass(frozen=True)
class Maneuver:
    """A request and the states that follow it.

    Attributes:
        name: For people.
        begin: Asks the state machine for it, at a time in s.
        ends: States in which it has succeeded.
        passes: States on the way.
        cancel: Ends it on the way, at a time in s; None if it cannot be cancelled.
    """

    name: str
    begin: Callable[[VehicleMachine, float], Response]
    ends: Tuple[State, ...]
    passes: Tuple[State, ...]
    cancel: Optional[Callable[[VehicleMachine, float], Response]] = None

    def outcome(self, machine: VehicleMachine) -> Optional[Response]:
        """Return how it has ended; None while it goes on."""
        state = machine.state
        if state in self.ends:
            return Response(True, state.value)
        if state in self.passes and not machine.refusal:
            return None
        return Response(False, f"{state.value}: {machine.refusal or machine.reason}")


TAKE_OFF = Maneuver(
    "take-off",
    VehicleMachine.take_off,
    (State.HOLDING, State.FLYING),
    (State.ARMING, State.TAKING_OFF),
    lambda machine, now_s: machine.land(now_s, "the take-off was cancelled"),
)
LAND = Maneuver(
    "landing",
    lambda machine, now_s: machine.land(now_s, "asked to land"),
    ON_GROUND,
    (State.LANDING,),
)
RESUMPTION = Maneuver(
    "resumption",
    VehicleMachine.resume,
    (State.HOLDING, State.FLYING),
    (State.TAKEN_OVER,),
)


class ManeuverAction:
    """Action server of one maneuver, polled by the node.

    The type is that of move_base, since no action for take-offs is packaged. Its goal is empty, its
    feedback is the pose in the odometry frame. Cancelling a landing has no effect.
    """

    def __init__(
        self,
        name: str,
        maneuver: Maneuver,
        link: VehicleLink,
        odom_frame: str,
        warn: Callable[[str], None],
    ) -> None:
        """Start the action server.

        Args:
            name: Name of the action.
            maneuver: What it does.
            link: Connection to the vehicle.
            odom_frame: Frame of the vehicle's estimate.
            warn: Gets a line for each message that is dropped.
        """
        self._maneuver, self._link, self._odom_frame = maneuver, link, odom_frame
        self._next_feedback_s = -math.inf
        self._server = PolledActionServer(name, MoveBaseAction, warn)

    def poll(self) -> None:
        """Take a waiting goal or cancel request, and report progress and result."""
        server, now_s = self._server, time.monotonic()
        server.publish_status(now_s)
        is_cancelled = server.is_active() and server.is_preempt_requested()
        if server.is_new_goal_available():  # it also asks to preempt the one before
            self._begin(server.accept_new_goal(), now_s)
        elif is_cancelled and self._maneuver.cancel is not None:
            with self._link.lock:
                response = self._maneuver.cancel(self._link.machine, now_s)
            server.set_preempted(MoveBaseResult(), response.text)
        if server.is_active():
            self._report(now_s)

    def _begin(self, goal: MoveBaseGoal, now_s: float) -> None:
        position = goal.target_pose.pose.position
        if any((position.x, position.y, position.z)):
            text = f"{self._maneuver.name}: the goal has a position, expected an empty goal"
            self._server.set_aborted(MoveBaseResult(), text)
            return
        with self._link.lock:
            response = self._maneuver.begin(self._link.machine, now_s)
        if not response.is_accepted:
            self._server.set_aborted(MoveBaseResult(), response.text)

    def _report(self, now_s: float) -> None:
        with self._link.lock:
            outcome = self._maneuver.outcome(self._link.machine)
            estimate = self._link.estimate
        if outcome is None:
            if estimate is not None and now_s >= self._next_feedback_s:
                self._next_feedback_s = now_s + FEEDBACK_PERIOD_S
                pose = pose_stamped(estimate.odom_from_base, self._odom_frame, rospy.Time.now())
                self._server.publish_feedback(MoveBaseFeedback(pose))
        elif outcome.is_accepted:
            self._server.set_succeeded(MoveBaseResult(), outcome.text)
        else:
            self._server.set_aborted(MoveBaseResult(), outcome.text)
