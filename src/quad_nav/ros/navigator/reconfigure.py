"""dynamic_reconfigure: the services and topics of move_base's namespaces.

The generated ``...Config`` modules of the original come from ``.cfg`` files at
build time. Here the same object is made from the tables of ``quad_nav.config``.
"""

from __future__ import annotations

import types
from typing import Any, Callable, Dict, List, Sequence

import rospy
from dynamic_reconfigure.server import Server

from quad_nav import config
from quad_nav.errors import InputError
from quad_nav.ros.common.names import Names, own_node

OnReconfigure = Callable[[str, Dict[str, Any]], config.Configuration]

_CTYPES = {"double": "double", "int": "int", "bool": "bool", "str": "std::string"}
_INT_MAX = 2**31 - 1


def config_type(name: str, parameters: Sequence[config.Parameter]) -> Any:
    """What ``dynamic_reconfigure.server.Server`` wants to know about a set of parameters.

    Has the attributes of a generated module: ``config_description``, ``min``,
    ``max``, ``defaults``, ``level``, ``type`` and ``all_level``.
    """
    descriptions = [_description(parameter) for parameter in parameters]

    def column(key: str) -> Dict[str, Any]:
        values = {description["name"]: description[key] for description in descriptions}
        if key in ("min", "max", "default"):  # messages of the original carry the group as well
            values["groups"] = {
                "name": "Default",
                "state": True,
                "id": 0,
                "parent": 0,
                "groups": {},
            }
        return values

    group = {
        "name": "Default",
        "type": "",
        "state": True,
        "cstate": "true",
        "id": 0,
        "parent": 0,
        "parentname": "",
        "class": "DEFAULT",
        "parentclass": "",
        "field": "default",
        "upper": "DEFAULT",
        "lower": "groups",
        "groups": [],
        "parameters": descriptions,
    }
    return types.SimpleNamespace(
        __name__=name,
        config_description=group,
        min=column("min"),
        max=column("max"),
        defaults=column("default"),
        level=column("level"),
        type=column("type"),
        all_level=0,
    )


def serve_namespaces(
    configuration: config.Configuration, on_reconfigure: OnReconfigure, names: Names = own_node
) -> List[Server]:
    """Puts the configuration on the parameter server and serves every namespace of it.

    Args:
        on_reconfigure: called with (namespace, changed values) in rospy's service
            threads; returns the configuration that is then in force. An
            ``InputError`` leaves everything as it is, and is logged.
    """
    rospy.set_param(names("~"), configuration.to_tree())
    servers = []
    for namespace, parameters in config.reconfigurable(configuration).items():
        name = (namespace or "move_base").replace("/", "_") + "_config"
        callback = _Callback(namespace, configuration, on_reconfigure)
        servers.append(
            _Server(
                config_type(name, parameters),
                callback,
                names(f"~{namespace}"),
                config.values(configuration, namespace),
            )
        )
    return servers


class _Server(Server):
    """The original's, which talks to the parameter server about every single parameter.

    What is there was put there just before, so only what changes is told: that is a
    hundred calls fewer for each robot's start.
    """

    def __init__(self, type_: Any, callback: Any, namespace: str, values: Dict[str, Any]):
        self._stored = dict(values)
        super().__init__(type_, callback, "" if namespace == "~" else namespace)

    def _copy_from_parameter_server(self) -> None:
        self.config.update(self._stored)

    def _copy_to_parameter_server(self) -> None:
        for name, stored in self._stored.items():
            if self.config[name] != stored:
                rospy.set_param(self.ns + name, self.config[name])
                self._stored[name] = self.config[name]


class _Callback:
    """Asks for the change and answers with the values in force."""

    def __init__(
        self, namespace: str, configuration: config.Configuration, on_reconfigure: OnReconfigure
    ):
        self._namespace = namespace
        self._values = config.values(configuration, namespace)
        self._on_reconfigure = on_reconfigure

    def __call__(self, requested: Any, level: int) -> Any:
        changes = {
            name: requested[name]
            for name, value in self._values.items()
            if requested[name] != value
        }
        # The server's first call, at its start, brings what was just loaded: no change.
        if changes:
            try:
                configuration = self._on_reconfigure(self._namespace, changes)
                self._values = config.values(configuration, self._namespace)
            except InputError as error:
                rospy.logerr("reconfiguration refused:\n%s", error)
        requested.update(self._values)
        return requested


def _description(parameter: config.Parameter) -> Dict[str, Any]:
    """One entry of ``config_description``. Where there is no bound, the type's own stands in."""
    least, greatest = {
        "double": (-float("inf"), float("inf")),
        "int": (-_INT_MAX - 1, _INT_MAX),
        "bool": (False, True),
        "str": ("", ""),
    }[parameter.kind]
    number = {"double": float, "int": int}.get(parameter.kind)
    if number is not None and parameter.low is not None:
        least = number(parameter.low)
    if number is not None and parameter.high is not None:
        greatest = number(parameter.high)
    return {
        "name": parameter.name,
        "type": parameter.kind,
        "default": parameter.default,
        "min": least,
        "max": greatest,
        "level": 0,
        "description": parameter.description,
        "edit_method": _edit_method(parameter),
        "ctype": _CTYPES[parameter.kind],
        "cconsttype": "const " + _CTYPES[parameter.kind],
    }


def _edit_method(parameter: config.Parameter) -> str:
    """An enumeration as rqt_reconfigure parses it; "" for none."""
    if not parameter.choices:
        return ""
    ctype = _CTYPES[parameter.kind]
    return str(
        {
            "enum": [
                {
                    "name": choice.name,
                    "type": parameter.kind,
                    "value": choice.value,
                    "description": choice.description,
                    "ctype": ctype,
                    "cconsttype": "const " + ctype,
                }
                for choice in parameter.choices
            ],
            "enum_description": parameter.choices_description,
        }
    )
