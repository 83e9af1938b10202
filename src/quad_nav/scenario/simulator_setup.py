"""Set-up of the simulator, from the node's private parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Dict, List, Mapping, Optional, Sequence

from quad_nav.config import Configuration, load
from quad_nav.costmap.static import StaticLayerParams
from quad_nav.errors import InputError
from quad_nav.files.values import is_number, is_whole, optional, unknown_names, value_faults
from quad_nav.scenario.navigator_parameters import load_navigators
from quad_nav.scenario.rules import RULES, SIMULATOR, steps_per_scan
from quad_nav.scenario.scenario import (
    area_of,
    body_radius_m,
    read_configurations,
    scene_of,
)
from quad_nav.sim.flight import AIRFRAMES
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.odometry import OdometryErrors
from quad_nav.sim.scene import BODY_RADIUS_M, Scene
from quad_nav.sim.simulation_params import SimulationParams
from quad_nav.sim.start_poses import start_poses

DEFAULT_BEAMS = 512
DEFAULTS: Dict[str, Any] = {
    "scene": "",  # file, or random
    "size": 0.0,  # a random arena's side, m; 0: room for all
    "goals": "",  # as the sequencer's: starts that a scene lacks are where goals can be reached
    "config": "",  # folder of a fleet's navigators
    "robots": 2,
    "rate": 1.0,  # simulated seconds per second
    "gui": False,  # pybullet's window
    "start_paused": True,  # until /simulation/start
    "airframe": "default",  # how bodies respond: default or arducopter
    "lidar": "kernel",  # what casts the beams: kernel or bullet
    "scan_range": 2 * math.pi,  # LIDAR's field of view, rad
    "step_size": 0.0,  # rad between beams; 0: 512 beams over scan_range
    "lidar_rate": 20.0,  # scans per simulated second
    "range_noise": 0.0,  # standard deviation, m
    "odom_drift": {},  # errors of the odometry, by name
    "localization": SIMULATOR,  # who publishes map -> odom{i}
    "seed": 0,  # for noise, jitter and drift
    "jitter": 0.0,  # radius of the disc in which starts are displaced, m
    "command_timeout": 0.5,  # s; a robot hovers after command_timeout plus
    "controller_period": 0.05,  # controller_period without commands; the node asks the navigators
    "body_radius": BODY_RADIUS_M,  # m, of the quadcopters' guards; the navigators may have another
    "map_resolution": 0.0,  # m, cells of the scene's map on the topic map; 0: no map
    "composed": False,  # host the robots' navigators, too
    "separate": {},  # {nav3: package}: robots whose navigators are nodes of their own all the same
    "hosts": 0,  # processes that share the navigators, the simulator's included; 0: chosen
}
_RULES = {
    **{name: RULES[name] for name in DEFAULTS},
    "config": optional(RULES["config"]),
    "goals": optional(RULES["goals"]),
    "hosts": optional(RULES["hosts"], 0),
}


@dataclass(frozen=True)
class SimulatorSetup:
    """A simulation that can be run.

    Attributes:
        rate: Simulated seconds per second.
        configurations: Those of the robots whose navigators are in the simulation's processes, by
            number.
        localization: Who publishes the poses in ``map``.
        hosts: Number of these processes; 0 if nobody chose it.
    """

    scene: Scene
    robots: int
    params: SimulationParams
    seed: int
    rate: float
    gui: bool
    start_paused: bool
    steps_per_scan: int
    map_resolution_m: float = 0.0
    configurations: Mapping[int, Configuration] = field(default_factory=dict)
    localization: str = SIMULATOR
    hosts: int = 0


def read_setup(
    parameters: Mapping[str, Any],
    name: str,
    all_parameters: Mapping[str, Any] = MappingProxyType({}),
) -> SimulatorSetup:
    """Read the simulation that a node's private parameters describe.

    Args:
        parameters: The node's private parameters.
        name: The node's name, for messages.
        all_parameters: Those of all nodes; without ``config`` navigators have theirs from there.

    Raises:
        InputError: Every fault in the parameters and in the scene.
    """
    values = _checked_values(parameters, name)
    scene, localization = scene_of(values), values["localization"]
    if values["config"]:
        area = area_of(values)
        fleet = read_configurations(values["config"], values["robots"], area, numbered=True)
        values = {**DEFAULTS, **_asked_for(fleet), **parameters}
        hosted = {number: fleet[number] for number in _hosted(values)}
    else:
        trees = {i: all_parameters.get(f"move_base{i}", {}) for i in _hosted(values)}
        hosted = load_navigators(trees, all_parameters)
    return SimulatorSetup(
        scene,
        values["robots"],
        _checked_params(scene, values, name),
        values["seed"],
        float(values["rate"]),
        values["gui"],
        values["start_paused"],
        steps_per_scan(values["lidar_rate"]),
        # Who localizes publishes the map.
        float(values["map_resolution"]) if localization == SIMULATOR else 0.0,
        hosted,
        localization,
        values["hosts"],
    )


def _checked_values(parameters: Mapping[str, Any], name: str) -> Dict[str, Any]:
    values = {**DEFAULTS, **parameters}
    problems = unknown_names(parameters, DEFAULTS, name, "a parameter of the simulator")
    problems += value_faults(values, _RULES, name) or _host_faults(values, name)
    if problems:
        raise InputError(problems)
    return values


def _checked_params(scene: Scene, values: Mapping[str, Any], name: str) -> SimulationParams:
    """Return the simulation's parameters, with which every quadcopter has a start pose."""
    try:
        params = _simulation_params(values)
        start_poses(
            scene, values["robots"], params.jitter_m, values["seed"], params.airframe.radius_m
        )
    except InputError as error:
        raise InputError([f"{name}: {problem}" for problem in error.problems]) from error
    return params


def _hosted(values: Mapping[str, Any]) -> List[int]:
    """Return the numbers of the robots whose navigators the simulator hosts."""
    if not values["composed"]:
        return []
    return [i for i in range(values["robots"]) if f"nav{i}" not in values["separate"]]


def _host_faults(values: Mapping[str, Any], name: str) -> List[str]:
    count = len(_hosted(values))
    if not count or values["hosts"] <= count:
        return []
    return [f"{name}: hosts {values['hosts']} for {count} robots; expected a robot for each host"]


def asked_for_by_navigators(all_parameters: Mapping[str, Any], robots: Any) -> Dict[str, Any]:
    """Return parameters of the simulator that follow from those of navigators on the server.

    Navigators with faults are left out; they name their faults themselves.
    """
    configurations: List[Optional[Configuration]] = []
    for number in range(robots if is_whole(robots) else 0):
        tree = all_parameters.get(f"move_base{number}")
        if isinstance(tree, Mapping) and "body_radius" in tree:
            try:
                configurations.append(load(tree))
            except InputError:
                continue
    period_s = _longest_controller_period_s(all_parameters, robots)
    return {**_asked_for(configurations), "controller_period": period_s}


def _asked_for(configurations: Sequence[Optional[Configuration]]) -> Dict[str, Any]:
    """Return parameters of the simulator that follow from its robots' configurations.

    Other robots, which have a ``body_radius``, get the scene's map where they need a map: nothing
    else publishes it. The cells are as small as the smallest that are asked for.
    """
    found = [one for one in configurations if one is not None]
    periods = [1.0 / one.navigator.controller_frequency_hz for one in found]
    cells = [
        costmap.resolution_m
        for one in found
        for costmap in one.costmaps.values()
        if one.body_radius_m and any(isinstance(p, StaticLayerParams) for _, p in costmap.layers)
    ]
    return {
        "body_radius": body_radius_m(found, BODY_RADIUS_M),
        "map_resolution": min(cells, default=0.0),
        "controller_period": max(periods, default=DEFAULTS["controller_period"]),
    }


def _longest_controller_period_s(all_parameters: Mapping[str, Any], robots: Any) -> float:
    """Return the longest control period of navigators that have their parameters on the server.

    The watchdog for commands waits for it: a controller of 1 Hz pauses for 1 s between two
    commands. A navigator without ``controller_frequency`` runs at the default.
    """
    default: float = DEFAULTS["controller_period"]
    names = [f"move_base{i}" for i in range(robots if is_whole(robots) else 0)]
    frequencies = [all_parameters.get(name, {}).get("controller_frequency") for name in names]
    return max((1.0 / f for f in frequencies if is_number(f) and f > 0), default=default)


def _simulation_params(values: Mapping[str, Any]) -> SimulationParams:
    scan_range = float(values["scan_range"])
    lidar = LidarParams(
        scan_range,
        float(values["step_size"]) or scan_range / DEFAULT_BEAMS,
        noise_std_m=float(values["range_noise"]),
    )
    return SimulationParams(
        lidar,
        command_timeout_s=float(values["command_timeout"]),
        airframe=replace(AIRFRAMES[values["airframe"]], radius_m=float(values["body_radius"])),
        controller_period_s=float(values["controller_period"]),
        jitter_m=float(values["jitter"]),
        lidar_caster=values["lidar"],
        odom_drift=OdometryErrors.of(values["odom_drift"]),
    )
