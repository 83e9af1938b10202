"""The node ``move_base``: one robot's navigator on ROS."""

from __future__ import annotations

import sys

import rospy

from quad_nav import config
from quad_nav.errors import InputError
from quad_nav.ros.common.names import own_node
from quad_nav.ros.common.signals import init_node
from quad_nav.ros.common.transforms import Transforms
from quad_nav.ros.navigator.loop import serve
from quad_nav.ros.navigator.peer_topics import PeerTopics
from quad_nav.ros.navigator.robot_navigator import RobotNavigator
from quad_nav.scenario.warm_up import warm_up

EXIT_BAD_INPUT = 2


def main() -> int:
    """Exit status: 0 at shutdown, 2 for parameters that cannot be used."""
    init_node("move_base")
    name = rospy.get_name()
    try:
        configuration = config.load(rospy.get_param("~", {}), name)
        for warning in configuration.warnings:
            rospy.logwarn("%s", warning)
        warm_up(configuration)
        transforms = Transforms()
        peers = PeerTopics(
            {configuration.robot: own_node},
            configuration.robots,
            transforms,
            configuration.global_costmap.global_frame,
        )
        robot = RobotNavigator(configuration, transforms, peers)
    except InputError as error:
        rospy.logfatal("%s: its parameters can't be used:\n%s", name, error)
        print(f"{name}: its parameters can't be used:\n{error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    try:
        serve([robot], [peers])
    except rospy.ROSInterruptException:
        return 0  # a shutdown ends the loop's sleep in this way
    return 0
