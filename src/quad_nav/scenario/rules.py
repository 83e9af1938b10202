"""Rules for the values of a set-up: one for each name, the same in both shells."""

from __future__ import annotations

from typing import Any, Dict

from quad_nav.files.values import (
    BOOLEAN,
    Rule,
    choice,
    is_number,
    number,
    optional,
    text,
    whole,
)
from quad_nav.scenario import RANDOM
from quad_nav.sim.flight import AIRFRAMES
from quad_nav.sim.odometry import ERROR_NAMES, MAX_ERROR
from quad_nav.sim.simulation_params import LIDAR_CASTERS, STEPS_PER_S

START_S = 1.0
"""Time on `/clock` when a simulation starts: rospy treats 0 as a clock without messages."""
MAX_SIZE_M = 250  # a larger random arena takes minutes to fill with obstacles
MAX_ROBOTS = 100
"""Each has costmaps of its own: a thousand need more memory than most machines have."""
SIMULATOR = "simulator"
LOCALIZATIONS = (SIMULATOR, "amcl", "slam", "none")
"""Who publishes ``map -> odom{i}``: the simulator, our nodes, or somebody else."""
MAX_SEED = 2**63 - 1
"""Recordings hold the seed as an int64."""


def steps_per_scan(scans_per_s: float) -> int:
    """Number of simulation steps between two scans, for a rate that ``lidar_rate`` accepts."""
    return round(STEPS_PER_S / scans_per_s)


def _divides(value: Any) -> bool:
    """True if scans at this rate fall on whole steps of the simulation."""
    if not is_number(value) or not 0 < value <= STEPS_PER_S:
        return False
    steps = STEPS_PER_S / value
    return abs(steps - round(steps)) < 1e-9


def _are_errors(value: Any) -> bool:
    """True for errors of odometry, by name."""
    error = number(at_least=0, at_most=MAX_ERROR)
    return isinstance(value, dict) and all(
        name in ERROR_NAMES and error.accepts(one) for name, one in value.items()
    )


def _is_packages(value: Any) -> bool:
    """True for the packages of separate navigators, by ``nav{i}``."""
    return isinstance(value, dict) and all(
        isinstance(name, str) and isinstance(package, str) for name, package in value.items()
    )


def _is_path_or_paths(value: Any) -> bool:
    if isinstance(value, list):
        return all(isinstance(path, str) for path in value)
    return isinstance(value, str) and value != ""


RULES: Dict[str, Rule] = {
    # Scene, goals and configurations.
    "scene": text(f"a scene file such as scenes/arena.yaml, or {RANDOM}"),
    "goals": Rule(
        _is_path_or_paths, "a folder with quad0_goals.json and so on, a file, or a list of files"
    ),
    "config": text("a folder of YAML files, or the name of a shipped one"),
    "body_radius": number(above=0, unit="metres"),
    "map_resolution": number(at_least=0, unit="metres"),
    "robots": whole(at_least=1, at_most=MAX_ROBOTS),
    "seed": whole(at_least=0, at_most=MAX_SEED),
    "size": Rule(
        number(at_least=0, at_most=MAX_SIZE_M).accepts,
        f"a number of metres, 0 to {MAX_SIZE_M}; 0 has room for all robots",
    ),
    "robot_radius": number(above=0, unit="metres"),
    # The simulation.
    "rate": number(above=0),
    "jitter": number(at_least=0),
    "airframe": choice(tuple(AIRFRAMES)),
    "lidar": choice(LIDAR_CASTERS),
    "lidar_rate": Rule(_divides, f"scans per second that divide {STEPS_PER_S}, such as 10 or 20"),
    "scan_range": number(at_least=0),
    "step_size": number(at_least=0),
    "range_noise": number(at_least=0),
    "odom_drift": Rule(
        _are_errors,
        f"a mapping of {', '.join(ERROR_NAMES)} to numbers from 0 to {MAX_ERROR:g}, such as "
        "{per_m: 0.05, per_rad: 0.05}",
    ),
    "localization": choice(LOCALIZATIONS),
    "command_timeout": number(at_least=0),
    "controller_period": number(at_least=0),
    "gui": BOOLEAN,
    "start_paused": BOOLEAN,
    # The mission.
    "time_limit": Rule(
        lambda value: isinstance(value, (int, float)) and value > 0, "a number of seconds above 0"
    ),
    "simulation": BOOLEAN,
    "start_service": optional(text("the name of a service")),
    "end_service": optional(text("the name of a service")),
    "ready_timeout": number(above=0, unit="seconds"),
    "viewers": optional(text("names of nodes with spaces between")),
    "exit_when_done": BOOLEAN,
    "resume": BOOLEAN,
    "result": optional(text("a file to write")),
    "journal": optional(text("a file to write")),
    # A fleet's processes.
    "hosts": whole(at_least=1),
    "host": Rule(whole(at_least=0).accepts, "a whole number below hosts"),
    "composed": BOOLEAN,
    "separate": Rule(_is_packages, "packages of navigators, such as {nav3: move_base}"),
}
