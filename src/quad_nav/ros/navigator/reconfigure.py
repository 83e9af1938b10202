"""Provide the dynamic_reconfigure services and topics of move_base's namespaces, and of others.

C++ move_base generates its `...Config` modules from `.cfg` files at build time. This module makes
the same objects from the dataclasses of the parameters.
"""

from __future__ import annotations

import types
from typing import Any, Callable, Dict, Sequence

import rospy
from dynamic_reconfigure.msg import Config
from dynamic_reconfigure.server import Server
from dynamic_reconfigure.srv import ReconfigureRequest

from quad_nav import config
from quad_nav.errors import InputError
from quad_nav.parameter import Parameter
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.topics.publishing import Names

OnReconfigure = Callable[[str, Dict[str, Any]], config.Configuration]

_CTYPES = {"double": "double", "int": "int", "bool": "bool", "str": "std::string"}
_INT_MAX = 2**31 - 1
_FIELDS = {"bools": "bool", "ints": "int", "strs": "str", "doubles": "double"}


# Messages of dynamic_reconfigure carry the group beside the values.
_GROUP_STATE = {"name": "Default", "state": True, "id": 0, "parent": 0, "groups": {}}
_GROUP = {
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
}


def config_type(name: str, parameters: Sequence[Parameter]) -> types.SimpleNamespace:
    """Describe parameters as `dynamic_reconfigure.server.Server` expects it.

    Returns:
        An object with the attributes of a generated module: `config_description`, `min`, `max`,
        `defaults`, `level`, `type` and `all_level`.
    """
    descriptions = [_description(parameter) for parameter in parameters]

    def column(key: str) -> Dict[str, Any]:
        return {description["name"]: description[key] for description in descriptions}

    def column_with_group(key: str) -> Dict[str, Any]:
        return {**column(key), "groups": {**_GROUP_STATE, "groups": {}}}

    return types.SimpleNamespace(
        __name__=name,
        config_description={**_GROUP, "groups": [], "parameters": descriptions},
        min=column_with_group("min"),
        max=column_with_group("max"),
        defaults=column_with_group("default"),
        level=column("level"),
        type=column("type"),
        all_level=0,
    )


class ParameterServers:
    """The dynamic_reconfigure servers of all namespaces of a robot."""

    def __init__(
        self,
        robot: str,
        configuration: config.Configuration,
        on_reconfigure: OnReconfigure,
        names: Names,
    ) -> None:
        """Put a configuration on the parameter server and serve its namespaces.

        Args:
            robot: Name of the robot, for the log.
            configuration: The present configuration.
            on_reconfigure: Called with a namespace and the changed values in rospy's service
                threads; returns the configuration then in force. If it raises an `InputError`,
                nothing changes and the error is logged.
            names: Names of the robot's parameters and services.
        """
        self._robot, self._on_reconfigure, self._names = robot, on_reconfigure, names
        self._servers: Dict[str, ParameterServer] = {}
        rospy.set_param(names("~"), configuration.to_tree())
        self._serve(configuration)

    def change_planners(self, configuration: config.Configuration) -> None:
        """Serve the namespaces of the planners in use, and those of no other ones."""
        wanted = config.reconfigurable(configuration)
        for namespace in [one for one in self._servers if one not in wanted]:
            self._servers.pop(namespace).close()
        tree = configuration.to_tree()
        for namespace in [one for one in wanted if one not in self._servers]:
            rospy.set_param(self._names(f"~{namespace}"), tree[namespace])
        self._serve(configuration)

    def _serve(self, configuration: config.Configuration) -> None:
        for namespace, parameters in config.reconfigurable(configuration).items():
            if namespace in self._servers:
                continue
            name = (namespace or "move_base").replace("/", "_") + "_config"
            callback = _callback(self._robot, namespace, configuration, self._on_reconfigure)
            values = config.values(configuration, namespace)
            self._servers[namespace] = ParameterServer(
                config_type(name, parameters), callback, self._names(f"~{namespace}"), values
            )


class ParameterServer(Server):
    """dynamic_reconfigure's server without its calls for every single parameter.

    The parameters were stored just before, so only changed ones are stored again. This saves a
    hundred calls to the parameter server at each robot's start.
    """

    def __init__(self, type_: Any, callback: Any, namespace: str, values: Dict[str, Any]) -> None:
        self._stored = dict(values)
        self._warnings = ThrottledWarnings()
        super().__init__(type_, callback, "" if namespace == "~" else namespace)

    def close(self) -> None:
        """Serve no longer."""
        self.set_service.shutdown()
        self.descr_topic.unregister()
        self.update_topic.unregister()

    def _set_callback(self, request: ReconfigureRequest) -> Config:
        """Handle a request without the values that have an unknown name or another type."""
        given, types_ = request.config, self.type.type
        known = Config(
            **{
                field: [one for one in getattr(given, field) if types_.get(one.name) == type_]
                for field, type_ in _FIELDS.items()
            }
        )
        unknown = sum(len(getattr(given, field)) - len(getattr(known, field)) for field in _FIELDS)
        if unknown:
            self._warnings.warn(
                f"{rospy.resolve_name(self.ns)}: reconfiguration: values dropped: {unknown} have"
                " an unknown name or another type"
            )
        return super()._set_callback(ReconfigureRequest(known))

    def _copy_from_parameter_server(self) -> None:
        self.config.update(self._stored)

    def _copy_to_parameter_server(self) -> None:
        for name, stored in self._stored.items():
            if self.config[name] != stored:
                rospy.set_param(self.ns + name, self.config[name])
                self._stored[name] = self.config[name]


def _callback(
    robot: str, namespace: str, configuration: config.Configuration, on_reconfigure: OnReconfigure
) -> Callable[[Any, int], Any]:
    """Return what requests a change and returns the values in force."""
    values, warnings = config.values(configuration, namespace), ThrottledWarnings()

    def change(requested: Any, level: int) -> Any:
        nonlocal values
        changes = {name: requested[name] for name in values if requested[name] != values[name]}
        # The server's first call, at its start, brings the loaded values: no change.
        if changes:
            try:
                values = config.values(on_reconfigure(namespace, changes), namespace)
            except InputError as error:
                warnings.error(f"{robot}: reconfiguration refused:\n{error}")
        requested.update(values)
        return requested

    return change


def _description(parameter: Parameter) -> Dict[str, Any]:
    """Return one entry of `config_description`; the type's limits replace missing bounds."""
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


def _edit_method(parameter: Parameter) -> str:
    """Return the choices as rqt_reconfigure parses them; "" for none."""
    if not parameter.choices:
        return ""
    ctype = _CTYPES[parameter.kind]
    kind = {"type": parameter.kind, "ctype": ctype, "cconsttype": "const " + ctype}
    choices = [
        {"name": one.name, "value": one.value, "description": one.description, **kind}
        for one in parameter.choices
    ]
    return str({"enum": choices, "enum_description": parameter.choices_description})
