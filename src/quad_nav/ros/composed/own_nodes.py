"""Keep the nodes of a composed fleet from hearing each other through sockets.

rospy connects a subscriber to every publisher of its topic, also to one in the same process. What
the loop hands over in memory would arrive a second time: each robot's commands and all transforms.
"""

from __future__ import annotations

import threading
from typing import Dict, Sequence

import rosgraph
import rospy

from quad_nav.ros.common.rospy_repairs import ignore_publishers


class OwnNodes:
    """The nodes of a composed fleet, by their names.

    Their addresses come from the ROS master, because a worker process that was started again has
    another one. A node is registered there before it advertises a topic of the fleet.

    Attributes:
        names: Full names of the nodes.
    """

    def __init__(self, names: Sequence[str] = ()) -> None:
        self.names = tuple(names)
        self._lock = threading.Lock()
        self._addresses: Dict[str, str] = {}  # of the nodes, the latest known

    def has(self, address: str) -> bool:
        """Tell whether the node with this address is one of these."""
        with self._lock:
            if address in self._addresses.values():
                return True
            master = rosgraph.Master(rospy.get_name())
            for name in self.names:
                try:
                    self._addresses[name] = master.lookupNode(name)
                except (rosgraph.MasterError, OSError):
                    self._addresses.pop(name, None)  # it has not started, or the master hangs
            return address in self._addresses.values()


def hear_others_only(own: OwnNodes) -> None:
    """Let no subscriber of this process hear from the fleet's nodes what the loop hands over."""
    ignore_publishers(lambda topic, address: is_handed_over(topic) and own.has(address))


def is_handed_over(topic: str) -> bool:
    """Tell whether the loop hands over the messages of a topic between the fleet's processes."""
    return topic in ("/tf", "/tf_static") or topic.startswith("/cmd_vel")
