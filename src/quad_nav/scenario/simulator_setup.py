"""What a simulator is asked to simulate: its parameters, all checked."""

from __future__ import annotations

import difflib
import math
from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Mapping, Tuple

from quad_nav.errors import InputError
from quad_nav.scenario.fleet_setup import configurations, mission_of, scene_of
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.scene import Scene
from quad_nav.sim.simulation import LIDAR_CASTERS, STEPS_PER_S, SimulationParams, start_poses

DEFAULT_BEAMS = 512
DEFAULTS: Dict[str, Any] = {
    "scene": "",  # file, or random
    "size": 0.0,  # a random arena's side, m; 0: room for all
    "config": "",  # folder of a fleet's navigators
    "robots": 2,
    "rate": 1.0,  # simulated seconds per second
    "gui": False,  # pybullet's window
    "start_paused": True,  # until /simulation/start
    "lidar": "kernel",  # who finds what beams hit: kernel or bullet
    "scan_range": 2 * math.pi,  # LIDAR's field of view, rad
    "step_size": 0.0,  # rad between beams; 0: 512 beams over scan_range
    "lidar_rate": 20.0,  # scans per simulated second
    "range_noise": 0.0,  # standard deviation, m
    "seed": 0,  # for noise and jitter
    "jitter": 0.0,  # how far starts are displaced, m
    "command_timeout": 0.5,  # hover after this plus ...
    "controller_period": 0.05,  # ... this without commands, s; the node asks the navigators
}


@dataclass(frozen=True)
class SimulatorSetup:
    """A simulation that can be run."""

    scene: Scene
    robots: int
    params: SimulationParams
    seed: int
    rate: float
    gui: bool
    start_paused: bool
    steps_per_scan: int


def read_setup(parameters: Mapping[str, Any], name: str) -> SimulatorSetup:
    """The simulation that a node's private parameters describe.

    Raises:
        InputError: every fault in the parameters and in the scene.
    """
    values = {**DEFAULTS, **parameters}
    problems = [_unknown(name, key) for key in parameters if key not in DEFAULTS]
    problems += [
        f"{name}: {key}: is {values[key]!r}, expected {expected}"
        for key, (accepts, expected) in _RULES.items()
        if not accepts(values[key])
    ]
    if problems:
        raise InputError(problems)
    scene = scene_of(values)
    if values["config"] and "controller_period" not in parameters:
        values["controller_period"] = _fleets_controller_period_s(values)
    try:
        params = _simulation_params(values)
        start_poses(scene, values["robots"], params.jitter_m, values["seed"])
    except InputError as error:
        raise InputError([f"{name}: {problem}" for problem in error.problems]) from error
    return SimulatorSetup(
        scene,
        values["robots"],
        params,
        values["seed"],
        float(values["rate"]),
        values["gui"],
        values["start_paused"],
        round(STEPS_PER_S / values["lidar_rate"]),
    )


def _fleets_controller_period_s(values: Mapping[str, Any]) -> float:
    """The slowest ``controller_frequency`` of a fleet configured from files, as a period.

    Raises:
        InputError: every fault in the files.
    """
    return max(
        1.0 / one.navigator.controller_frequency_hz
        for one in configurations(values["config"], values["robots"], mission_of(values))
    )


def longest_controller_period_s(all_parameters: Mapping[str, Any], robots: Any) -> float:
    """The slowest navigator's ``controller_frequency`` as a period.

    The watchdog must not take the pause between two commands of a 1 Hz controller
    for the end of its commands. Navigators without the parameter run at its default.
    """
    default = DEFAULTS["controller_period"]
    names = [f"move_base{i}" for i in range(robots if _is_whole(robots) else 0)]
    frequencies = [all_parameters.get(name, {}).get("controller_frequency") for name in names]
    return max((1.0 / f for f in frequencies if _is_number(f) and f > 0), default=default)


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
        controller_period_s=float(values["controller_period"]),
        jitter_m=float(values["jitter"]),
        lidar_caster=values["lidar"],
    )


def _is_number(value: Any) -> bool:
    return (
        isinstance(value, (int, float))
        and not isinstance(value, bool)
        and math.isfinite(value)
        and value >= 0
    )


def _is_whole(value: Any) -> bool:
    return _is_number(value) and isinstance(value, int)


def _divides(value: Any) -> bool:
    """Whether scans at this rate fall on whole steps of the simulation."""
    if not _is_number(value) or not 0 < value <= STEPS_PER_S:
        return False
    steps = STEPS_PER_S / value
    return abs(steps - round(steps)) < 1e-9


_Rule = Tuple[Callable[[Any], bool], str]
_BOOLEAN: _Rule = (lambda v: isinstance(v, bool), "true or false")
_AMOUNT: _Rule = (_is_number, "a number, 0 or more")
_RULES: Dict[str, _Rule] = {
    "scene": (
        lambda v: isinstance(v, str) and v != "",
        "a scene file such as scenes/arena.yaml, or random",
    ),
    "size": _AMOUNT,
    "config": (lambda v: isinstance(v, str), "a folder of YAML files, or nothing"),
    "robots": (lambda v: _is_whole(v) and v >= 1, "a whole number, 1 or more"),
    "rate": (lambda v: _is_number(v) and v > 0, "a number above 0"),
    "gui": _BOOLEAN,
    "start_paused": _BOOLEAN,
    "lidar": (lambda v: v in LIDAR_CASTERS, " or ".join(LIDAR_CASTERS)),
    "scan_range": _AMOUNT,
    "step_size": _AMOUNT,
    "lidar_rate": (_divides, f"scans per second that divide {STEPS_PER_S}, such as 10 or 20"),
    "range_noise": _AMOUNT,
    "seed": (_is_whole, "a whole number, 0 or more"),
    "jitter": _AMOUNT,
    "command_timeout": _AMOUNT,
    "controller_period": _AMOUNT,
}


def _unknown(name: str, key: str) -> str:
    near: List[str] = difflib.get_close_matches(key, list(DEFAULTS), n=1)
    return (
        f"{name}: {key}: is not a parameter of the simulator, expected "
        f"{near[0] if near else 'one of ' + ', '.join(DEFAULTS)}"
    )
