"""Parameters of navigators: those that were loaded, and those that can be changed in flight."""

from __future__ import annotations

import ast
import math
import threading
import time
from functools import partial
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import rosgraph
import rospy
from dynamic_reconfigure.msg import (
    BoolParameter,
    Config,
    ConfigDescription,
    DoubleParameter,
    IntParameter,
    StrParameter,
)
from dynamic_reconfigure.srv import Reconfigure, ReconfigureRequest

from quad_nav import config
from quad_nav.config import Configuration
from quad_nav.config.planners import planner_names
from quad_nav.errors import InputError, excerpt
from quad_nav.sim.scene import BODY_RADIUS_M
from quad_web.ros.calls import PATIENCE_S, CallFailed, call, in_threads
from quad_web.view.actions import Answer, ParameterView

_SERVICE = "/set_parameters"
_RETRY_S = 5.0
_INT_MAX = 2**31 - 1
_FIELDS = {"bools": "bool", "ints": "int", "strs": "str", "doubles": "double"}
_ENTRIES = {
    "bool": ("bools", BoolParameter, bool),
    "int": ("ints", IntParameter, int),
    "str": ("strs", StrParameter, str),
    "double": ("doubles", DoubleParameter, float),
}

Tree = Mapping[str, Any]


def values_of(message: Config) -> Dict[str, Any]:
    """Return the values of a `Config` by their names."""
    return {one.name: one.value for field in _FIELDS for one in getattr(message, field)}


class NavigatorTrees:
    """Parameters of navigators as they were loaded.

    They come from the mission, see `/quad/flight`. Without a mission they are those that are on
    the parameter server when they are first asked for.
    """

    def __init__(self, of_mission: Mapping[int, Tree]) -> None:
        """Start with the parameters by the robots' numbers that a mission has published."""
        self._of_mission = of_mission
        self._of_server: Dict[int, Tree] = {}
        self._retry_s: Dict[int, float] = {}
        self._configurations: Dict[int, Tuple[Tree, Optional[Configuration]]] = {}

    def tree(self, robot: int) -> Tree:
        """Return the parameters of a robot's navigator; {} if they are unknown."""
        tree = self._of_mission.get(robot) or self._of_server.get(robot)
        if tree or time.monotonic() < self._retry_s.get(robot, 0.0):
            return tree or {}
        self._retry_s[robot] = time.monotonic() + _RETRY_S
        self._of_server[robot] = present_tree(robot)
        return self._of_server[robot]

    def configuration(self, robot: int) -> Optional[Configuration]:
        """Return the configuration of a robot's navigator; None if it is unknown."""
        tree = self.tree(robot)
        known = self._configurations.get(robot)
        if known is None or known[0] is not tree:
            try:
                loaded = config.load(tree, f"/move_base{robot}") if tree else None
            except InputError:  # a navigator of another kind
                loaded = None
            known = self._configurations[robot] = tree, loaded
        return known[1]

    def safety_radius_m(self, robot: int) -> float:
        """Return the radius of a robot plus the margin that it keeps."""
        configuration = self.configuration(robot)
        if configuration is None:
            return BODY_RADIUS_M
        radius_m = configuration.body_radius_m or BODY_RADIUS_M
        return radius_m + configuration.peers.margin_m

    def recoveries(self, robot: int) -> int:
        """Return the number of a navigator's recovery behaviours; 0 if it is unknown."""
        configuration = self.configuration(robot)
        return 0 if configuration is None else len(configuration.recoveries)


def present_tree(robot: int) -> Dict[str, Any]:
    """Return the parameters of a navigator on the parameter server; {} if there are none."""
    try:
        tree = rosgraph.Master(rospy.get_name()).getParam(f"/move_base{robot}")
    except (rosgraph.MasterError, OSError):
        return {}
    return tree if isinstance(tree, dict) else {}


class NavigatorParameters:
    """The dynamic_reconfigure servers of all navigators."""

    def __init__(self, trees: NavigatorTrees) -> None:
        """Start without descriptions; ``trees`` has the parameters as they were loaded."""
        self._trees = trees
        self._views: Dict[str, List[ParameterView]] = {}  # by the namespace's full name
        self._lock = threading.Lock()

    def views(self, robot: int) -> List[ParameterView]:
        """Return the parameters of a robot's navigator with their present values.

        Raises:
            CallFailed: If the ROS master or the navigator does not respond.
        """
        node = f"/move_base{robot}"
        namespaces = self._namespaces(node)
        self._describe([one for one in namespaces if one not in self._views], node)
        present, loaded = present_tree(robot), self._trees.tree(robot)
        return [
            self._with_values(view, present, loaded)
            for namespace in namespaces
            for view in self._views.get(namespace, ())
        ]

    def _namespaces(self, node: str) -> List[str]:
        try:
            services = rosgraph.Master(rospy.get_name()).getSystemState()[2]
        except (rosgraph.MasterError, OSError) as error:
            raise CallFailed(f"the ROS master does not respond: {error}") from error
        names = [name[: -len(_SERVICE)] for name, _ in services if name.endswith(_SERVICE)]
        found = sorted(name for name in names if name == node or name.startswith(f"{node}/"))
        if not found:
            raise CallFailed(f"{node}{_SERVICE}: no node provides this service")
        return found

    def _describe(self, namespaces: Sequence[str], node: str) -> None:
        described = in_threads([partial(_description, one) for one in namespaces])
        with self._lock:
            for namespace, message in zip(namespaces, described):
                relative = namespace[len(node) :].strip("/")
                self._views[namespace] = _described(relative, message)

    def _with_values(self, view: ParameterView, present: Tree, loaded: Tree) -> ParameterView:
        names = [*view.namespace.split("/"), view.name] if view.namespace else [view.name]
        value = _below(present, names, view.value)
        fields = {**vars(view), "value": value, "file_value": _below(loaded, names, value)}
        return ParameterView(**fields)

    def set(self, robot: int, namespace: str, values: Mapping[str, Any]) -> Answer:
        """Change parameters of one namespace, and say which values are in force then.

        Raises:
            CallFailed: If the navigator does not respond.
        """
        name = f"/move_base{robot}" + (f"/{namespace}" if namespace else "")
        if name not in self._views:
            self.views(robot)
        kinds = {view.name: view for view in self._views.get(name, ())}
        request = Config()
        for key, value in values.items():
            problem = _add(request, kinds.get(key), key, value)
            if problem:
                return Answer(False, f"quad{robot}: {problem}")
        response = call(f"{name}{_SERVICE}", Reconfigure, ReconfigureRequest(request))
        return _answer(f"quad{robot}: {namespace}".rstrip(": "), values, values_of(response.config))


def _description(namespace: str) -> ConfigDescription:
    topic = f"{namespace}/parameter_descriptions"
    try:
        return rospy.wait_for_message(topic, ConfigDescription, PATIENCE_S)
    except rospy.ROSException as error:
        raise CallFailed(f"{topic}: {error}") from error


def _described(namespace: str, message: ConfigDescription) -> List[ParameterView]:
    lows, highs, defaults = map(values_of, (message.min, message.max, message.dflt))
    views = []
    for group in message.groups:
        for one in group.parameters:
            if one.type not in _ENTRIES or one.name not in defaults:
                continue
            views.append(
                ParameterView(
                    namespace,
                    one.name,
                    one.type,
                    defaults[one.name],
                    defaults[one.name],
                    _limit(lows.get(one.name), one.type),
                    _limit(highs.get(one.name), one.type),
                    _choices(one.edit_method)
                    or tuple((name, name) for name in planner_names(namespace, one.name)),
                    one.description,
                )
            )
    return views


def _limit(value: Any, kind: str) -> Optional[float]:
    """Return an end of a range; None if it is that of the type."""
    if kind not in ("int", "double") or value is None or not math.isfinite(value):
        return None
    return None if kind == "int" and abs(value) >= _INT_MAX else value


def _choices(edit_method: str) -> Tuple[Tuple[str, Any], ...]:
    """Return the choices of an enumeration, written as rqt_reconfigure parses them."""
    if not edit_method:
        return ()
    try:
        entries = ast.literal_eval(edit_method)["enum"]
        return tuple((str(entry["name"]), entry["value"]) for entry in entries)
    except (ValueError, SyntaxError, LookupError, TypeError, RecursionError, MemoryError):
        return ()


def _below(tree: Any, names: Sequence[str], otherwise: Any) -> Any:
    for name in names:
        if not isinstance(tree, Mapping) or name not in tree:
            return otherwise
        tree = tree[name]
    return tree


def _add(request: Config, view: Optional[ParameterView], name: str, value: Any) -> str:
    """Add a value to a request; return why it cannot be one of this parameter, or ""."""
    if view is None:
        return f"{excerpt(name)}: is not a parameter that can be changed in flight"
    field, entry, type_ = _ENTRIES[view.kind]
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    fits = {
        "bool": isinstance(value, bool),
        "str": isinstance(value, str),
        "double": is_number and math.isfinite(value),
        "int": is_number and abs(value) <= _INT_MAX and value == int(value),
    }[view.kind]
    if not fits:
        kind = {"bool": "true or false", "str": "a text", "double": "a finite number"}
        return f"{name}: {excerpt(str(value))}; expected {kind.get(view.kind, 'a whole number')}"
    low, high = view.minimum, view.maximum
    if (low is not None and value < low) or (high is not None and value > high):
        ends = [
            f"{word} {end:g}"
            for word, end in (("at least", low), ("at most", high))
            if end is not None
        ]
        return f"{name}: {value:g}; expected {', '.join(ends)}"
    getattr(request, field).append(entry(name, type_(value)))
    return ""


def _answer(place: str, wanted: Mapping[str, Any], present: Mapping[str, Any]) -> Answer:
    """Say which values are in force; a refused one is not the wanted one."""
    texts = [f"{name} is {_text(present.get(name))}" for name in wanted]
    refused = [name for name, value in wanted.items() if present.get(name) != value]
    text = f"{place}: {', '.join(texts)}"
    if not refused:
        return Answer(True, text)
    asked = ", ".join(f"{name} {_text(wanted[name])}" for name in refused)
    return Answer(False, f"{text}; {asked} was refused, the log says why")


def _text(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else excerpt(str(value))
