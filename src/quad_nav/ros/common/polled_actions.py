"""Action server for nodes that poll: it has no thread, and hears no message that harms it."""

from __future__ import annotations

from typing import Any, Callable

import rospy
from actionlib import SimpleActionServer
from actionlib_msgs.msg import GoalID, GoalStatus

from quad_nav.ros.common.conversions import time_message
from quad_nav.timing import Schedule
from quad_nav.topics.validation import goal_id_problem

MAX_STATUSES = 100  # of ended goals; actionlib keeps each for five seconds
_ENDED = (
    GoalStatus.PREEMPTED,
    GoalStatus.SUCCEEDED,
    GoalStatus.ABORTED,
    GoalStatus.REJECTED,
    GoalStatus.RECALLED,
)


class PolledActionServer(SimpleActionServer):
    """Action server whose owner asks it for goals and cancel requests."""

    def __init__(
        self,
        name: str,
        action: Any,
        warn: Callable[[str], None],
        on_request: Callable[[], None] = lambda: None,
    ) -> None:
        """Start the server.

        Args:
            name: Name of the action.
            action: Its type.
            warn: Gets a line for each message that is dropped.
            on_request: Called when a goal or a request to cancel has come.
        """
        super().__init__(name, action, auto_start=False)
        self._warn, self._on_request = warn, on_request
        self._guard_callbacks()
        self.start()
        self._status = Schedule(self._stop_status_thread())
        self._status.start(0.0)

    def _guard_callbacks(self) -> None:
        """Let actionlib have only goals and cancel requests that it can handle.

        One from the future would cancel or precede all goals until then, and it repeats the ids of
        the last seconds in every status.
        """
        server = self.action_server
        take_goal, take_cancel = server.internal_goal_callback, server.internal_cancel_callback

        def on_goal(message: rospy.Message) -> None:
            if self._is_valid(message.goal_id, "goal"):
                take_goal(message)
                self._on_request()

        def on_cancel(message: GoalID) -> None:
            if self._is_valid(message, "cancel request"):
                with server.lock:
                    take_cancel(message)
                    self._list_anew(message)
                    for one in server.status_list:
                        # actionlib logs errors for a request whose goal has not come.
                        one.goal = one.goal or server.ActionGoal(goal_id=one.status.goal_id)
                self._on_request()

        # `start` subscribes with these.
        server.internal_goal_callback, server.internal_cancel_callback = on_goal, on_cancel

    def cancel(self, message: GoalID) -> None:
        """Take a request to cancel that has come from another topic."""
        self.action_server.internal_cancel_callback(message)

    def _is_valid(self, goal_id: GoalID, kind: str) -> bool:
        problem = goal_id_problem(goal_id.id, goal_id.stamp.to_sec(), rospy.get_time())
        if problem:
            self._warn(f"{kind} dropped: {problem}")
            return False
        server = self.action_server
        with server.lock:
            ended = [one for one in server.status_list if not self._is_held(one)]
            for one in ended[: max(len(server.status_list) - MAX_STATUSES, 0)]:
                server.status_list.remove(one)
        return True

    def _list_anew(self, request: GoalID) -> None:
        """List the goals to which a request applies for the full time again, as in C++.

        A request for a goal that has not come stays listed for that time after its own stamp.
        """
        is_for_all = not request.id and not request.stamp
        for one in self.action_server.status_list:
            goal_id = one.status.goal_id
            is_before = bool(request.stamp) and goal_id.stamp <= request.stamp
            if one.goal is None:
                one.handle_destruction_time = request.stamp
            elif is_for_all or is_before or goal_id.id == request.id:
                one.handle_destruction_time = rospy.Time.now()

    def _keep_listed(self) -> None:
        """List the last goal until another one replaces it, and for the full time then, as in C++.

        actionlib's Python part counts from the end of a goal.
        """
        with self.action_server.lock:
            for one in self.action_server.status_list:
                if self._is_held(one):
                    one.handle_destruction_time = rospy.Time()
                elif not one.handle_destruction_time and one.status.status in _ENDED:
                    one.handle_destruction_time = rospy.Time.now()

    def _is_held(self, status: Any) -> bool:
        """Return whether it is the status of the present goal or of the one that waits."""
        return status in (self.current_goal.status_tracker, self.next_goal.status_tracker)

    def _stop_status_thread(self) -> float:
        """Stop actionlib's status thread and return its frequency in Hz.

        The thread wakes up with every message of `/clock`. `publish_status` replaces it.
        """
        server = self.action_server
        if server.status_timer is not None:
            server.status_timer.shutdown()
        return max(server.status_frequency, 0.0)

    def publish_status(self, now_s: float) -> None:
        """Publish the status if it is due."""
        if self._status.pop(now_s):
            self._keep_listed()
            self.action_server.publish_status()

    def restart(self, now_s: float) -> None:
        """Restart the status schedule after a clock jump, and adapt stamps from the future."""
        self._status.start(now_s)
        server, now = self.action_server, time_message(now_s)
        with server.lock:
            server.last_cancel = min(server.last_cancel, now)
            for one in server.status_list:
                one.status.goal_id.stamp = min(one.status.goal_id.stamp, now)
                one.handle_destruction_time = min(one.handle_destruction_time, now)
