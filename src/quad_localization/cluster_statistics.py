"""Weight, mean and covariance of each cluster of particles, and of all."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_localization.histogram import Histogram, particle_clusters

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ClusterStatistics:
    """Statistics of particles, poses in metres and radians; the yaw's are those of directions.

    Attributes:
        labels: int64[n], cluster of each particle.
        weights: float64[c] of each cluster.
        means: float64[c, 3].
        covariances: float64[c, 3, 3], without terms between yaw and the place.
        mean: float64[3] of all particles.
        covariance: float64[3, 3] of all particles.
    """

    labels: NDArray[np.int64]
    weights: Floats
    means: Floats
    covariances: Floats
    mean: Floats
    covariance: Floats

    @property
    def best(self) -> int:
        """The heaviest cluster, -1 if none has a weight."""
        best = int(np.argmax(np.nan_to_num(self.weights, nan=-1.0)))
        return best if self.weights[best] > 0.0 else -1


def cluster_statistics(tree: Histogram, poses: Floats, weights: Floats) -> ClusterStatistics:
    """Compute the statistics of poses float64[n, 3] that were added to a histogram."""
    labels = particle_clusters(tree, poses)
    each, means, covariances = _moments(labels, poses, weights)
    total, mean, covariance = _moments(np.zeros_like(labels), poses, weights)
    # As in upstream: the weights of all count as normalised, those of a cluster do not.
    with np.errstate(divide="ignore"):
        covariance[0, 2, 2] -= 2 * np.log(total[0])
    return ClusterStatistics(labels, each, means, covariances, mean[0], covariance[0])


def _moments(
    labels: NDArray[np.int64], poses: Floats, weights: Floats
) -> Tuple[Floats, Floats, Floats]:
    """Return weight float64[c], mean float64[c, 3] and covariance float64[c, 3, 3] by label."""
    x, y, yaw = poses.T
    columns = (np.ones_like(x), x, y, np.cos(yaw), np.sin(yaw))
    weight, x_sum, y_sum, cos, sin = (np.bincount(labels, weights * one) for one in columns)
    squares = [np.bincount(labels, weights * a * b) for a, b in ((x, x), (x, y), (y, y))]
    with np.errstate(divide="ignore", invalid="ignore"):
        mean_x, mean_y = x_sum / weight, y_sum / weight
        xx, xy, yy = (square / weight for square in squares)
        yaw_variance = -2 * np.log(np.sqrt(cos * cos + sin * sin) / weight)
    covariances = np.zeros((len(weight), 3, 3))
    covariances[:, 0, 0], covariances[:, 1, 1] = xx - mean_x * mean_x, yy - mean_y * mean_y
    covariances[:, 0, 1] = covariances[:, 1, 0] = xy - mean_x * mean_y
    covariances[:, 2, 2] = yaw_variance
    return weight, np.column_stack((mean_x, mean_y, np.arctan2(sin, cos))), covariances
