"""amcl, part by part: likelihood field, laser models, odometry models, particle filter."""

from __future__ import annotations

from pathlib import Path
from typing import Any, List, Mapping

import numpy as np

from families.case import Arrays, Case, Recorded, load_case
from families.comparison import Comparison, Difference
from quad_localization.clusters import add_poses, cell_count
from quad_localization.covariance_axes import covariance_axes
from quad_localization.laser import Laser
from quad_localization.occupancy_map import (
    OccupancyMap,
    cell_of,
    is_inside,
    obstacle_distances,
    ray_range,
)
from quad_localization.odometry_models import angle_difference, moved
from quad_localization.parameters import AmclParams, read_params
from quad_localization.particle_filter import ParticleFilter, are_near, resample_limit
from quad_localization.random_numbers import State, seeded, uniform
from quad_localization.scan_beams import beams_of
from quad_nav.geometry import Pose3D, Scan

TOLERANCE = 1e-9


def upstream_params(params: Mapping[str, Any]) -> AmclParams:
    read, faults = read_params({**params, "upstream": True})
    assert not faults, faults
    return read


def map_of(arrays: Arrays, meta: Recorded) -> OccupancyMap:
    return OccupancyMap.from_occupancy(
        arrays["occupancy"], meta["resolution"], *meta["origin"], upstream=True
    )


def scan_of(meta: Recorded, ranges_m: np.ndarray) -> Scan:
    scan = meta["scan"]
    return Scan(
        0.0,
        scan["angle_min"],
        scan["angle_increment"],
        scan["range_min"],
        scan["range_max"],
        ranges_m,
    )


def pose_of(row: List[float]) -> Pose3D:
    return Pose3D(*row[:3], tuple(row[3:]))


def check_field(path: Path) -> List[Difference]:
    case, comparison = load_case(path), Comparison()
    arrays, meta = case.arrays, case.meta
    grid = map_of(arrays, meta)
    frame = grid.frame
    comparison.exact("map_origin", [frame.centre_x, frame.centre_y], meta["map_origin"])
    comparison.exact("occ_state", grid.states, arrays["occ_state"])
    distances = obstacle_distances(grid, meta["params"]["laser_likelihood_max_dist"])
    comparison.exact("occ_dist", distances, arrays["occ_dist"])
    cells = [cell_of(frame, x, y) for x, y in arrays["points"].tolist()]
    comparison.exact("cells", np.array(cells), arrays["cells"].astype(np.float64))
    inside = [is_inside(frame, *cell) for cell in cells]
    comparison.exact("cells_valid", inside, arrays["cells_valid"] != 0)
    ranges_m = [ray_range(grid.states, frame, *ray) for ray in arrays["rays"].tolist()]
    comparison.exact("ray_ranges", ranges_m, arrays["ray_ranges"])
    return comparison.differences


def check_sensor(path: Path) -> List[Difference]:
    case, comparison = load_case(path), Comparison()
    arrays, meta = case.arrays, case.meta
    params, grid, mount = upstream_params(meta["params"]), map_of(arrays, meta), meta["laser_pose"]
    distances_m = obstacle_distances(grid, params.laser_likelihood_max_dist_m)
    laser = Laser(params, grid, distances_m, tuple(mount[:2]))
    particles = ParticleFilter(params, grid.free_places, seeded(0))
    for k, call in enumerate(meta["calls"]):
        scan = scan_of(meta, arrays[f"scan_{k:03}"])
        beams = beams_of(scan, pose_of(mount), params.laser_min_range_m, params.laser_max_range_m)
        comparison.exact(f"accepted[{k}]", beams is not None, call["accepted"])
        if beams is None:
            continue
        comparison.exact(f"range_max[{k}]", beams.range_max_m, call["range_max"])
        both = np.column_stack((beams.ranges_m, beams.bearings_rad))
        comparison.exact(f"ranges_{k:03}", both, arrays[f"ranges_{k:03}"])
        particles.poses = arrays[f"particles_{k:03}"].copy()
        particles.weights = arrays[f"weights_in_{k:03}"].copy()
        particles.is_converged = bool(call["converged"])
        particles.w_slow, particles.w_fast = call["w_slow_before"], call["w_fast_before"]
        particles.n_effective = 0.0
        factors = laser.factors(particles.poses, particles.is_converged, beams)
        comparison.exact(f"updated[{k}]", factors is not None, call["updated"])
        raw = np.full(len(particles.weights), np.nan)
        if factors is not None:
            raw = particles.weights * factors
            relative(comparison, f"total[{k}]", raw.sum(), arrays["total"][k])
            particles.weigh(factors)
        relative(comparison, f"weights_raw_{k:03}", raw, arrays[f"weights_raw_{k:03}"])
        relative(comparison, f"weights_{k:03}", particles.weights, arrays[f"weights_{k:03}"])
        for name in ("w_slow", "w_fast", "n_effective"):
            relative(comparison, f"{name}[{k}]", getattr(particles, name), arrays[name][k])
    return comparison.differences


def relative(comparison: Comparison, field: str, found: Any, recorded: Any) -> None:
    """Compare numbers that may be apart by 1e-9 of the recorded ones."""
    found, recorded = np.asarray(found, np.float64), np.asarray(recorded, np.float64)
    scale = np.where(np.isfinite(recorded) & (recorded != 0.0), np.abs(recorded), 1.0)
    comparison.near(field, found / scale, recorded / scale, TOLERANCE)


def check_motion(path: Path) -> List[Difference]:
    case, comparison = load_case(path), Comparison()
    arrays, meta = case.arrays, case.meta
    params, state = upstream_params(meta["params"]), seeded(meta["seed"])
    pose, old = arrays["pose"], arrays["old_pose"]
    turn_rad = float(angle_difference(pose[2], old[2]))
    delta = (*(pose - old)[:2].tolist(), turn_rad)
    comparison.near("delta", delta, arrays["delta"], TOLERANCE)
    delta = tuple(arrays["delta"].tolist())
    poses = moved(params, arrays["particles_in"], old[2], delta, state)
    comparison.near("particles_out", poses, arrays["particles_out"], TOLERANCE)
    comparison.exact("next_drand48", uniform(state), meta["next_drand48"])
    return comparison.differences


def check_filter(path: Path) -> List[Difference]:
    case, comparison = load_case(path), Comparison()
    mode = case.meta["mode"]
    if mode == "converged":
        thresholds = case.arrays["dist_threshold"].tolist()
        found = [are_near(*pair) for pair in zip(case.arrays["particles"], thresholds)]
        comparison.exact("converged", found, case.arrays["converged"] != 0)
    elif mode == "update_sensor":
        _check_weights(case, comparison)
    else:
        _check_set(case, comparison)
    return comparison.differences


def _check_weights(case: Case, comparison: Comparison) -> None:
    arrays, params = case.arrays, upstream_params(case.meta["params"])
    particles = ParticleFilter(params, np.empty((0, 2)), seeded(0))
    particles.weights = arrays["weights_in"].copy()
    for k, likelihoods in enumerate(arrays["likelihoods"]):
        total = float((particles.weights * likelihoods).sum())
        relative(comparison, f"total[{k}]", total, arrays["total"][k])
        particles.weigh(likelihoods)
        for name in ("weights", "w_slow", "w_fast", "n_effective"):
            relative(comparison, f"{name}[{k}]", getattr(particles, name), arrays[name][k])


def _check_set(case: Case, comparison: Comparison) -> None:
    arrays, meta = case.arrays, case.meta
    params = upstream_params(meta["params"])
    places = map_of(arrays, meta).free_places if "occupancy" in arrays else np.empty((0, 2))
    state = seeded(meta["pf_init_call"] if meta["mode"] == "init" else meta.get("seed", 0))
    particles = ParticleFilter(params, places, state)
    _MODES[meta["mode"]](case, comparison, particles, state)
    if meta["mode"] != "cluster":
        comparison.exact("next_drand48", uniform(state), meta["next_drand48"])
    comparison.near("particles", particles.poses, arrays["particles"], TOLERANCE)
    relative(comparison, "weights", particles.weights, arrays["weights"])
    statistics, after = particles.statistics, meta["after"]
    comparison.exact("labels", statistics.labels, arrays["labels"])
    counts = np.bincount(statistics.labels)
    comparison.exact("cluster_counts", counts, arrays["cluster_counts"])
    comparison.exact("cluster_count", len(statistics.weights), after["cluster_count"])
    for name, found in (
        ("cluster_weights", statistics.weights),
        ("cluster_means", statistics.means),
        ("cluster_covs", statistics.covariances),
        ("mean", statistics.mean),
        ("cov", statistics.covariance),
    ):
        comparison.near(name, found, arrays[name], TOLERANCE)
    comparison.exact("converged", particles.is_converged, after["converged"] != 0)
    comparison.near("w_slow", particles.w_slow, after["w_slow"], TOLERANCE)
    comparison.near("w_fast", particles.w_fast, after["w_fast"], TOLERANCE)
    tree = particles.new_histogram(len(particles.poses))
    add_poses(tree, particles.poses)
    comparison.exact("n_histogram_cells", cell_count(tree), after["n_histogram_cells"])


def _init(case: Case, comparison: Comparison, particles: ParticleFilter, _: State) -> None:
    arrays = case.arrays
    axes, variances = covariance_axes(arrays["init_cov"])
    comparison.near("rotation", axes, arrays["rotation"], TOLERANCE)
    deviations = np.sqrt(np.maximum(variances, 0.0))
    comparison.near("stddev", deviations, arrays["stddev"], TOLERANCE)
    particles.spread_normally(arrays["init_mean"], arrays["init_cov"])


def _resample(case: Case, comparison: Comparison, particles: ParticleFilter, _: State) -> None:
    arrays, meta, params = case.arrays, case.meta, particles.params
    kld = (params.min_particles, params.max_particles, params.kld_err, params.kld_z)
    limits = [resample_limit(k, kld) for k in range(1, 61)]
    comparison.exact("resample_limits", limits, arrays["resample_limits"])
    particles.poses, particles.weights = arrays["particles_in"].copy(), arrays["weights_in"].copy()
    particles.w_slow, particles.w_fast = meta["w_slow"], meta["w_fast"]
    particles.n_effective, particles.is_converged = meta["n_effective"], bool(meta["converged"])
    particles.resample()


def _cluster(case: Case, _: Comparison, particles: ParticleFilter, __: State) -> None:
    particles.poses = case.arrays["particles"].copy()
    particles.weights = case.arrays["weights"].copy()
    particles.update_statistics()


_MODES = {
    "init": _init,
    "init_model": lambda case, comparison, particles, state: particles.spread_uniformly(),
    "resample": _resample,
    "cluster": _cluster,
}
