"""What a robot's topics, services and parameters are called.

A navigator in a node of its own is called as move_base's are: ``~local_costmap/costmap``,
``cmd_vel``; its launch file remaps the latter. Where many share a node there is nobody to
remap, and no ``~`` for each: the names are those that the launch file's remaps lead to.
"""

from __future__ import annotations

from typing import Callable

Names = Callable[[str], str]

_ACTION = ("goal", "cancel", "status", "feedback", "result", "recovery_status")
_NUMBERED = ("clicked_point", "cmd_vel", "initialpose", "odom", "scan", "move_base_simple/goal")


def own_node(name: str) -> str:
    """For the only robot of a node: as it is, rospy resolves and remaps it."""
    return name


def in_fleet(number: int) -> Names:
    """For robot ``number`` of a fleet: as ``launch/quad.launch`` remaps them."""
    node = f"/move_base{number}"
    remaps = {f"/{name}": f"/{name}{number}" for name in _NUMBERED}
    remaps.update({f"/move_base/{name}": f"{node}/{name}" for name in _ACTION})
    remaps["/move_base"] = node

    def resolved(name: str) -> str:
        if name.startswith("~"):
            return f"{node}/{name[1:]}".rstrip("/")
        absolute = name if name.startswith("/") else f"/{name}"
        return remaps.get(absolute, absolute)

    return resolved
