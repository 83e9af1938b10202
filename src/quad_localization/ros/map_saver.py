"""Node `map_saver`: save the next map of the topic `map`, and end.

Its command line is that of map_saver.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import rospy
from nav_msgs.msg import OccupancyGrid

from quad_localization.map_files import FREE_UP_TO, OCCUPIED_FROM, save_map
from quad_nav.costmap.static import StaticMap
from quad_nav.errors import InputError, printable
from quad_nav.grid import GridSpec
from quad_nav.ros.common.conversions import pose_from_message
from quad_nav.ros.common.readiness import init_node
from quad_nav.topics.validation import grid_problem

EXIT_BAD_INPUT = 2


def main() -> int:
    """Run the node; return 0, or 2 if an argument, or the place of the files, is not valid."""
    parser = argparse.ArgumentParser("map_saver", description="Save the map of the topic map.")
    parser.add_argument("-f", dest="stem", default="map", help="name of the files, without .yaml")
    parser.add_argument("--occ", type=int, default=OCCUPIED_FROM, help="occupied from this value")
    parser.add_argument("--free", type=int, default=FREE_UP_TO, help="free up to this value")
    given = parser.parse_args(rospy.myargv(sys.argv)[1:])
    if not 0 <= given.free < given.occ <= 100:
        parser.error(f"--free {given.free} --occ {given.occ}: expected 0 <= free < occ <= 100")
    init_node("map_saver")
    topic = rospy.resolve_name("map")
    rospy.loginfo("map_saver: waiting for %s", topic)
    try:
        message = rospy.wait_for_message(topic, OccupancyGrid)
    except rospy.ROSException:
        return 0  # Ctrl-C
    try:
        save_map(map_from_message(message), Path(given.stem), given.occ, given.free)
    except InputError as error:
        print(printable(f"map_saver: {error}"), file=sys.stderr)
        return EXIT_BAD_INPUT
    rospy.loginfo("map_saver: %s.pgm and %s.yaml are written", given.stem, given.stem)
    rospy.signal_shutdown("the map is saved")
    return 0


def map_from_message(message: OccupancyGrid) -> StaticMap:
    """Return the map of a message.

    The resolution of a message is a float32; the shortest decimal number that it stands for is
    what its sender has read.

    Raises:
        InputError: Sizes or numbers are not valid.
    """
    info, corner = message.info, message.info.origin.position
    size, place = (info.width, info.height), (corner.x, corner.y)
    problem = grid_problem(*size, info.resolution, len(message.data), place)
    if problem:
        raise InputError([f"map: {problem}"])
    spec = GridSpec(*size, float(str(np.float32(info.resolution))), *place)
    cells = np.array(message.data, np.int8).reshape(spec.shape)
    yaw_rad = pose_from_message(info.origin).yaw_rad
    return StaticMap(cells, spec, message.header.frame_id, yaw_rad)


if __name__ == "__main__":
    sys.exit(main())
