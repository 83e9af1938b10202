"""One quadcopter's topics, as the sequencer sees them: callbacks store, ``take`` hands over."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import Any, Callable, List, Optional

import rospy
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseActionResult, RecoveryStatus
from nav_msgs.msg import Odometry

from quad_nav.geometry import Pose2D
from quad_nav.mission.sequencer import NavigatorReport, Verdict
from quad_nav.ros.common.nav_messages import planar_pose, pose_stamped

# A goal's id is stamped when the navigator receives it, on a clock that may lag behind ours.
CLOCK_LAG_S = 0.5
STATUS_FRESH_S = 3.0

_BUSY = (GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING, GoalStatus.RECALLING)
_VERDICTS = {
    GoalStatus.SUCCEEDED: Verdict.SUCCEEDED,
    GoalStatus.ABORTED: Verdict.ABORTED,
    GoalStatus.REJECTED: Verdict.ABORTED,
    GoalStatus.LOST: Verdict.ABORTED,
    GoalStatus.PREEMPTED: Verdict.CANCELLED,
    GoalStatus.RECALLED: Verdict.CANCELLED,
}


@dataclass
class Inbox:
    """What has come since the last look."""

    odometry: List[Odometry] = field(default_factory=list)
    reports: List[NavigatorReport] = field(default_factory=list)
    recoveries: List[RecoveryStatus] = field(default_factory=list)
    newcomers: List[Callable[[PoseStamped], Any]] = field(default_factory=list)


class RobotLink(rospy.SubscribeListener):
    """Robot i's odometry and its navigator's results in; its goals out.

    ``news`` is set when odometry comes.
    """

    def __init__(self, index: int, news: threading.Event) -> None:
        super().__init__()
        self._news = news
        self._lock = threading.Lock()
        self._inbox = Inbox()
        self._sent_s = 0.0
        self._busy = True
        self._status_s: Optional[float] = None
        self._odometry_frame: Optional[str] = None
        self._goal: Optional[PoseStamped] = None
        action = f"/move_base{index}"
        self.goals = rospy.Publisher(
            f"/move_base_simple/goal{index}", PoseStamped, subscriber_listener=self, queue_size=2
        )
        self.odometry = rospy.Subscriber(
            f"/odom{index}", Odometry, self._on_odometry, queue_size=100
        )
        self._subscribers = [
            rospy.Subscriber(f"{action}/result", MoveBaseActionResult, self._on_result),
            rospy.Subscriber(f"{action}/status", GoalStatusArray, self._on_status, queue_size=1),
            rospy.Subscriber(f"{action}/recovery_status", RecoveryStatus, self._on_recovery),
        ]

    @property
    def odometry_frame(self) -> Optional[str]:
        """The frame that odometry is in; None while none has come."""
        return self._odometry_frame

    def take(self) -> Inbox:
        """What has come."""
        with self._lock:
            inbox, self._inbox = self._inbox, Inbox()
        return inbox

    def navigator_is_idle(self, now_s: float) -> bool:
        """Whether the navigator says that it has no goal; False when it says nothing."""
        status_s = self._status_s
        return status_s is not None and now_s - status_s < STATUS_FRESH_S and not self._busy

    def send(self, pose: Pose2D) -> None:
        """Send a goal in ``map`` to the navigator."""
        now = rospy.Time.now()
        self._goal = pose_stamped(planar_pose(pose), "map", now)
        self._sent_s = now.to_sec()
        self.goals.publish(self._goal)

    def send_to(self, newcomer: Callable[[PoseStamped], Any]) -> bool:
        """Send the goal in flight to one new subscriber; False when there is none."""
        if self._goal is None:
            return False
        newcomer(self._goal)
        return True

    def forget(self) -> None:
        """No goal is in flight any more."""
        self._goal = None

    def peer_subscribe(
        self,
        topic_name: str,
        topic_publish: Callable[[PoseStamped], Any],
        peer_publish: Callable[[PoseStamped], Any],
    ) -> None:
        """A new subscriber, as a navigator that was started again, is told the goal in flight.

        By the thread that publishes the goals: rospy's peer_publish is not safe beside publish.
        """
        with self._lock:
            self._inbox.newcomers.append(peer_publish)

    def _on_odometry(self, message: Odometry) -> None:
        self._odometry_frame = message.header.frame_id
        with self._lock:
            self._inbox.odometry.append(message)
        self._news.set()

    def _on_result(self, message: MoveBaseActionResult) -> None:
        status = message.status
        verdict = _VERDICTS.get(status.status)
        if verdict is None or status.goal_id.stamp.to_sec() < self._sent_s - CLOCK_LAG_S:
            return  # about an earlier goal
        if verdict is Verdict.CANCELLED and "another goal" in status.text:
            verdict = Verdict.REPLACED
        with self._lock:
            self._inbox.reports.append(NavigatorReport(verdict, status.text))

    def _on_status(self, message: GoalStatusArray) -> None:
        self._busy = any(status.status in _BUSY for status in message.status_list)
        self._status_s = rospy.get_time()

    def _on_recovery(self, message: RecoveryStatus) -> None:
        with self._lock:
            self._inbox.recoveries.append(message)
