"""The loop of a node that flies one robot or many: whoever is due is served."""
from __future__ import annotations

from typing import List, Sequence

import rospy

from quad_nav.face.health import Health
from quad_nav.ros.diagnostics import tell_every_second
from quad_nav.ros.navigator_health import LoopHealth
from quad_nav.ros.peer_topics import PeerTopics
from quad_nav.ros.robot_navigator import POLL_S, RobotNavigator
from quad_nav.ros.silence import SilenceWatch

LAG_S = 0.2  # two control cycles at 10 Hz
WARN_AGAIN_S = 15.0  # wall time


def serve(robots: Sequence[RobotNavigator], peers: Sequence[PeerTopics],
          period_s: float = 0.001) -> None:
    """Until ROS shuts down. Robots are looked after every ``period_s`` at most.

    Many robots are looked after together: what falls due within a period waits for its
    end, and a robot's costmaps and control cycle are mostly done in one tick.
    """
    silence = SilenceWatch([*(subscriber for one in peers for subscriber in one.subscribers),
                            *(subscriber for one in robots for subscriber in one.subscribers)])
    loop = LoopHealth(len(robots))
    tell_every_second(lambda: _health(loop, robots))
    for robot in robots:
        rospy.on_shutdown(robot.stop)
    while rospy.get_time() == 0.0 and not rospy.is_shutdown():
        silence.check_clock()
        rospy.rostime.wallsleep(0.05)
    begun_s = rospy.get_time()
    while not rospy.is_shutdown():
        now_s = rospy.get_time()
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
            rospy.logwarn("time moved backwards: the schedule starts anew")
            begun_s = rospy.get_time()
            for robot in robots:
                robot.restart(begun_s)


def _health(loop: LoopHealth, robots: Sequence[RobotNavigator]) -> List[Health]:
    now_s = rospy.get_time()
    return [loop.read(now_s), *(one for robot in robots for one in robot.health.read(now_s))]


def _tell_lag(late_s: float) -> None:
    if late_s > LAG_S:
        rospy.logwarn_throttle(WARN_AGAIN_S, f"served {late_s:.2f} s late: control cycles are left "
                               "out; expected fewer robots in this process, a lower rate of the "
                               "simulation, or more processor time")
