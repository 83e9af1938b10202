"""Course and workers of ``quad tune`` and ``quad sweep``, from their options."""

from __future__ import annotations

from itertools import zip_longest
from pathlib import Path
from typing import Any, Optional, Sequence, Tuple

from quad_nav.cli import add_ons
from quad_nav.cli.options import parameter
from quad_nav.errors import InputError
from quad_nav.files.shipped import shipped
from quad_nav.offline.workers import LocalWorkers, RayWorkers, Workers
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.simulation_params import SimulationParams
from quad_tune.courses import CourseOptions, Mission, MissionOptions


def course_of(
    scenes: Tuple[Path, ...],
    goals: Tuple[Path, ...],
    is_random: bool,
    worlds: Optional[Path],
    config: Optional[str],
    parameters: Tuple[str, ...],
    seed: int,
    body_radius_m: float,
    held_out: Tuple[Mission, ...] = (),
    **given: Any,
) -> CourseOptions:
    """Convert the options to a course, without reading its files.

    Raises:
        InputError: The options cannot be combined.
    """
    fixed = tuple(map(parameter, parameters))
    if worlds is not None:
        if scenes or goals or is_random or held_out or given["robots"]:
            raise InputError(
                [
                    "--worlds: cannot be combined with --scene, --goals, --random, --robots and "
                    "held-out missions"
                ]
            )
        barn_course = add_ons.load("quad_tune.barn_course", "--worlds")
        options: CourseOptions = barn_course.BarnCourseOptions(
            worlds, config or "barn", fixed, seed=seed, body_radius_m=body_radius_m
        )
        return options
    missions = missions_of(scenes, goals, "")
    if is_random:
        missions += (Mission(),)
    elif not missions:
        missions = (Mission(None, shipped("goals")),)
    return _mission_options(missions, held_out, config or "default", fixed, seed, **given)


def missions_of(scenes: Sequence[Path], goals: Sequence[Path], prefix: str) -> Tuple[Mission, ...]:
    """Pair scenes and goals; a single one is paired with the shipped counterpart.

    Raises:
        InputError: The numbers of scenes and goals differ.
    """
    if len(scenes) != len(goals) and min(len(scenes), len(goals)) > 0:
        raise InputError(
            [
                f"--{prefix}scene, --{prefix}goals: {len(scenes)} scenes and {len(goals)} "
                "folders of goals; expected a folder of goals for each scene"
            ]
        )
    return tuple(
        Mission(scene, folder or shipped("goals")) for scene, folder in zip_longest(scenes, goals)
    )


def workers_of(workers: Optional[int], ray_address: Optional[str]) -> Workers:
    """Create the workers.

    Raises:
        InputError: The Ray cluster does not exist.
    """
    return LocalWorkers(workers) if ray_address is None else RayWorkers(ray_address, workers)


def _mission_options(
    missions: Tuple[Mission, ...],
    held_out: Tuple[Mission, ...],
    config: str,
    fixed: Tuple[Tuple[str, Any], ...],
    seed: int,
    scan_range: float,
    beams: int,
    range_noise: float,
    jitter: float,
    **given: Any,
) -> MissionOptions:
    lidar = LidarParams(scan_range, scan_range / beams, noise_std_m=range_noise)
    return MissionOptions(
        missions,
        held_out,
        config,
        fixed,
        seed=seed,
        **given,
        simulation=SimulationParams(lidar, jitter_m=jitter),
    )
