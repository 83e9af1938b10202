"""Histogram of particles: a tree of the cells that hold any, and the clusters of these.

A cell is 0.5 m by 0.5 m by 10 degrees. The number of cells decides how many particles are drawn.
Cells that touch each other, with their corners too, are a cluster. The tree's shape follows from
the order of the particles, and the clusters' numbers from the tree.

Source: D. Fox, "KLD-Sampling: Adaptive Particle Filters", NIPS 2001.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]

_SIZE, _TURN = 0.5, 10 * math.pi / 180  # of a cell, metres and radians
TURN_CELLS = 36  # of a full turn
_NODES, _LEAVES = 0, 1
_LEAF = -1


class Histogram(NamedTuple):
    """The tree, as columns of its nodes in the order in which they were made.

    Attributes:
        cells: int64[n, 3], of the leaves.
        children: int64[n, 2], nodes below and not below the pivot; -1 for leaves.
        axes: int64[n], which coordinate of a cell is compared with the pivot.
        pivots: float64[n].
        clusters: int64[n], clusters of the leaves.
        counts: int64[2], number of nodes and of leaves.
        turn_cells: Cells of a full turn, 0 if the yaw does not wrap, as in upstream.
    """

    cells: Whole
    children: Whole
    axes: Whole
    pivots: Floats
    clusters: Whole
    counts: Whole
    turn_cells: int


def new_histogram(most_particles: int, turn_cells: int) -> Histogram:
    """Return an empty histogram for a number of particles."""
    n = 2 * most_particles + 1
    return Histogram(
        np.empty((n, 3), np.int64),
        np.empty((n, 2), np.int64),
        np.empty(n, np.int64),
        np.empty(n),
        np.full(n, -1),
        np.zeros(2, np.int64),
        turn_cells,
    )


@njit(cache=True, nogil=True)
def _cell_of(tree: Histogram, pose: Floats, cell: Whole) -> None:
    """Write the cell of a pose."""
    cell[0] = math.floor(pose[0] / _SIZE)
    cell[1] = math.floor(pose[1] / _SIZE)
    cell[2] = math.floor(pose[2] / _TURN)
    if tree.turn_cells > 0:
        cell[2] %= tree.turn_cells


@njit(cache=True, nogil=True)
def _add_leaf(tree: Histogram, cell: Whole) -> int:
    node = tree.counts[_NODES]
    tree.cells[node] = cell
    tree.children[node] = _LEAF
    tree.counts[_NODES] += 1
    tree.counts[_LEAVES] += 1
    return node


@njit(cache=True, nogil=True)
def _descend(tree: Histogram, cell: Whole) -> int:
    """Return the leaf in whose part of space a cell is."""
    node = 0
    while tree.children[node, 0] != _LEAF:
        is_right = not cell[tree.axes[node]] < tree.pivots[node]
        node = tree.children[node, int(is_right)]
    return node


@njit(cache=True, nogil=True)
def _is_same(tree: Histogram, node: int, cell: Whole) -> bool:
    at = tree.cells[node]
    return at[0] == cell[0] and at[1] == cell[1] and at[2] == cell[2]


@njit(cache=True, nogil=True)
def add_pose(tree: Histogram, pose: Floats) -> int:
    """Add a pose float64[3]; return the number of cells."""
    cell = np.empty(3, np.int64)
    _cell_of(tree, pose, cell)
    if tree.counts[_NODES] == 0:
        _add_leaf(tree, cell)
        return 1
    node = _descend(tree, cell)
    if _is_same(tree, node, cell):
        return tree.counts[_LEAVES]
    old = tree.cells[node].copy()
    axis, widest = 0, 0
    for k in range(3):
        apart = abs(cell[k] - old[k])
        if apart > widest:
            axis, widest = k, apart
    pivot = (cell[axis] + old[axis]) / 2.0
    tree.axes[node], tree.pivots[node] = axis, pivot
    is_below = cell[axis] < pivot
    left = _add_leaf(tree, cell if is_below else old)
    right = _add_leaf(tree, old if is_below else cell)
    tree.children[node, 0], tree.children[node, 1] = left, right
    tree.counts[_LEAVES] -= 1
    return tree.counts[_LEAVES]


@njit(cache=True, nogil=True)
def add_poses(tree: Histogram, poses: Floats) -> None:
    """Add poses float64[m, 3] in their order."""
    for m in range(len(poses)):
        add_pose(tree, poses[m])


@njit(cache=True, nogil=True)
def particle_clusters(tree: Histogram, poses: Floats) -> Whole:
    """Return the clusters int64[m] of poses that were added; number them, the last leaf first."""
    nodes, clusters = tree.counts[_NODES], 0
    left, cell = np.empty(nodes, np.int64), np.empty(3, np.int64)
    for first in range(nodes - 1, -1, -1):
        if tree.children[first, 0] != _LEAF or tree.clusters[first] >= 0:
            continue
        tree.clusters[first] = clusters
        left[0], count = first, 1
        while count > 0:
            count -= 1
            node = left[count]
            for k in range(27):
                cell[0] = tree.cells[node, 0] + k // 9 - 1
                cell[1] = tree.cells[node, 1] + k % 9 // 3 - 1
                cell[2] = tree.cells[node, 2] + k % 3 - 1
                if tree.turn_cells > 0:
                    cell[2] %= tree.turn_cells
                other = _descend(tree, cell)
                if tree.clusters[other] < 0 and _is_same(tree, other, cell):
                    tree.clusters[other] = clusters
                    left[count] = other
                    count += 1
        clusters += 1
    labels = np.empty(len(poses), np.int64)
    for m in range(len(poses)):
        _cell_of(tree, poses[m], cell)
        labels[m] = tree.clusters[_descend(tree, cell)]
    return labels
