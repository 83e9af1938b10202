"""Control loop of a node that flies one robot or many: step the robots that are due."""

from __future__ import annotations

import time
from typing import Optional, Sequence

import rospy
from rospy.rostime import is_wallclock

from quad_nav.ros.common.diagnostics import publish_health
from quad_nav.ros.common.readiness import TopicWatch
from quad_nav.ros.common.rospy_repairs import Alarm
from quad_nav.ros.navigator.health_meters import LoopHealth
from quad_nav.ros.navigator.peer_topics import PeerTopics
from quad_nav.ros.navigator.robot_navigator import POLL_S, RobotNavigator
from quad_nav.timing import is_due

STALL_S = 0.5  # wall time, as the next
DRAIN_S = 0.25
LATE_S = 0.2  # two control cycles at 10 Hz
WARN_AGAIN_S = 15.0  # wall time


class NavigatorLoop:
    """Serve robots until ROS shuts down.

    Many robots are served together: what falls due within a period waits for its end. A robot's
    costmap updates and its control cycle are therefore mostly done in one tick.
    """

    def __init__(
        self, robots: Sequence[RobotNavigator], peers: Sequence[PeerTopics], period_s: float
    ) -> None:
        """Serve ``robots`` with these ``peers``, in rounds that are ``period_s`` apart or more."""
        self._robots, self._peers, self._period_s = robots, peers, period_s
        self._name = robots[0].name if len(robots) == 1 else rospy.get_name().lstrip("/")
        self._topic_watch = TopicWatch(
            [subscriber for one in robots for subscriber in one.subscribers]
        )
        self._health = LoopHealth({robot.name: robot.health for robot in robots})
        self._start_s = self._now_s = 0.0
        self._alarm = Alarm()
        self._wall_s: Optional[float] = None  # of the clock's last step

    def run(self) -> None:
        """Wait for the clock, then serve the robots until ROS shuts down."""
        publish_health(self._health.read)
        for robot in self._robots:
            robot.on_request(self._alarm.set)
            rospy.on_shutdown(robot.stop)
        while rospy.get_time() == 0.0 and not rospy.is_shutdown():
            self._topic_watch.check_clock()
            rospy.rostime.wallsleep(0.05)
        self._start_s = self._now_s = rospy.get_time()
        while not rospy.is_shutdown():
            stalled_s = self._update_time()
            if stalled_s >= STALL_S:
                rospy.loginfo(
                    "%s: %s for %.1f s; discarding queued messages",
                    self._name,
                    "the node was stopped or busy" if is_wallclock() else "/clock stopped",
                    stalled_s,
                )
                rospy.rostime.wallsleep(DRAIN_S)
                for robot in self._robots:
                    robot.discard_late_scans()
                self._start_s = rospy.get_time()
                continue
            self._step(self._now_s)
            due_s = min(robot.due_s for robot in self._robots)
            self._alarm.sleep(min(max(due_s - rospy.get_time(), self._period_s), POLL_S))

    def _update_time(self) -> float:
        """Take the time; return how long the clock stood still, in wall time, 0 until it moves.

        A process was stopped, a link was cut, or the simulation paused. Messages that queued up
        meanwhile are old; the robots must not act on the first of them. The clock of the system
        does not stop, then this is how long the process did. What comes before the clock's first
        step is no stop: the simulator waits for the robots.
        """
        before_s, self._now_s = self._now_s, rospy.get_time()
        if self._now_s == before_s:
            return 0.0
        before_wall_s, self._wall_s = self._wall_s, time.monotonic()
        if self._now_s < before_s:
            rospy.logwarn(
                "%s: %s jumped back by %.2f s; restarting all schedules",
                self._name,
                "the system's clock" if is_wallclock() else "/clock",
                before_s - self._now_s,
            )
            self._start_s = self._now_s
            for robot in self._robots:
                robot.restart(self._now_s)
        return 0.0 if before_wall_s is None else self._wall_s - before_wall_s

    @property
    def _hint(self) -> str:
        """What helps against a late loop."""
        if is_wallclock():
            return "use a lower controller_frequency or smaller costmaps"
        return "use a lower rate:=" + ", fewer robots or more hosts:=" * (len(self._robots) > 1)

    def _step(self, now_s: float) -> None:
        for one in self._peers:
            one.refresh(now_s)
        late_s = now_s - max(min(robot.due_s for robot in self._robots), self._start_s)
        self._health.update(now_s, max(late_s, 0.0))
        if late_s > LATE_S:
            rospy.logwarn_throttle(
                WARN_AGAIN_S,
                f"{self._name}: control loop {late_s:.2f} s behind, skipping cycles ({self._hint})",
            )
        for robot in self._robots:
            if robot.has_request or is_due(robot.due_s, now_s):
                robot.step(now_s)
        self._topic_watch.check()
