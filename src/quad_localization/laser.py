"""One laser of the robot: its mount, and how well each particle explains its scans.

``beam`` compares ranges with those of the map, the likelihood field models the ends of beams with
the distances to obstacles. ``beam`` and ``likelihood_field`` do not multiply the likelihoods p of
beams: their factor is 1 + sum(p^3). ``likelihood_field_prob`` multiplies them.

Source: S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005, sections 6.3 and 6.4; the
models as in ros-planning/navigation, amcl 1.17.3.
"""

from __future__ import annotations

import math
from typing import Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_localization.occupancy_map import MapFrame, OccupancyMap, cell_of, is_inside, ray_range
from quad_localization.parameters import BEAM, LIKELIHOOD_FIELD_PROB, AmclParams
from quad_localization.scan_beams import Beams
from quad_nav.files.kernel_cache import njit

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]


class Laser:
    """A laser that weighs particles by its scans.

    Attributes:
        is_due: Whether its next scan is used.
    """

    def __init__(
        self,
        params: AmclParams,
        grid: OccupancyMap,
        distances_m: Floats,
        mount: Tuple[float, float],
    ) -> None:
        """Take a map, its cells' distances to obstacles, and the laser's place in the base."""
        self.is_due = True
        self._params, self._grid, self._mount = params, grid, mount
        self._old = np.zeros((0, 0))  # upstream's table of likelihoods for beam skipping
        # The last values are those outside the map.
        z = np.append(distances_m, params.laser_likelihood_max_dist_m)
        self._distances_m = np.append(distances_m, math.inf)
        self._hits = params.laser_z_hit * _density(z, params.laser_sigma_hit_m)

    def factors(self, poses: Floats, is_converged: bool, beams: Beams) -> Optional[Floats]:
        """Return the factors float64[m] of poses float64[m, 3]; None without beams in use."""
        params = self._params
        if params.laser_max_beams < 2:
            return None
        used = self._used(beams)
        ranges_m, bearings_rad = beams.ranges_m[used], beams.bearings_rad[used]
        is_used = ranges_m < beams.range_max_m  # false for NaN
        if params.laser_model_type == BEAM:
            # A NaN makes all weights equal in upstream.
            is_used = np.full(len(ranges_m), params.upstream) | ~np.isnan(ranges_m)
        lasers, frame = _transformed(poses, self._mount), self._grid.frame
        used_m, used_rad = ranges_m[is_used], bearings_rad[is_used]
        if params.laser_model_type == BEAM:
            states, largest_m = self._grid.states, beams.range_max_m
            expected_m = _ray_ranges(lasers, used_rad, largest_m, states, frame)
            return _factors(self._of_ranges(used_m, expected_m, largest_m))
        cells = _end_cells(lasers, used_m, used_rad, frame)
        likelihoods = self._hits[cells] + params.laser_z_rand * (1.0 / beams.range_max_m)
        if params.laser_model_type != LIKELIHOOD_FIELD_PROB:
            return _factors(likelihoods)
        if params.do_beamskip and is_converged:
            agrees = self._distances_m[cells] < params.beam_skip_distance_m
            likelihoods = self._without_skipped(likelihoods, agrees, np.flatnonzero(is_used))
        with np.errstate(divide="ignore"):
            return np.exp(np.log(likelihoods).sum(axis=1))

    def ends(self, beams: Beams) -> Floats:
        """Return the ends float64[n, 2] of the beams in use that return, in the base frame."""
        used = self._used(beams)
        returns = beams.ranges_m[used] < beams.range_max_m  # false for NaN
        return beams.ends(self._mount)[used][returns]

    def _used(self, beams: Beams) -> slice:
        """Return which beams are in use."""
        count, most = len(beams.ranges_m), self._params.laser_max_beams
        if self._params.laser_model_type == LIKELIHOOD_FIELD_PROB:
            step = math.ceil(count / max(most, 1))
        else:
            step = (count - 1) // max(most - 1, 1)
        return slice(None, None, max(step, 1))  # upstream never ends if this is 0

    def _of_ranges(self, ranges_m: Floats, expected_m: Floats, largest_m: float) -> Floats:
        """Return the likelihoods float64[m, n] of ranges float64[n] where others are expected."""
        params = self._params
        with np.errstate(over="ignore", invalid="ignore"):
            z = ranges_m - expected_m
            likelihoods = params.laser_z_hit * _density(z, params.laser_sigma_hit_m)
            decay = params.laser_lambda_short
            likelihoods += (z < 0.0) * (params.laser_z_short * decay * np.exp(-decay * ranges_m))
            likelihoods += (ranges_m == largest_m) * params.laser_z_max
            likelihoods += (ranges_m < largest_m) * (params.laser_z_rand / largest_m)
        return likelihoods

    def _without_skipped(
        self, likelihoods: Floats, agrees: NDArray[np.bool_], columns: Whole
    ) -> Floats:
        """Leave out the beams with which few particles agree; keep all if that are too many.

        Args:
            likelihoods: float64[m, n].
            agrees: bool[m, n], whether a beam ends near an obstacle.
            columns: int64[n], places of the beams among all that could be in use.
        """
        params = self._params
        counts = agrees.mean(axis=0) > params.beam_skip_threshold
        if params.upstream:
            # Beams without a return count as skipped, and have an old value when all count.
            rows, all_columns = max(len(likelihoods), len(self._old)), params.laser_max_beams
            if self._old.shape != (rows, all_columns):
                self._old = np.zeros((rows, all_columns))
            self._old[: len(likelihoods), columns] = likelihoods
            likelihoods = self._old[: len(likelihoods)]
            counts = np.isin(np.arange(all_columns), columns[counts])
        skipped = len(counts) - np.count_nonzero(counts)
        if skipped >= len(counts) * params.beam_skip_error_threshold:
            return likelihoods  # the filter may have converged to a wrong pose
        return likelihoods[:, counts]


def _density(z: Floats, sigma: float) -> Floats:
    """Return the normal density of deviations, not normalised."""
    with np.errstate(divide="ignore", invalid="ignore"):
        density: Floats = np.exp(-(z * z) / (2 * sigma * sigma))
    return density


def _factors(likelihoods: Floats) -> Floats:
    """Return the factors float64[m] of likelihoods float64[m, n] that are not multiplied."""
    return 1.0 + (likelihoods * likelihoods * likelihoods).sum(axis=1)


def _transformed(poses: Floats, mount: Tuple[float, float]) -> Floats:
    """Return the poses float64[m, 3] of a laser that is mounted at a place of the base."""
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x = poses[:, 0] + mount[0] * cos - mount[1] * sin
    y = poses[:, 1] + mount[0] * sin + mount[1] * cos
    return np.column_stack((x, y, np.arctan2(sin, cos)))


@njit(cache=True, nogil=True)
def _end_cells(lasers: Floats, ranges: Floats, bearings: Floats, frame: MapFrame) -> Whole:
    """Return the cells int64[m, n] in which beams end: ``row * size_x + column``, -1 outside.

    Args:
        lasers: float64[m, 3], poses of the laser in the map, one for each particle.
        ranges: float64[n], metres.
        bearings: float64[n], radians in the base frame.
        frame: Place of the map.
    """
    cells = np.full((len(lasers), len(ranges)), -1)
    for m in range(len(lasers)):
        for k in range(len(ranges)):
            angle = lasers[m, 2] + bearings[k]
            x = lasers[m, 0] + ranges[k] * math.cos(angle)
            y = lasers[m, 1] + ranges[k] * math.sin(angle)
            column, row = cell_of(frame, x, y)
            if is_inside(frame, column, row):
                cells[m, k] = int(row) * frame.size_x + int(column)
    return cells


@njit(cache=True, nogil=True)
def _ray_ranges(
    lasers: Floats, bearings: Floats, longest: float, states: NDArray[np.int8], frame: MapFrame
) -> Floats:
    """Return the ranges float64[m, n] by the map int8[y, x], of beams as in ``_end_cells``."""
    ranges = np.empty((len(lasers), len(bearings)))
    for m in range(len(lasers)):
        for k in range(len(bearings)):
            angle = lasers[m, 2] + bearings[k]
            ranges[m, k] = ray_range(states, frame, lasers[m, 0], lasers[m, 1], angle, longest)
    return ranges
