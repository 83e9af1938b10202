"""Closed loops of a local planner, driven with the recorded poses and velocities."""

from __future__ import annotations

from typing import Any, Iterator, Optional, Tuple

import numpy as np

from families.case import Case, Recorded
from families.frames import inverted, yaw_of_inverse
from quad_nav.control.controller import Control, LocalPlanner
from quad_nav.errors import ControlError
from quad_nav.geometry import Pose2D, Pose3D, Twist2D
from quad_nav.grid import GridSpec


def period_s(meta: Recorded) -> float:
    return 1.0 / meta["controller_frequency"] if meta["controller_frequency"] else 0.05


def spec_at(meta: Recorded, origin: Any) -> GridSpec:
    return GridSpec(meta["size_x"], meta["size_y"], meta["resolution"], *origin)


def plan_of(rows: np.ndarray) -> np.ndarray:
    """Recorded plans have half a quaternion, ours a yaw."""
    return np.column_stack((rows[:, :2], 2.0 * np.arctan2(rows[:, 2], rows[:, 3])))


def replayed(planner: LocalPlanner, case: Case) -> Iterator[Tuple[int, Optional[Control]]]:
    """(number, outcome) of each call; None when the planner found no command."""
    recorded, meta = case.arrays, case.meta
    local_from_plan = _local_from_plan(meta)
    plans = {int(step): recorded[f"plan_{j}"] for j, step in enumerate(recorded["plan_set_step"])}
    for k in range(len(recorded["pose"])):
        if k in plans:
            planner.set_plan(plan_of(plans[k]))
        ox, oy = recorded["window_offset"][k]
        world = recorded["world"][recorded["world_index"][k]]
        costs = world[oy : oy + meta["size_y"], ox : ox + meta["size_x"]]
        try:
            yield (
                k,
                planner.compute_velocity(
                    spec_at(meta, recorded["origin"][k]),
                    costs,
                    Pose2D(*recorded["pose"][k]),
                    Twist2D(*recorded["velocity"][k]),
                    local_from_plan,
                ),
            )
        except ControlError:
            yield k, None


def _local_from_plan(meta: Recorded) -> Pose2D:
    """The inverse of the recorded frame's pose, to the last bit as tf2 computes it.

    The plan's points lie on cell borders, so the last bit decides about their cells.
    """
    frame = meta.get("map_to_costmap_frame")  # pose of the costmap frame in the map frame
    if frame is None:
        return Pose2D(0.0, 0.0, 0.0)
    pose = Pose3D(frame["x"], frame["y"], 0.0, tuple(frame["quaternion_xyzw"]))
    inverse = inverted(pose)
    return Pose2D(inverse.x_m, inverse.y_m, yaw_of_inverse(pose))
