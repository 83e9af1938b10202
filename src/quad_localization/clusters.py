"""Clusters of particles, and the histogram that they come from: a tree of the cells in use.

A cell is 0.5 m by 0.5 m by 10 degrees. The number of cells decides how many particles are drawn.
Cells that touch each other, with their corners too, are a cluster. The tree's shape follows from
the order of the particles, and the clusters' numbers from the tree.

Source: D. Fox, "KLD-Sampling: Adaptive Particle Filters", NIPS 2001.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
Cell = Tuple[int, int, int]

_SIZE, _TURN = 0.5, 10 * math.pi / 180  # of a cell, metres and radians
TURN_CELLS = 36  # of a full turn
_LEAF = -1


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

    labels: Whole
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


class Histogram(NamedTuple):
    """The tree, as columns of its nodes in the order in which they were made.

    Attributes:
        cells: int64[n, 3], of the leaves.
        children: int64[n], the node below the pivot, whose neighbour is not below; -1 for leaves.
        axes: int64[n], which coordinate of a cell is compared with the pivot.
        pivots: float64[n].
        node_count: int64[1].
        turn_cells: Cells of a full turn, 0 if the yaw does not wrap, as in upstream.
    """

    cells: Whole
    children: Whole
    axes: Whole
    pivots: Floats
    node_count: Whole
    turn_cells: int


def new_histogram(most_particles: int, turn_cells: int) -> Histogram:
    """Return an empty histogram for a number of particles."""
    n = 2 * most_particles + 1
    cells, children, axes = np.empty((n, 3), np.int64), np.full(n, _LEAF), np.empty(n, np.int64)
    return Histogram(cells, children, axes, np.empty(n), np.zeros(1, np.int64), turn_cells)


@njit(cache=True, nogil=True)
def cell_count(tree: Histogram) -> int:
    """Return the number of cells that hold a particle: every other node has two below it."""
    return (tree.node_count[0] + 1) // 2


@njit(cache=True, nogil=True)
def _cell_of(tree: Histogram, pose: Floats) -> Cell:
    x, y, turn = pose[0] / _SIZE, pose[1] / _SIZE, pose[2] / _TURN
    return math.floor(x), math.floor(y), _wrapped(tree, math.floor(turn))


@njit(cache=True, nogil=True)
def _wrapped(tree: Histogram, turn: int) -> int:
    return turn % tree.turn_cells if tree.turn_cells > 0 else turn


@njit(cache=True, nogil=True)
def _add_leaf(tree: Histogram, cell: Cell) -> None:
    node = tree.node_count[0]
    tree.cells[node, 0], tree.cells[node, 1], tree.cells[node, 2] = cell
    tree.node_count[0] += 1


@njit(cache=True, nogil=True)
def _descend(tree: Histogram, cell: Cell) -> int:
    """Return the leaf in whose part of space a cell is."""
    node = 0
    while tree.children[node] != _LEAF:
        is_below = cell[tree.axes[node]] < tree.pivots[node]
        node = tree.children[node] + (0 if is_below else 1)
    return node


@njit(cache=True, nogil=True)
def _cell_at(tree: Histogram, node: int) -> Cell:
    return tree.cells[node, 0], tree.cells[node, 1], tree.cells[node, 2]


@njit(cache=True, nogil=True)
def add_pose(tree: Histogram, pose: Floats) -> int:
    """Add a pose float64[3]; return the number of cells."""
    cell = _cell_of(tree, pose)
    if tree.node_count[0] == 0:
        _add_leaf(tree, cell)
        return 1
    node = _descend(tree, cell)
    old = _cell_at(tree, node)
    if cell == old:
        return cell_count(tree)
    axis, widest = 0, 0
    for k in range(3):
        apart = abs(cell[k] - old[k])
        if apart > widest:
            axis, widest = k, apart
    tree.axes[node], tree.pivots[node] = axis, (cell[axis] + old[axis]) / 2.0
    tree.children[node] = tree.node_count[0]
    is_below = cell[axis] < tree.pivots[node]
    _add_leaf(tree, cell if is_below else old)
    _add_leaf(tree, old if is_below else cell)
    return cell_count(tree)


@njit(cache=True, nogil=True)
def add_poses(tree: Histogram, poses: Floats) -> None:
    """Add poses float64[m, 3] in their order."""
    for m in range(len(poses)):
        add_pose(tree, poses[m])


@njit(cache=True, nogil=True)
def _particle_clusters(tree: Histogram, poses: Floats) -> Whole:
    """Return the clusters int64[m] of poses that were added; number them, the last leaf first."""
    nodes, count = tree.node_count[0], 0
    clusters, left = np.full(nodes, -1), np.empty(nodes, np.int64)
    for first in range(nodes - 1, -1, -1):
        if tree.children[first] != _LEAF or clusters[first] >= 0:
            continue
        clusters[first], left[0], waiting = count, first, 1
        while waiting > 0:
            waiting -= 1
            x, y, turn = _cell_at(tree, left[waiting])
            for k in range(27):
                turn_k = _wrapped(tree, turn + k % 3 - 1)
                cell = (x + k // 9 - 1, y + k % 9 // 3 - 1, turn_k)
                other = _descend(tree, cell)
                if clusters[other] < 0 and _cell_at(tree, other) == cell:
                    clusters[other], left[waiting] = count, other
                    waiting += 1
        count += 1
    labels = np.empty(len(poses), np.int64)
    for m in range(len(poses)):
        labels[m] = clusters[_descend(tree, _cell_of(tree, poses[m]))]
    return labels


def cluster_statistics(tree: Histogram, poses: Floats, weights: Floats) -> ClusterStatistics:
    """Compute the statistics of poses float64[n, 3] that were added to a histogram."""
    labels = _particle_clusters(tree, poses)
    each, means, covariances = _moments(labels, poses, weights)
    total, mean, covariance = _moments(np.zeros_like(labels), poses, weights)
    # As in upstream: the weights of all count as normalised, those of a cluster do not.
    with np.errstate(divide="ignore"):
        covariance[0, 2, 2] -= 2 * np.log(total[0])
    return ClusterStatistics(labels, each, means, covariances, mean[0], covariance[0])


def _moments(labels: Whole, poses: Floats, weights: Floats) -> Tuple[Floats, Floats, Floats]:
    """Return weight float64[c], mean float64[c, 3] and covariance float64[c, 3, 3] by label."""
    x, y, yaw = poses.T
    columns = (np.ones_like(x), x, y, np.cos(yaw), np.sin(yaw))
    weight, x_sum, y_sum, cos, sin = (_sums(labels, weights * one) for one in columns)
    squares = [_sums(labels, weights * a * b) for a, b in ((x, x), (x, y), (y, y))]
    with np.errstate(divide="ignore", invalid="ignore"):
        mean_x, mean_y = x_sum / weight, y_sum / weight
        xx, xy, yy = (square / weight for square in squares)
        yaw_variance = -2 * np.log(np.sqrt(cos * cos + sin * sin) / weight)
    covariances = np.zeros((len(weight), 3, 3))
    covariances[:, 0, 0], covariances[:, 1, 1] = xx - mean_x * mean_x, yy - mean_y * mean_y
    covariances[:, 0, 1] = covariances[:, 1, 0] = xy - mean_x * mean_y
    covariances[:, 2, 2] = yaw_variance
    return weight, np.column_stack((mean_x, mean_y, np.arctan2(sin, cos))), covariances


def _sums(labels: Whole, values: Floats) -> Floats:
    """Add values float64[n] up by label, in their order."""
    return np.bincount(labels, values).astype(np.float64)
