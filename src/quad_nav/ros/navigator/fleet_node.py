"""The node ``fleet``: the navigators of many robots in one process.

They share tf, the odometry of their peers, the compiled kernels and one loop; there is no
thread for each. Topics, services and parameters are each robot's own, named as those of a
``move_base`` started by ``launch/quad.launch``.
"""

from __future__ import annotations

import sys
from typing import Dict, List

import rospy

from quad_nav.config import Configuration
from quad_nav.errors import InputError
from quad_nav.ros.common.names import in_fleet
from quad_nav.ros.common.signals import init_node
from quad_nav.ros.common.transforms import Transforms
from quad_nav.ros.navigator.loop import serve
from quad_nav.ros.navigator.peer_topics import PeerTopics
from quad_nav.ros.navigator.robot_navigator import RobotNavigator
from quad_nav.scenario.fleet_setup import FleetSetup, read_setup
from quad_nav.scenario.warm_up import warm_up

EXIT_BAD_INPUT = 2
PERIOD_S = 1.0 / 40.0  # as often as poses come


class Fleet:
    """Robots, and their peers by the frame that they are seen in."""

    def __init__(self, setup: FleetSetup):
        transforms = Transforms()
        frames: Dict[str, List[Configuration]] = {}
        for one in setup.configurations.values():
            frames.setdefault(one.global_costmap.global_frame, []).append(one)
        self.robots: List[RobotNavigator] = []
        self.peers: List[PeerTopics] = []
        for frame, members in frames.items():
            peers = PeerTopics(
                {one.robot: in_fleet(one.robot) for one in members},
                members[0].robots,
                transforms,
                frame,
            )
            self.peers.append(peers)
            self.robots += [
                RobotNavigator(one, transforms, peers, in_fleet(one.robot)) for one in members
            ]


def main() -> int:
    """Exit status: 0 at shutdown, 2 for parameters that cannot be used."""
    init_node("fleet")
    name = rospy.get_name().lstrip("/")
    try:
        setup = read_setup(rospy.get_param("~", {}), name)
    except InputError as error:
        rospy.logfatal("%s: the fleet can't be flown:\n%s", name, error)
        print(f"{name}: the fleet can't be flown:\n{error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    for warning in dict.fromkeys(
        line for one in setup.configurations.values() for line in one.warnings
    ):
        rospy.logwarn("%s", warning)
    for configuration in _different(setup):
        warm_up(configuration)
    try:
        fleet = Fleet(setup)
        rospy.loginfo("%d navigators are ready", len(fleet.robots))
        serve(fleet.robots, fleet.peers, PERIOD_S)
    except rospy.ROSInterruptException:
        return 0  # a shutdown ends the loop's sleep in this way
    return 0


def _different(setup: FleetSetup) -> List[Configuration]:
    """One configuration for each choice of planners: the others call the same kernels."""
    kinds: Dict[tuple, Configuration] = {}
    for one in setup.configurations.values():
        layers = tuple(
            type(layer)
            for costmap in (one.global_costmap, one.local_costmap)
            for _, layer in costmap.layers
        )
        kinds.setdefault((type(one.global_planner), type(one.local_planner), layers), one)
    return list(kinds.values())
