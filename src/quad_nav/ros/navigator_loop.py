"""The loop of a node that flies one robot or many: whoever is due is served."""
from __future__ import annotations

from typing import Sequence

import rospy

from quad_nav.ros.peer_topics import PeerTopics
from quad_nav.ros.robot_navigator import POLL_S, RobotNavigator
from quad_nav.ros.silence import SilenceWatch


def serve(robots: Sequence[RobotNavigator], peers: Sequence[PeerTopics],
          period_s: float = 0.001) -> None:
    """Until ROS shuts down. Robots are looked after every ``period_s`` at most.

    Many robots are looked after together: what falls due within a period waits for its
    end, and a robot's costmaps and control cycle are mostly done in one tick.
    """
    silence = SilenceWatch([*(subscriber for one in peers for subscriber in one.subscribers),
                            *(subscriber for one in robots for subscriber in one.subscribers)])
    for robot in robots:
        rospy.on_shutdown(robot.stop)
    while rospy.get_time() == 0.0 and not rospy.is_shutdown():
        silence.check_clock()
        rospy.rostime.wallsleep(0.05)
    while not rospy.is_shutdown():
        now_s = rospy.get_time()
        for one in peers:
            one.refresh(now_s)
        for robot in robots:
            if robot.due_s <= now_s + 1e-9:
                robot.step(now_s)
        silence.check(now_s)
        due_s = min(robot.due_s for robot in robots)
        try:
            rospy.sleep(min(max(due_s - rospy.get_time(), period_s), POLL_S))
        except rospy.exceptions.ROSTimeMovedBackwardsException:
            rospy.logwarn("time moved backwards: the schedule starts anew")
            for robot in robots:
                robot.restart(rospy.get_time())
