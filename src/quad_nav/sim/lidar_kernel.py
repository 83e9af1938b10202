"""Ranges of planar LIDARs among solids and over the floor.

Two methods find what a beam hits and give the same ranges. A solid of ``Solids`` is projected:
its sector says which beams can hit it, and only those are tried. That is the fastest for some
hundreds of solids. The solids of a ``SolidGrid`` lie in square columns, and each beam walks from
column to column until it hits something. That is the fastest for thousands.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit
from quad_nav.sim.rays import Triple, enter_solid, through_slab, triple, turn
from quad_nav.sim.sectors import Axes, columns_of, rough_sectors, sector_around

_ROUNDING = 1e-6  # of a beam's number
_RING_M, _RINGS = 1.0, 64  # rings around a LIDAR; the last one has no outer limit


class Solids(NamedTuple):
    """Solids: kinds and sizes as in ``rays``, positions in ``map``, metres."""

    kinds: NDArray[Any]
    """int64[s]"""
    centres: NDArray[Any]
    """float64[s, 3]"""
    rotations: NDArray[Any]
    """float64[s, 3, 3], the solids' axes in ``map`` as rows"""
    sizes: NDArray[Any]
    """float64[s, 3]"""


class SolidGrid(NamedTuple):
    """Solids at rest, sorted into square columns of ``cell_m``.

    Column (x, y), counted from ``low``, holds the solids
    ``members[starts[y, x]:starts[y, x + 1]]``.
    """

    solids: Solids
    low: NDArray[np.float64]
    """float64[3], lower corner of all that the grid holds"""
    high: NDArray[np.float64]
    """float64[3], upper corner"""
    cell_m: float
    starts: NDArray[np.int32]
    """int32[rows, columns + 1]"""
    members: NDArray[np.int32]
    """int32[k], numbers of solids"""


class Beams(NamedTuple):
    """Beams of a LIDAR; beam k is at ``first_rad + k * step_rad`` in its plane."""

    directions: NDArray[np.float64]
    """float64[m, 2], cosines and sines of the beams"""
    first_rad: float
    step_rad: float
    near_m: float
    """where beams begin: a beam does not see a solid that holds this point of it"""
    far_m: float


@njit(cache=True, nogil=True)
def cast_scans(
    origins: NDArray[np.float64],
    rotations: NDArray[np.float64],
    beams: Beams,
    solids: Solids,
    grid: SolidGrid,
    ranges: NDArray[np.float64],
) -> None:
    """Compute the ranges of LIDARs. The floor is z = 0.

    Args:
        origins: float64[n, 3], positions of the LIDARs in ``map``, metres.
        rotations: float64[n, 3, 3], axes of the LIDARs in ``map`` as columns.
        beams: Beams of each LIDAR.
        solids: Solids to project.
        grid: Solids to walk to.
        ranges: float64[n, m], filled with the distances to the first hits, metres; inf for
            none.
    """
    columns = columns_of(solids.kinds, solids.centres, solids.rotations, solids.sizes)
    for k in range(origins.shape[0]):
        row, origin, rotation = ranges[k], triple(origins[k]), rotations[k]
        row[:] = math.inf
        _cast_at_floor(row, origin, rotation, beams)
        _cast_at_solids(row, origin, rotation, beams, solids, columns)
        if grid.members.shape[0] > 0:
            for beam in range(row.shape[0]):
                direction = _in_map(rotation, beams.directions[beam])
                row[beam] = cast_through_grid(
                    grid, origin, direction, beams.near_m, min(row[beam], beams.far_m), row[beam]
                )
        for beam in range(row.shape[0]):
            if row[beam] > beams.far_m:
                row[beam] = math.inf


@njit(cache=True, nogil=True)
def _in_map(rotation: NDArray[np.float64], direction: NDArray[np.float64]) -> Triple:
    """Return the direction in ``map`` of a beam, float64[2]."""
    return (
        rotation[0, 0] * direction[0] + rotation[0, 1] * direction[1],
        rotation[1, 0] * direction[0] + rotation[1, 1] * direction[1],
        rotation[2, 0] * direction[0] + rotation[2, 1] * direction[1],
    )


@njit(cache=True, nogil=True)
def _cast_at_floor(
    row: NDArray[np.float64], origin: Triple, rotation: NDArray[np.float64], beams: Beams
) -> None:
    """Shorten the beams, float64[m], that look down to where they meet z = 0."""
    if math.hypot(rotation[2, 0], rotation[2, 1]) * beams.far_m < origin[2]:
        return
    for beam in range(row.shape[0]):
        rise = (
            rotation[2, 0] * beams.directions[beam, 0] + rotation[2, 1] * beams.directions[beam, 1]
        )
        if rise < 0.0:
            distance = origin[2] / -rise
            if distance >= beams.near_m:
                row[beam] = distance


@njit(cache=True, nogil=True)
def _cast_at_solids(
    row: NDArray[np.float64],
    origin: Triple,
    rotation: NDArray[np.float64],
    beams: Beams,
    solids: Solids,
    columns: NDArray[np.float64],
) -> None:
    """Shorten the beams, float64[m], to where they enter solids, near ones first.

    Most others are hidden behind the near ones, which a rough sector is enough to tell.
    """
    count = solids.kinds.shape[0]
    axes = triple(rotation[:, 0]), triple(rotation[:, 1]), triple(rotation[:, 2])
    rough = np.empty((3, count))
    rough_sectors(columns, origin, axes, rough)
    firsts, nexts = np.full(_RINGS, -1), np.empty(count, np.int64)  # lists of each ring's solids
    for solid in range(count):
        if rough[0, solid] <= beams.far_m:
            ring = min(int(max(rough[0, solid], 0.0) / _RING_M), _RINGS - 1)
            nexts[solid] = firsts[ring]
            firsts[ring] = solid
    for ring in range(_RINGS):
        solid = firsts[ring]
        while solid >= 0:
            limit = rough[0, solid] - _ROUNDING
            first_rad, width_rad = rough[1, solid], rough[2, solid]
            if rough[0, solid] <= 0.0:
                first_rad, width_rad = _sector_around(origin, axes, beams.near_m, solids, solid)
            if width_rad >= 0.0:
                first, last = _beams_of(first_rad, width_rad, beams)
                first_beam = int(math.ceil(first))
                end = int(math.floor(last))
                _shorten(row, first_beam, end, limit, origin, axes, beams, solids, solid)
                last -= 2.0 * math.pi / beams.step_rad  # the rest after a full turn
                if last >= 0.0:
                    end = min(int(math.floor(last)), first_beam - 1)
                    _shorten(row, 0, end, limit, origin, axes, beams, solids, solid)
            solid = nexts[solid]


@njit(cache=True, nogil=True)
def _sector_around(
    origin: Triple, axes: Axes, near_m: float, solids: Solids, solid: int
) -> Tuple[float, float]:
    """Return ``sectors.sector_around`` a solid."""
    centre, to_solid = solids.centres[solid], solids.rotations[solid]
    offset = (origin[0] - centre[0], origin[1] - centre[1], origin[2] - centre[2])
    ahead, left, up = turn(to_solid, axes[0]), turn(to_solid, axes[1]), turn(to_solid, axes[2])
    sizes = triple(solids.sizes[solid])
    return sector_around(
        solids.kinds[solid], turn(to_solid, offset), ahead, left, up, sizes, near_m
    )


@njit(cache=True, nogil=True)
def _beams_of(first_rad: float, width_rad: float, beams: Beams) -> Tuple[float, float]:
    """Return a sector in numbers of beams, with fractions; its end may be a turn farther on."""
    offset_rad = first_rad - beams.first_rad  # within a turn and a half; a modulo is slow
    if offset_rad < 0.0:
        offset_rad += 2.0 * math.pi
    elif offset_rad >= 2.0 * math.pi:
        offset_rad -= 2.0 * math.pi
    first = offset_rad / beams.step_rad
    return first - _ROUNDING, first + width_rad / beams.step_rad + _ROUNDING


@njit(cache=True, nogil=True)
def _shorten(
    row: NDArray[np.float64],
    first: int,
    last: int,
    limit: float,
    origin: Triple,
    axes: Axes,
    beams: Beams,
    solids: Solids,
    solid: int,
) -> None:
    """Shorten the beams first .. last to where they enter a solid that is beyond ``limit``."""
    last = min(last, row.shape[0] - 1)
    while first <= last and row[first] <= limit:
        first += 1
    while first <= last and row[last] <= limit:
        last -= 1
    if first > last:
        return
    centre, to_solid = solids.centres[solid], solids.rotations[solid]
    offset = (origin[0] - centre[0], origin[1] - centre[1], origin[2] - centre[2])
    eye = turn(to_solid, offset)
    ahead, left = turn(to_solid, axes[0]), turn(to_solid, axes[1])
    kind, sizes = solids.kinds[solid], triple(solids.sizes[solid])
    for beam in range(first, last + 1):
        cos, sin = beams.directions[beam, 0], beams.directions[beam, 1]
        direction = (
            cos * ahead[0] + sin * left[0],
            cos * ahead[1] + sin * left[1],
            cos * ahead[2] + sin * left[2],
        )
        entry = enter_solid(kind, eye, direction, sizes)
        if beams.near_m <= entry < row[beam]:
            row[beam] = entry


@njit(cache=True, nogil=True, inline="always")
def cast_through_grid(
    grid: SolidGrid, origin: Triple, direction: Triple, near: float, far: float, hit: float
) -> float:
    """Return the first hit of a ray from ``near`` on, or ``hit`` if that or ``far`` is nearer.

    The ray walks the columns in the order in which it crosses them (J. Amanatides, A. Woo,
    "A fast voxel traversal algorithm for ray tracing", Eurographics 1987). Origin and direction
    are triples in ``map``, lengths in metres.
    """
    begin, end = near, far
    for axis in range(3):
        entry, leave = through_slab(origin[axis], direction[axis], grid.low[axis], grid.high[axis])
        begin, end = max(begin, entry), min(end, leave)
    if begin > end:
        return hit
    rows, columns = grid.starts.shape[0], grid.starts.shape[1] - 1
    x, step_x, next_x, pitch_x = _walk(
        origin[0], direction[0], grid.low[0], begin, grid.cell_m, columns
    )
    y, step_y, next_y, pitch_y = _walk(
        origin[1], direction[1], grid.low[1], begin, grid.cell_m, rows
    )
    while 0 <= x < columns and 0 <= y < rows:
        for member in range(grid.starts[y, x], grid.starts[y, x + 1]):
            entry = _enter_in_map(grid.solids, grid.members[member], origin, direction)
            if near <= entry < hit:
                hit = entry
        leave = min(next_x, next_y)
        if hit <= leave or leave >= end:
            return hit
        if next_x < next_y:
            x, next_x = x + step_x, next_x + pitch_x
        else:
            y, next_y = y + step_y, next_y + pitch_y
    return hit


@njit(cache=True, nogil=True)
def _walk(
    origin: float, direction: float, low: float, begin: float, cell: float, cells: int
) -> Tuple[int, int, float, float]:
    """Return, for an axis, the cell at ``begin``, its step, the next border's t, t per cell."""
    index = min(max(int(math.floor((origin + begin * direction - low) / cell)), 0), cells - 1)
    if direction > 0.0:
        return index, 1, (low + (index + 1) * cell - origin) / direction, cell / direction
    if direction < 0.0:
        return index, -1, (low + index * cell - origin) / direction, -cell / direction
    return index, 0, math.inf, math.inf


@njit(cache=True, nogil=True, inline="always")
def _enter_in_map(solids: Solids, solid: int, origin: Triple, direction: Triple) -> float:
    """Return ``enter_solid`` of a ray in ``map``."""
    centre, to_solid = solids.centres[solid], solids.rotations[solid]
    offset = (origin[0] - centre[0], origin[1] - centre[1], origin[2] - centre[2])
    return enter_solid(
        solids.kinds[solid],
        turn(to_solid, offset),
        turn(to_solid, direction),
        triple(solids.sizes[solid]),
    )
