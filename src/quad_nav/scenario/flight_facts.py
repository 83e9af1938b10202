"""Facts about the set-up of a flight, for its summary: what is needed to fly it again.

Paths are those that the user typed. Only the summary has them: recordings and reports, which are
passed on, name configuration and scene without their folders.
"""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import Any, Dict, Mapping, Optional, Sequence

from quad_nav.config.differences import Trees, difference_list
from quad_nav.files.shipped import shipped
from quad_nav.files.values import is_number
from quad_nav.scenario import RANDOM
from quad_nav.scenario.flight_setup import FlightOptions, FlightSetup
from quad_nav.scenario.simulator_setup import DEFAULT_BEAMS
from quad_nav.scenario.simulator_setup import DEFAULTS as SIMULATOR_DEFAULTS
from quad_nav.sim.flight import airframe_name
from quad_nav.sim.scene import Scene
from quad_nav.sim.simulation_params import STEP_S

SHIPPED = "shipped"
"""Name of the goals of this package."""


def offline_facts(
    options: FlightOptions, setup: FlightSetup, command: Sequence[str] = ()
) -> Dict[str, Any]:
    """Return the facts of an offline flight; ``read_setup`` made the setup of the options."""
    simulation = setup.simulation
    trees = {
        robot.name: configuration.to_tree()
        for robot, configuration in zip(setup.robots, setup.configurations)
    }
    limit_s = setup.time_limit_s
    return {
        "command": list(command),
        "configuration": _configuration(options.config, trees, dict(options.parameters)),
        "scene": _scene(setup.scene, options.scene),
        "goals": _goals(options.goals),
        "airframe": airframe_name(simulation.airframe),
        "jitter_m": simulation.jitter_m,
        "odom_drift": asdict(simulation.odom_drift),
        "localization": None,
        "lidar": {
            "beams": simulation.lidar.beam_count,
            "scan_range_rad": simulation.lidar.scan_range_rad,
            "rate_hz": round(1.0 / (STEP_S * setup.steps_per_scan), 6),
            "range_noise_m": simulation.lidar.noise_std_m,
        },
        "time_limit_s": limit_s if math.isfinite(limit_s) else None,
    }


def ros_facts(
    values: Mapping[str, Any],
    scene: Optional[Scene],
    trees: Trees,
    all_parameters: Mapping[str, Any],
) -> Dict[str, Any]:
    """Return the facts of a flight with ROS, without its command line.

    Args:
        values: Private parameters of the sequencer, with its defaults.
        scene: Scene; None if it is unknown.
        trees: The navigators' parameters.
        all_parameters: The whole parameter tree; without a simulator its facts are None.
    """
    simulator = all_parameters.get("simulator")
    given = {**SIMULATOR_DEFAULTS, **simulator} if isinstance(simulator, Mapping) else None
    return {
        "configuration": _configuration(values["config_name"] or values["config"], trees, {}),
        "scene": _scene(scene, values["scene"]),
        "goals": values["goals"],
        "airframe": given and given["airframe"],
        "jitter_m": given and given["jitter"],
        "odom_drift": given and given["odom_drift"],
        "lidar": given and _lidar(given),
        "time_limit_s": None,
    }


def _goals(folder: Optional[Path]) -> str:
    if folder is None:
        return RANDOM
    return SHIPPED if folder == shipped("goals") else str(folder)


def _configuration(name: str, trees: Trees, given: Mapping[str, Any]) -> Dict[str, Any]:
    known = any(trees.values())
    return {
        "name": str(name) or None,
        "set": dict(given),
        "differences": difference_list(trees) if known else None,
    }


def _scene(scene: Optional[Scene], file: Any) -> Optional[Dict[str, Any]]:
    if scene is None:
        return None
    return {
        "name": scene.name,
        "file": str(file) if file not in (None, "", RANDOM) else None,
        "size_m": [scene.size_x_m, scene.size_y_m],
        "origin_m": [scene.origin_x_m, scene.origin_y_m],
        "obstacles": len(scene.obstacles),
    }


def _lidar(given: Mapping[str, Any]) -> Dict[str, Any]:
    """Return the LIDARs' facts; the simulator itself reports values that it cannot use."""
    step_rad, range_rad = given["step_size"], given["scan_range"]
    steps = is_number(step_rad) and is_number(range_rad) and step_rad > 0
    return {
        "beams": round(range_rad / step_rad) if steps else DEFAULT_BEAMS,
        "scan_range_rad": given["scan_range"],
        "rate_hz": given["lidar_rate"],
        "range_noise_m": given["range_noise"],
    }
