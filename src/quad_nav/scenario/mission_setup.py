"""Set-up of the sequencer's mission, from the node's private parameters.

Everything is read before anything flies, and every fault is listed at once.
"""

from __future__ import annotations

import json
import zlib
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

from quad_nav.config import Configuration
from quad_nav.errors import InputError
from quad_nav.files.output import output_faults
from quad_nav.files.values import expected_name, optional, value_faults
from quad_nav.mission.distances import SurfaceDistance
from quad_nav.mission.goal_file import SETTINGS, SequenceSettings, read_settings
from quad_nav.mission.robot_goals import RobotGoals
from quad_nav.scenario import RANDOM
from quad_nav.scenario.coverage import scene_bounds
from quad_nav.scenario.flight_facts import ros_facts
from quad_nav.scenario.navigator_parameters import load_navigators
from quad_nav.scenario.rules import RULES, START_S
from quad_nav.scenario.scenario import Scenario, ScenarioRequest, read_configurations, read_scenario
from quad_nav.sim.crowd_record import CrowdRecord
from quad_nav.sim.movers import Movers
from quad_nav.sim.scene import BODY_RADIUS_M, Scene

START_SERVICE = "/simulation/start"
_KEPT_PLACES = 600  # of each person: a minute
DEFAULTS: Dict[str, Any] = {
    "robots": 2,
    "goals": "",
    "scene": "",  # file, or random; nothing when the arena is unknown
    "seed": 0,  # of a random mission, as the next
    "size": 0.0,
    "config": "",  # folder of a fleet's navigators
    "config_name": "",  # name of the navigators' configuration, for the summary
    "robot_radius": BODY_RADIUS_M,
    "simulation": True,
    "start_service": "",  # called before the first goal; the simulator's with `simulation`
    "end_service": "",  # called after the last goal, before the node exits
    "ready_timeout": 180.0,  # kernels may have to be compiled first, in each process
    "viewers": "",  # names of nodes that show the flight and are waited for, with spaces between
    "exit_when_done": False,
    "result": "",
    "resume": False,
    "journal": "",
}
# ``read_scenario`` checks the others.
_OWN = ["simulation", "start_service", "end_service", "ready_timeout", "exit_when_done"]
_OWN += ["result", "resume", "journal", "viewers"]
_RULES = {"config": optional(RULES["config"]), **{name: RULES[name] for name in _OWN}}


@dataclass(frozen=True)
class MissionSetup:
    """A mission that can be flown.

    ``scene`` and ``surface_distance`` are None if the scene is unknown. ``surface_distance`` reads
    ``people``, where people are who react to quadcopters; None if there are none. ``start_service``
    is called before the first goal is sent, ``end_service`` before the node exits, if they have
    names. ``configurations`` are the navigators', None for one whose parameters are unknown.
    ``facts`` are for the summary. ``viewers`` are nodes that should hear the flight's beginning.
    """

    robots: Tuple[RobotGoals, ...]
    robot_radius_m: float
    scene: Optional[Scene]
    surface_distance: Optional[SurfaceDistance]
    simulation: bool
    ready_timeout_s: float
    exit_when_done: bool
    warnings: Tuple[str, ...]
    journal: Path
    resume: bool
    configurations: Tuple[Optional[Configuration], ...] = ()
    facts: Mapping[str, Any] = field(default_factory=dict)
    notes: Tuple[str, ...] = ()
    start_service: str = ""
    end_service: str = ""
    people: Optional[CrowdRecord] = None
    viewers: Tuple[str, ...] = ()

    @property
    def parameters(self) -> Tuple[Mapping[str, Any], ...]:
        """The navigators' parameter trees, {} for one that is unknown."""
        return tuple(one.to_tree() if one else {} for one in self.configurations)


def read_setup(
    parameters: Mapping[str, Any],
    name: str,
    result: Path,
    journals: Path,
    all_parameters: Mapping[str, Any] = MappingProxyType({}),
) -> MissionSetup:
    """Read the mission that a node's private parameters describe.

    The navigators' parameters are checked as well, because a navigator that does not start is
    noticed late, and goals are checked against their global costmaps.

    Args:
        parameters: The node's private parameters.
        name: The node's name, for messages.
        result: File for the summary.
        journals: Folder for journals without a name.
        all_parameters: The whole parameter tree, with those of ``move_base{i}``. With the
            parameter ``config`` the navigators are a fleet that reads its files itself.

    Raises:
        InputError: Every fault in the parameters, the scene, the goal files and the navigators'
            parameters.
    """
    values = {**DEFAULTS, **parameters}
    settings, faults = read_settings({k: values[k] for k in SETTINGS if k in values}, name)
    problems = value_faults(values, _RULES, name) + _output_faults(values, result, name) + faults
    request = _request(values, settings, name, all_parameters)
    scenario, faults = read_scenario(request, partial(_navigators, values, all_parameters))
    if problems + faults:
        raise InputError(list(dict.fromkeys(problems + faults)))
    warnings = (*_unknown_parameters(parameters, name), *scenario.warnings)
    setup = _mission_setup(values, scenario, warnings, journals)
    trees = {robot.name: tree for robot, tree in zip(setup.robots, setup.parameters)}
    return replace(setup, facts=ros_facts(values, scenario.scene, trees, all_parameters))


def _request(
    values: Mapping[str, Any],
    settings: SequenceSettings,
    name: str,
    all_parameters: Mapping[str, Any],
) -> ScenarioRequest:
    return ScenarioRequest(
        **{key: values[key] for key in ("scene", "goals", "robots", "seed", "size")},
        robot_radius=values["robot_radius"],
        settings=settings,
        simulated=values["simulation"] is not False and not _odometry_drifts(all_parameters),
        source=name,
    )


def _odometry_drifts(all_parameters: Mapping[str, Any]) -> bool:
    simulator = all_parameters.get("simulator")
    drift = simulator.get("odom_drift") if isinstance(simulator, Mapping) else None
    return isinstance(drift, Mapping) and any(drift.values())


def _mission_setup(
    values: Mapping[str, Any], scenario: Scenario, warnings: Tuple[str, ...], journals: Path
) -> MissionSetup:
    scene = scenario.scene
    people = None if scene is None else CrowdRecord.of(scene, _KEPT_PLACES)
    movers = None if scene is None else Movers(scene, values["seed"], START_S, people)
    return MissionSetup(
        scenario.robots,
        scenario.robot_radius_m,
        scene,
        None if movers is None else movers.flight_surface_distances_m,
        values["simulation"],
        float(values["ready_timeout"]),
        values["exit_when_done"],
        warnings,
        _journal_path(values, journals),
        values["resume"],
        scenario.configurations,
        notes=scenario.notes,
        start_service=values["start_service"] or (START_SERVICE if values["simulation"] else ""),
        end_service=values["end_service"],
        people=people,
        viewers=tuple(values["viewers"].split()),
    )


def _navigators(
    values: Mapping[str, Any],
    all_parameters: Mapping[str, Any],
    robots: int,
    scene: Optional[Scene],
) -> Sequence[Optional[Configuration]]:
    """Read the navigators' configurations, from a fleet's files or from the parameter server."""
    if values["config"] and isinstance(values["config"], str):
        area = scene_bounds(scene) if scene else None
        return read_configurations(values["config"], robots, area, numbered=True)
    trees = {i: all_parameters.get(f"move_base{i}") for i in range(robots)}
    given = {i: tree for i, tree in trees.items() if tree is not None}
    found = load_navigators(given, all_parameters)
    return [found.get(i) for i in trees]


def _journal_path(values: Mapping[str, Any], journals: Path) -> Path:
    """The journal's path; a journal without a name is named after the mission."""
    if values["journal"]:
        return Path(values["journal"]).expanduser()
    goals = values["goals"] if isinstance(values["goals"], list) else [values["goals"]]
    paths = [path if path == RANDOM else str(Path(path).expanduser().resolve()) for path in goals]
    mission = [values["robots"], paths, values["scene"], values["seed"], values["size"]]
    number = zlib.crc32(json.dumps(mission).encode())
    return journals / f"journal-{number:08x}.jsonl"


def _output_faults(values: Mapping[str, Any], result: Path, name: str) -> List[str]:
    """Faults of the files that the sequencer writes; a journal in ROS's home is not required."""
    faults = output_faults(result, f"{name}: result")
    if values["journal"] and isinstance(values["journal"], str):
        journal = Path(values["journal"]).expanduser()
        faults += output_faults(journal, f"{name}: journal", any_kind=False)
    return faults


def _unknown_parameters(parameters: Mapping[str, Any], name: str) -> List[str]:
    """Warnings, no faults: a parameter server keeps what earlier launches set."""
    known = [*DEFAULTS, *SETTINGS]
    return [
        f"{name}: {key}: is not a parameter of the sequencer and has no effect; "
        f"expected {expected_name(key, known)}"
        for key in sorted(set(parameters) - set(known))
    ]
