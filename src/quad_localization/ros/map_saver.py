"""Node `map_saver`: save the next map of the topic `map`, and end.

Its command line is that of map_saver.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import rospy
from nav_msgs.msg import OccupancyGrid

from quad_localization.map_files import FREE_UP_TO, OCCUPIED_FROM, save_map
from quad_nav.errors import InputError, printable
from quad_nav.ros.common.nav_messages import map_from_message
from quad_nav.ros.common.readiness import init_node

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


if __name__ == "__main__":
    sys.exit(main())
