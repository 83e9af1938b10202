"""amcl, whole runs in the order of the node."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, List

import numpy as np

from families.amcl import TOLERANCE, map_of, pose_of, relative, scan_of, upstream_params
from families.case import Arrays, Case, load_case
from families.comparison import Comparison, Difference
from quad_localization import Amcl, Observation, PoseEstimate, Update
from quad_localization.scan_beams import beams_of, tilted_yaw
from quad_nav.geometry import Pose2D, Pose3D

_NOTHING = Update()


def check(path: Path) -> List[Difference]:
    case, comparison = load_case(path), Comparison()
    meta = case.meta
    params = upstream_params(meta["params"])
    amcl = Amcl(params, seed=0)
    initial = _initial(meta["params"])
    first = 0
    for event in meta["events"]:
        if event["type"] == "map":
            amcl.set_map(map_of(case.arrays, meta), initial)
        elif event["type"] == "initialpose":
            amcl.set_pose(_given(case.arrays, event))
            if params.force_update_after_initialpose:
                amcl.is_update_requested = True
        elif event["type"] == "global_localization":
            amcl.set_uniform()
        elif event["type"] == "request_nomotion_update":
            amcl.is_update_requested = True
        elif event["type"] == "srand48":
            amcl.seed(event["seed"])
        else:
            first = _check_scan(case, comparison, amcl, event, first)
    return comparison.differences


def _initial(params: Dict[str, Any]) -> PoseEstimate:
    pose = Pose2D(*(params[f"initial_pose_{one}"] for one in "xya"))
    return PoseEstimate(pose, np.diag([params[f"initial_cov_{one}"] for one in ("xx", "yy", "aa")]))


def _given(arrays: Arrays, event: Dict[str, Any]) -> PoseEstimate:
    pose = pose_of(event["pose"])
    if event["odom_change"] is not None:
        pose = pose.compose(pose_of(event["odom_change"]))
    matrix = arrays["initialpose_covariance"][event["index"]].reshape(6, 6)
    covariance = np.zeros((3, 3))
    covariance[:2, :2], covariance[2, 2] = matrix[:2, :2], matrix[5, 5]
    return PoseEstimate(Pose2D(pose.x_m, pose.y_m, tilted_yaw(pose.quaternion)), covariance)


def _check_scan(
    case: Case, comparison: Comparison, amcl: Amcl, event: Dict[str, Any], first: int
) -> int:
    """Compare one step; return where the particles of the next one begin."""
    arrays, k, params = case.arrays, event["index"], amcl.params
    scan = scan_of(case.meta, arrays["ranges"][k])
    mount = pose_of(case.meta["lasers"][event["laser"]]["pose"])
    beams = beams_of(scan, mount, params.laser_min_range_m, params.laser_max_range_m)
    bearings_rad = arrays["bearings"][event["laser"]]
    comparison.near(f"bearings[{k}]", beams.bearings_rad, bearings_rad, TOLERANCE)
    odometry = pose_of(arrays["odom_transform"][k].tolist())
    planar = (odometry.x_m, odometry.y_m, tilted_yaw(odometry.quaternion))
    comparison.near(f"odom[{k}]", planar, arrays["odom"][k], TOLERANCE)
    seen = Observation(str(event["laser"]), scan, mount, odometry)
    update = amcl.update(seen) or _NOTHING
    _check_update(arrays, comparison, k, amcl, update)
    return _check_state(arrays, comparison, k, amcl, first)


def _check_update(
    arrays: Arrays, comparison: Comparison, k: int, amcl: Amcl, update: Update
) -> None:
    found = amcl.map_from_odom if update is not _NOTHING else None
    sends = amcl.params.tf_broadcast and found is not None
    for name, happened in (
        ("action", update.is_moved),
        ("updated", update.is_weighed),
        ("resampled", update.is_resampled),
        ("pose_published", update.estimate is not None),
        ("cloud_published", update.shows_cloud),
        ("tf_broadcast", sends),
    ):
        comparison.exact(f"{name}[{k}]", happened, arrays[name][k] != 0)
    pose, covariance = np.full(3, np.nan), np.full(36, np.nan)
    if update.estimate is not None:
        estimate = update.estimate
        pose = np.array((estimate.pose.x_m, estimate.pose.y_m, estimate.pose.yaw_rad))
        matrix = np.zeros((6, 6))
        matrix[:2, :2] = estimate.covariance[:2, :2]
        matrix[5, 5] = estimate.covariance[2, 2]
        covariance = matrix.ravel()
    comparison.near(f"pose[{k}]", pose, arrays["pose"][k], TOLERANCE)
    comparison.near(f"covariance[{k}]", covariance, arrays["covariance"][k], TOLERANCE)
    transform = np.full(7, np.nan)
    if found is not None:
        transform = _row(found)
    recorded = arrays["map_to_odom"][k].copy()
    recorded[3:] *= -1.0 if transform[3:] @ recorded[3:] < 0.0 else 1.0
    comparison.near(f"map_to_odom[{k}]", transform, recorded, TOLERANCE)


def _row(pose: Pose3D) -> np.ndarray:
    return np.array((pose.x_m, pose.y_m, pose.z_m, *pose.quaternion))


def _check_state(arrays: Arrays, comparison: Comparison, k: int, amcl: Amcl, first: int) -> int:
    particles = amcl.particles
    assert particles is not None
    count = len(particles.weights)
    comparison.exact(f"particle_count[{k}]", count, arrays["particle_count"][k])
    end = first + int(arrays["particle_count"][k])
    comparison.near(f"particles[{k}]", particles.poses, arrays["particles"][first:end], TOLERANCE)
    comparison.near(f"weights[{k}]", particles.weights, arrays["weights"][first:end], TOLERANCE)
    statistics = particles.statistics
    comparison.exact(f"cluster_count[{k}]", len(statistics.weights), arrays["cluster_count"][k])
    if arrays["pose_published"][k]:
        comparison.exact(f"best_cluster[{k}]", statistics.best, arrays["best_cluster"][k])
    comparison.exact(f"converged[{k}]", particles.is_converged, arrays["converged"][k] != 0)
    comparison.exact(f"force_update[{k}]", amcl.is_update_requested, arrays["force_update"][k] != 0)
    comparison.exact(f"resample_count[{k}]", amcl.update_count, arrays["resample_count"][k])
    for name in ("w_slow", "w_fast", "n_effective"):
        relative(comparison, f"{name}[{k}]", getattr(particles, name), arrays[name][k])
    return end
