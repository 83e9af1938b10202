"""Start of the nodes `move_base` (one robot) and `fleet` (many robots in one process).

The robots of a fleet share tf, the odometry of their peers, the compiled kernels and one loop;
there is no thread for each robot. Topics, services and parameters are each robot's own, named as
those of a `move_base` started by `launch/quad.launch`.
"""

from __future__ import annotations

import sys
from typing import Callable, Collection, Dict, List, Mapping

import rospy

from quad_nav.config import Configuration
from quad_nav.errors import InputError, PluginError, printable
from quad_nav.files.kernel_cache import COMPILING, announced, cache_warnings
from quad_nav.ros.common.readiness import init_node
from quad_nav.ros.common.transforms import Transforms
from quad_nav.ros.navigator.loop import NavigatorLoop
from quad_nav.ros.navigator.peer_topics import PeerTopics
from quad_nav.ros.navigator.robot_identity import MAX_ROBOTS, identified
from quad_nav.ros.navigator.robot_navigator import RobotNavigator
from quad_nav.scenario.navigator_parameters import load_navigator
from quad_nav.scenario.warm_up import distinct, warm_up
from quad_nav.topics.publishing import Names, in_fleet, own_node

EXIT_FAILURE, EXIT_BAD_INPUT = 1, 2
FLEET_PERIOD_S = 1.0 / 40.0  # as often as poses arrive


class Fleet:
    """The robots of one process, and their peers in each global frame."""

    def __init__(
        self, configurations: Mapping[int, Configuration], names: Callable[[int], Names]
    ) -> None:
        """Connect the robots to their topics.

        Args:
            configurations: Parameters by the robot's number.
            names: Returns the names of a robot's topics.

        Raises:
            InputError: If a plugin refuses its parameters.
        """
        robots = max(one.robots for one in configurations.values()) or MAX_ROBOTS
        transforms = Transforms(set(range(robots)) - set(configurations))
        frames: Dict[str, List[Configuration]] = {}
        for one in configurations.values():
            frames.setdefault(one.global_costmap.global_frame, []).append(one)
        self.robots: List[RobotNavigator] = []
        self.peers: List[PeerTopics] = []
        for frame, members in frames.items():
            peers = PeerTopics(
                {one.robot: names(one.robot) for one in members},
                members[0].robots,
                transforms,
                frame,
            )
            self.peers.append(peers)
            self.robots += [
                RobotNavigator(one, transforms, peers, names(one.robot)) for one in members
            ]


def move_base() -> int:
    """Run the node `move_base`: one robot.

    Returns:
        Exit status: 0 at shutdown, 2 for parameters that are not valid.
    """
    init_node("move_base")

    def configurations() -> Dict[int, Configuration]:
        given = rospy.get_param("~", {})
        one = load_navigator(
            given, rospy.get_name(), {"simulator": rospy.get_param("/simulator", {})}
        )
        one = identified(one, given)
        return {one.robot: one}

    return _run(configurations, lambda _: own_node)


def fleet() -> int:
    """Run the node `fleet`: the robots that its parameters assign to it.

    Returns:
        Exit status: 0 at shutdown, 2 for parameters that are not valid.
    """
    from quad_nav.scenario.fleet_setup import read_setup  # here: it reads scenes

    init_node("fleet")
    name = rospy.get_name().lstrip("/")
    return _run(
        lambda: read_setup(rospy.get_param("~", {}), name).configurations,
        in_fleet,
        FLEET_PERIOD_S,
    )


def _run(
    read: Callable[[], Mapping[int, Configuration]],
    names: Callable[[int], Names],
    period_s: float = 0.001,
) -> int:
    name = rospy.get_name().lstrip("/")
    try:
        configurations = read()
        prepare(configurations.values())
        group = Fleet(configurations, names)
        if len(group.robots) == 1:
            rospy.loginfo("%s: ready", group.robots[0].name)
        else:
            rospy.loginfo("%s: ready, robots: %d", name, len(group.robots))
        NavigatorLoop(group.robots, group.peers, period_s).run()
    except InputError as error:
        log_invalid(name, error)
        return EXIT_BAD_INPUT
    except PluginError as error:
        rospy.logfatal("%s: a plugin cannot be made, shutting down: %s", name, error)
        return EXIT_FAILURE
    except rospy.ROSException:
        # A shutdown interrupts the loop's sleep, and closes topics while the node starts.
        if not rospy.core.is_shutdown_requested():
            raise
    return 0


def log_invalid(name: str, error: InputError) -> None:
    """Log and print the faults in a node's parameters."""
    rospy.logfatal("%s: invalid parameters, shutting down:\n%s", name, error)
    lines = f"{name}: invalid parameters, shutting down:\n{error}"
    print(printable(lines, "\n"), file=sys.stderr)


def prepare(configurations: Collection[Configuration]) -> None:
    """Log the warnings of configurations, and compile the kernels that they use.

    Raises:
        InputError: If a plugin refuses its parameters.
    """
    warnings = [line for one in configurations for line in one.warnings]
    for warning in dict.fromkeys((*warnings, *cache_warnings())):
        rospy.logwarn("%s", warning)
    with announced(lambda: rospy.loginfo("%s", COMPILING)):
        for configuration in distinct(configurations):
            _warm_up(configuration)


def _warm_up(configuration: Configuration) -> None:
    """Compile the kernels; a plugin's mistake is logged here, and aborts goals later."""
    try:
        warm_up(configuration)
    except PluginError as error:
        rospy.logerr("quad%d: warm-up: %s", configuration.robot, error)
