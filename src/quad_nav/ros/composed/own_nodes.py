"""Keep the nodes of a composed fleet from hearing each other through sockets.

rospy connects a subscriber to every publisher of its topic, also to one in the same process. What
the loop hands over in memory would arrive a second time: each robot's commands and all transforms.
"""

from __future__ import annotations

import threading
from typing import Any, Callable, Dict, Sequence

import rosgraph
import rospy
from rospy.topics import _SubscriberImpl


class OwnNodes:
    """The nodes of a composed fleet, by their names.

    Their addresses come from the ROS master, because a worker process that was started again has
    another one. A node is registered there before it advertises a topic of the fleet.

    Attributes:
        names: Full names of the nodes.
    """

    def __init__(self, names: Sequence[str] = ()) -> None:
        """Start with the nodes' full names, if they are known."""
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


def ignore_publishers(own: OwnNodes, is_handed_over: Callable[[str], bool]) -> None:
    """Let no subscriber of this process connect to publishers of the fleet's nodes.

    Args:
        own: Nodes of the fleet.
        is_handed_over: Tells whether a topic's messages are handed over in memory.
    """
    is_connected = _SubscriberImpl.has_connection

    def has_connection(subscriber: Any, endpoint_id: str) -> bool:
        if is_connected(subscriber, endpoint_id):
            return True
        return is_handed_over(subscriber.resolved_name) and own.has(endpoint_id)

    _SubscriberImpl.has_connection = has_connection
