"""A dynamic_reconfigure server for every namespace of a configuration."""
from __future__ import annotations

from typing import Any, Callable, Dict, List

import rospy
from dynamic_reconfigure.server import Server

from quad_nav import config
from quad_nav.errors import InputError
from quad_nav.ros.reconfigure import config_type

Change = Callable[[str, Dict[str, Any]], config.Configuration]


def serve(configuration: config.Configuration, change: Change) -> List[Server]:
    """Serves ``~<namespace>/set_parameters`` for each reconfigurable namespace.

    ``change(namespace, changes)`` makes the new configuration the one in force and
    returns it, or raises InputError; then the old values stay and the reason is logged.
    """
    servers = []
    for namespace, parameters in config.reconfigurable(configuration).items():
        name = (namespace or "move_base").split("/")[-1]
        servers.append(Server(config_type(name, parameters),
                              _callback(namespace, configuration, change),
                              namespace=namespace))
    return servers


def _callback(namespace: str, at_start: config.Configuration, change: Change):
    in_force = config.values(at_start, namespace)

    def callback(wanted, _level):
        changes = {name: wanted[name] for name, value in in_force.items() if wanted[name] != value}
        if changes:
            try:
                in_force.update(config.values(change(namespace, changes), namespace))
            except InputError as error:
                rospy.logwarn("dynamic_reconfigure: not changed:\n%s", error)
        wanted.update(in_force)
        return wanted
    return callback
