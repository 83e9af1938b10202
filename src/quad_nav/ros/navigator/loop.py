"""The loop of a node that flies one robot or many: whoever is due is served."""

from __future__ import annotations

import time
from typing import List, Sequence

import rospy

from quad_nav.ros.common.diagnostics import tell_every_second
from quad_nav.ros.common.topic_watch import TopicWatch
from quad_nav.ros.navigator.health import LoopHealth
from quad_nav.ros.navigator.peer_topics import PeerTopics
from quad_nav.ros.navigator.robot_navigator import POLL_S, RobotNavigator
from quad_nav.topics.health import Health

STALL_S = 0.5  # wall time, as the next
DRAIN_S = 0.25
LAG_S = 0.2  # two control cycles at 10 Hz
WARN_AGAIN_S = 15.0  # wall time


def serve(
    robots: Sequence[RobotNavigator], peers: Sequence[PeerTopics], period_s: float = 0.001
) -> None:
    """Until ROS shuts down. Robots are looked after every ``period_s`` at most.

    Many robots are looked after together: what falls due within a period waits for its
    end, and a robot's costmaps and control cycle are mostly done in one tick.
    """
    silence = TopicWatch(
        [
            *(subscriber for one in peers for subscriber in one.subscribers),
            *(subscriber for one in robots for subscriber in one.subscribers),
        ]
    )
    loop = LoopHealth(len(robots))
    tell_every_second(lambda: _health(loop, robots))
    for robot in robots:
        rospy.on_shutdown(robot.stop)
    while rospy.get_time() == 0.0 and not rospy.is_shutdown():
        silence.check_clock()
        rospy.rostime.wallsleep(0.05)
    begun_s = rospy.get_time()
    now_s, stall = begun_s, Stall(begun_s)
    while not rospy.is_shutdown():
        before_s, now_s = now_s, rospy.get_time()
        if now_s < before_s:
            rospy.logwarn(
                "time moved backwards by %.2f s: the schedule starts anew", before_s - now_s
            )
            begun_s = now_s
            for robot in robots:
                robot.restart(now_s)
        if stall.is_over(now_s):
            rospy.rostime.wallsleep(DRAIN_S)
            begun_s = rospy.get_time()
            continue
        for one in peers:
            one.refresh(now_s)
        late_s = now_s - max(min(robot.due_s for robot in robots), begun_s)
        loop.came_round(now_s, late_s)
        _tell_lag(late_s)
        for robot in robots:
            if robot.due_s <= now_s + 1e-9:
                robot.step(now_s)
        silence.check(now_s)
        due_s = min(robot.due_s for robot in robots)
        try:
            rospy.sleep(min(max(due_s - rospy.get_time(), period_s), POLL_S))
        except rospy.exceptions.ROSTimeMovedBackwardsException:
            continue


class Stall:
    """Notices that the clock had stood still for us: a node stopped, a link cut, a pause.

    What has piled up meanwhile is of the past: nobody is to be steered by the first of it.
    """

    def __init__(self, now_s: float):
        self._now_s, self._wall_s = now_s, time.monotonic()

    def is_over(self, now_s: float) -> bool:
        """Whether the clock goes again after ``STALL_S`` or more; so it is said once."""
        wall_s = time.monotonic()
        stood_s = wall_s - self._wall_s
        if now_s == self._now_s:
            return False
        self._now_s, self._wall_s = now_s, wall_s
        if stood_s < STALL_S:
            return False
        rospy.loginfo("the clock had stood still for %.1f s", stood_s)
        return True


def _health(loop: LoopHealth, robots: Sequence[RobotNavigator]) -> List[Health]:
    now_s = rospy.get_time()
    return [loop.read(now_s), *(one for robot in robots for one in robot.health.read(now_s))]


def _tell_lag(late_s: float) -> None:
    if late_s > LAG_S:
        rospy.logwarn_throttle(
            WARN_AGAIN_S,
            f"served {late_s:.2f} s late: control cycles are left "
            "out; expected fewer robots in this process, a lower rate of the "
            "simulation, or more processor time",
        )
