"""Particle filter: initialise, weigh and resample a set of particles.

Source: S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005, chapter 8: "Augmented_MCL" and
"KLD_Sampling_MCL"; in the order of ros-planning/navigation, amcl 1.17.3.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_localization.clusters import (
    TURN_CELLS,
    ClusterStatistics,
    Histogram,
    add_pose,
    add_poses,
    cluster_statistics,
    new_histogram,
)
from quad_localization.covariance_axes import covariance_axes
from quad_localization.parameters import AmclParams
from quad_localization.random_numbers import State, normals, uniform
from quad_nav.files.kernel_cache import njit

Floats = NDArray[np.float64]

_CONVERGED_M = 0.5  # from the mean in x and y


class ParticleFilter:
    """A set of particles.

    Attributes:
        params: Parameters; they may change.
        free_places: float64[n, 2], where random poses are.
        poses: float64[m, 3], x, y in metres and yaw in radians, not normalised.
        weights: float64[m].
        statistics: Clusters, of the last initialisation or resampling.
        n_effective: Effective number of particles when they were weighed last. As in upstream, two
            sets take turns: right after resampling it is that of the set before.
        is_converged: Whether all particles were near their mean after the last resampling.
        w_slow: Slow average of the weights, 0 if there is none.
        w_fast: Fast average of them.
    """

    def __init__(self, params: AmclParams, free_places: Floats, state: State) -> None:
        """Make a filter without particles; ``state`` is that of the random numbers."""
        self.params, self.free_places, self._state = params, free_places, state
        self.poses, self.weights = np.empty((0, 3)), np.empty(0)
        self.statistics: ClusterStatistics
        self.n_effective = self._other_n_effective = 0.0
        self.is_converged = False
        self.w_slow = self.w_fast = 0.0

    def spread_normally(self, mean: Floats, covariance: Floats) -> None:
        """Draw particles about a pose float64[3] with a covariance float64[3, 3]."""
        axes, variances = covariance_axes(covariance)
        deviations = np.sqrt(np.maximum(variances, 0.0))  # rounding makes some of them negative
        drawn = normals(self._state, 3 * max(self.params.max_particles, 1)).reshape(-1, 3)
        self._begin(mean + (drawn * deviations) @ axes.T)

    def spread_uniformly(self) -> None:
        """Draw particles all over the free cells."""
        poses = np.empty((max(self.params.max_particles, 1), 3))
        draw_poses(poses, self.free_places, self._state)
        self._begin(poses)

    def _begin(self, poses: Floats) -> None:
        self.poses, self.weights = poses, np.full(len(poses), 1.0 / len(poses))
        self.w_slow = self.w_fast = 0.0
        self.is_converged = False
        self.update_statistics()

    def update_statistics(self) -> None:
        """Compute the statistics of the particles."""
        tree = self.new_histogram(len(self.poses))
        add_poses(tree, self.poses)
        self.statistics = cluster_statistics(tree, self.poses, self.weights)

    def new_histogram(self, most_particles: int) -> Histogram:
        """Return an empty histogram."""
        return new_histogram(most_particles, 0 if self.params.upstream else TURN_CELLS)

    def weigh(self, factors: Floats) -> None:
        """Multiply the weights by factors float64[m], and update their averages.

        If nothing explains the scan, all weights become equal and the averages stay.
        """
        self.weights = self.weights * factors
        total, count = float(self.weights.sum()), len(self.weights)
        if not total > 0.0:  # or NaN
            self.weights, self.n_effective = np.full(count, 1.0 / count), math.inf
            return
        mean, params = total / count, self.params
        self.weights /= total
        self.n_effective = 1.0 / float(self.weights @ self.weights)
        self.w_slow += (params.recovery_alpha_slow if self.w_slow else 1.0) * (mean - self.w_slow)
        self.w_fast += (params.recovery_alpha_fast if self.w_fast else 1.0) * (mean - self.w_fast)

    def resample(self) -> None:
        """Draw a new set by weights, with random poses where the weights have dropped."""
        params, is_enough = self.params, self.n_effective > 0.5 * len(self.poses)
        self.n_effective, self._other_n_effective = self._other_n_effective, self.n_effective
        if params.selective_resampling and is_enough:
            self.weights = self.weights / self.weights.sum()
            self.update_statistics()
            return
        share = max(1.0 - self.w_fast / self.w_slow, 0.0) if self.w_slow else 0.0
        if not len(self.free_places):
            share = 0.0
        tree = self.new_histogram(max(params.max_particles, 1))
        kld = (params.min_particles, params.max_particles, params.kld_err, params.kld_z)
        sums = np.cumsum(self.weights)
        places, state = self.free_places, self._state
        self.poses = _draw_by_weight(self.poses, sums, share, places, kld, tree, state)
        self.weights = np.full(len(self.poses), 1.0 / len(self.poses))
        if share > 0.0:  # else the poses become more and more random
            self.w_slow = self.w_fast = 0.0
        self.statistics = cluster_statistics(tree, self.poses, self.weights)
        self.is_converged = are_near(self.poses, _CONVERGED_M)


def are_near(poses: Floats, distance_m: float) -> bool:
    """Tell whether poses are within a distance of their mean in x and in y."""
    mean = np.cumsum(poses[:, :2], axis=0)[-1] / len(poses)  # adds in the order of the poses
    return bool(np.all(np.abs(poses[:, :2] - mean) <= distance_m))


@njit(cache=True, nogil=True)
def draw_poses(poses: Floats, places: Floats, state: State) -> None:
    """Draw poses float64[m, 3] in the centres of free cells."""
    for m in range(len(poses)):
        place = places[int(uniform(state) * len(places))]
        poses[m, 0], poses[m, 1] = place[0], place[1]
        poses[m, 2] = uniform(state) * 2 * math.pi - math.pi


@njit(cache=True, nogil=True, error_model="numpy")
def resample_limit(cells: int, kld: Tuple[int, int, float, float]) -> int:
    """Return how many particles a number of histogram cells needs, by KLD sampling.

    ``kld`` has fewest and most particles, largest error of the distribution and normal quantile.
    """
    least, most, error, quantile = kld
    if cells <= 1 or cells > most:
        return most
    b = 2 / (9 * (cells - 1.0))
    x = 1 - b + math.sqrt(b) * quantile
    limit = np.ceil((cells - 1) / (2 * error) * x * x * x)
    if limit < least:
        return least
    return int(limit) if limit <= most else most


@njit(cache=True, nogil=True)
def _draw_by_weight(
    poses: Floats,
    sums: Floats,
    random_share: float,
    places: Floats,
    kld: Tuple[int, int, float, float],
    tree: Histogram,
    state: State,
) -> Floats:
    """Draw poses by the sums float64[m] of their weights, until KLD sampling has enough.

    A share of them is random. The tree, which is empty before, holds what is drawn.
    """
    most = max(kld[1], 1)
    drawn = np.empty((most, 3))
    for count in range(1, most + 1):
        if uniform(state) < random_share:
            draw_poses(drawn[count - 1 : count], places, state)
        else:
            chosen = np.searchsorted(sums, uniform(state), side="right")
            drawn[count - 1] = poses[min(chosen, len(poses) - 1)]  # rounding: the sum is below 1
        if count > resample_limit(add_pose(tree, drawn[count - 1]), kld):
            break
    return drawn[:count].copy()
