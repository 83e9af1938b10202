"""Topics of one quadcopter as the sequencer uses them; callbacks store, `pop` returns."""

from __future__ import annotations

import math
import threading
from collections import deque
from dataclasses import dataclass, field
from typing import Any, Callable, Deque, List, Optional, Tuple

import numpy as np
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseActionResult, RecoveryStatus
from nav_msgs.msg import Odometry, Path
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.mission.goal_ids import MAX_IDS, GoalIds, Owner
from quad_nav.mission.sequencer import NavigatorReport, Verdict
from quad_nav.ros.common.nav_messages import planar_pose, pose_stamped
from quad_nav.ros.common.packed_messages import PathMessage
from quad_nav.ros.sequencer.odometry import TimedPose, Track
from quad_nav.topics.publishing import PATH_SPACING_M, FlownPath

STATUS_FRESH_S = 3.0
MAX_WAITING = 1000  # messages of a topic that wait for the robot's thread; older ones are dropped
MAX_TEXT = 500  # characters of a result's text

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
    """Messages that have arrived since the last `pop`, bounded in number."""

    states: Deque[TimedPose] = field(default_factory=lambda: deque(maxlen=MAX_WAITING))
    odometry: Deque[Odometry] = field(default_factory=lambda: deque(maxlen=MAX_WAITING))
    reports: Deque[NavigatorReport] = field(default_factory=lambda: deque(maxlen=MAX_WAITING))
    recoveries: Deque[RecoveryStatus] = field(default_factory=lambda: deque(maxlen=MAX_WAITING))
    subscribers: List[Callable[[PoseStamped], Any]] = field(default_factory=list)
    unfinished: List[GoalID] = field(default_factory=list)  # of the sequencer, in the last status


class RobotLink(rospy.SubscribeListener):
    """Receive a robot's poses and its navigator's results, and send its goals.

    Attributes:
        goals: Publisher of the goals.
        cancels: Publisher of requests to cancel them.
        odometry_topic: Name of the topic of odometry.
        received: Set by what the robot's thread should not wait with.
        wake: When states wake the thread, as `StateFeed` defines it, float64[4].
    """

    def __init__(self, index: int, wake: NDArray[np.float64]) -> None:
        """Connect to the topics of robot `index`, apart from those of its poses."""
        super().__init__()
        self.received = threading.Event()
        self._lock = threading.Lock()
        self._inbox = Inbox()
        self._ids = GoalIds()
        self._busy = True
        self._status_s: Optional[float] = None
        self._pose_frame: Optional[str] = None
        self._goal: Optional[PoseStamped] = None
        action = f"/move_base{index}"
        self.goals = rospy.Publisher(
            f"/move_base_simple/goal{index}", PoseStamped, subscriber_listener=self, queue_size=2
        )
        self.cancels = rospy.Publisher(f"{action}/cancel", GoalID, queue_size=10)
        self.odometry_topic = rospy.resolve_name(f"/odom{index}")
        self.wake = wake
        self._subscribers = [
            rospy.Subscriber(f"{action}/result", MoveBaseActionResult, self._on_result),
            rospy.Subscriber(f"{action}/status", GoalStatusArray, self._on_status, queue_size=1),
            rospy.Subscriber(f"{action}/recovery_status", RecoveryStatus, self._on_recovery),
        ]

    @property
    def pose_frame(self) -> Optional[str]:
        """Frame of the last pose; None before the first message."""
        return self._pose_frame

    def pop(self) -> Inbox:
        """Return the messages that have arrived since the last call."""
        with self._lock:
            inbox, self._inbox = self._inbox, Inbox()
        return inbox

    def navigator_is_idle(self, now_s: float) -> bool:
        """Return whether the navigator reports no goal; False without a recent status."""
        status_s = self._status_s
        return status_s is not None and now_s - status_s < STATUS_FRESH_S and not self._busy

    def send(self, pose: Pose2D) -> None:
        """Send a goal in `map` to the navigator."""
        now = rospy.Time.now()
        self._goal = pose_stamped(planar_pose(pose), "map", now)
        with self._lock:
            self._inbox.reports.clear()  # on the goal before
            self._ids.send(now.to_sec())
        self.goals.publish(self._goal)

    def send_to(self, subscriber: Callable[[PoseStamped], Any]) -> bool:
        """Send the active goal to one new subscriber; return False without an active goal."""
        if self._goal is None:
            return False
        with self._lock:
            self._ids.resend(rospy.get_time())
        subscriber(self._goal)
        return True

    def clear(self) -> None:
        """Clear the active goal."""
        self._goal = None
        with self._lock:
            self._ids.clear()

    def peer_subscribe(
        self,
        topic_name: str,
        topic_publish: Callable[[PoseStamped], Any],
        peer_publish: Callable[[PoseStamped], Any],
    ) -> None:
        """Store a new subscriber, such as a restarted navigator, which needs the active goal.

        The thread that publishes the goals serves it: rospy's peer_publish is not safe while
        another thread publishes.
        """
        with self._lock:
            self._inbox.subscribers.append(peer_publish)
        self.received.set()

    def receive_state(self, state: TimedPose) -> None:
        """Store a pose; the thread need not take it at once."""
        self._pose_frame = "map"
        with self._lock:
            self._inbox.states.append(state)

    def receive_odometry(self, message: Odometry) -> None:
        """Store odometry, and wake the robot's thread."""
        self._pose_frame = message.header.frame_id
        with self._lock:
            self._inbox.odometry.append(message)
        if not self.received.is_set():
            self.received.set()

    def _on_result(self, message: MoveBaseActionResult) -> None:
        status = message.status
        verdict = _VERDICTS.get(status.status)
        if verdict is None:
            return
        if verdict is Verdict.CANCELLED and "another goal" in status.text:
            verdict = Verdict.REPLACED
        goal_id, stamp_s = _id_of(status)
        with self._lock:
            see = self._ids.see_replaced if verdict is Verdict.REPLACED else self._ids.see
            owner = see(goal_id, stamp_s)
            if owner is Owner.ACTIVE:
                self._inbox.reports.append(NavigatorReport(verdict, status.text[:MAX_TEXT]))
            elif owner is Owner.OTHER and verdict is not Verdict.REPLACED:
                self._inbox.reports.append(NavigatorReport(Verdict.OTHER_ENDED))
        self.received.set()

    def _on_status(self, message: GoalStatusArray) -> None:
        unfinished = [status for status in message.status_list if status.status in _BUSY]
        with self._lock:
            self._inbox.unfinished = [
                status.goal_id
                for status in unfinished[-MAX_IDS:]
                if self._ids.see(*_id_of(status)) is not Owner.OTHER
            ]
        self._busy = bool(unfinished)
        self._status_s = rospy.get_time()

    def _on_recovery(self, message: RecoveryStatus) -> None:
        with self._lock:
            self._inbox.recoveries.append(message)


def _id_of(status: GoalStatus) -> Tuple[int, float]:
    """Return the id of a goal, shortened to a number, and its stamp in seconds."""
    goal_id = status.goal_id
    stamp = goal_id.stamp
    return hash((goal_id.id, stamp.secs, stamp.nsecs)), stamp.to_sec()


class PathPublisher:
    """Publish the path that a quadcopter has flown, twice a second while it moves."""

    def __init__(self, topic: str) -> None:
        """Advertise the topic."""
        self._publisher = rospy.Publisher(topic, Path, queue_size=1, latch=True)
        self._path: FlownPath[Tuple[float, Pose3D]] = FlownPath(lambda *timed: timed)
        self._last_m = (math.inf, math.inf)

    def clear(self) -> None:
        """Start an empty path."""
        self._path.clear()
        self._last_m = (math.inf, math.inf)

    def add(self, track: Track) -> None:
        """Add poses, and publish if it is due."""
        rows = list(zip(track.stamps_s.tolist(), track.poses.tolist()))
        for stamp_s, (x_m, y_m, z_m, yaw_rad) in rows:
            is_far = math.dist(self._last_m, (x_m, y_m)) >= PATH_SPACING_M
            if not is_far and stamp_s < rows[-1][0]:
                continue
            if is_far:
                self._last_m = (x_m, y_m)
            if self._path.add(stamp_s, planar_pose(Pose2D(x_m, y_m, yaw_rad), z_m)):
                self._publisher.publish(PathMessage("map", stamp_s, tuple(self._path.poses)))
