"""One laser of the robot: its mount, its model, and which beams it takes."""

from __future__ import annotations

import math
from typing import Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_localization.laser_models import Mixture, end_cells, ray_factors
from quad_localization.likelihood_field import LikelihoodField
from quad_localization.occupancy_map import OccupancyMap
from quad_localization.parameters import BEAM, LIKELIHOOD_FIELD_PROB, AmclParams
from quad_localization.scan_beams import Beams

Floats = NDArray[np.float64]


class Laser:
    """A laser that weighs particles by its scans.

    Attributes:
        is_due: Whether its next scan is used.
    """

    def __init__(
        self,
        params: AmclParams,
        grid: OccupancyMap,
        field: Optional[LikelihoodField],
        mount: Tuple[float, float],
    ) -> None:
        """Take the map, its likelihood field (None for ``beam``) and the place in the base, m."""
        self.is_due = True
        self._params, self._grid, self._field, self._mount = params, grid, field, mount
        self._old = np.zeros((0, 0))  # upstream's table of likelihoods for beam skipping

    def factors(self, poses: Floats, is_converged: bool, beams: Beams) -> Optional[Floats]:
        """Return the factors float64[m] of poses float64[m, 3]; None without beams in use."""
        params, count = self._params, len(beams.ranges_m)
        if params.laser_max_beams < 2:
            return None
        if params.laser_model_type == LIKELIHOOD_FIELD_PROB:
            step = math.ceil(count / params.laser_max_beams)
        else:
            step = (count - 1) // (params.laser_max_beams - 1)
        used = slice(None, None, max(step, 1))  # upstream never ends if this is 0
        ranges_m, bearings_rad = beams.ranges_m[used], beams.bearings_rad[used]
        is_used = ranges_m < beams.range_max_m  # false for NaN
        if params.laser_model_type == BEAM:
            # A NaN makes all weights equal in upstream.
            is_used = np.full(len(ranges_m), params.upstream) | ~np.isnan(ranges_m)
        lasers, frame = _transformed(poses, self._mount), self._grid.frame
        used_m, used_rad = ranges_m[is_used], bearings_rad[is_used]
        if self._field is None:
            states, largest_m = self._grid.states, beams.range_max_m
            mixture = self._mixture
            return ray_factors(lasers, used_m, used_rad, largest_m, states, frame, mixture)
        cells = end_cells(lasers, used_m, used_rad, frame)
        likelihoods = self._field.hits[cells] + params.laser_z_rand * (1.0 / beams.range_max_m)
        if params.laser_model_type == LIKELIHOOD_FIELD_PROB:
            if params.do_beamskip and is_converged:
                agrees = self._field.distances_m[cells] < params.beam_skip_distance_m
                likelihoods = self._without_skipped(likelihoods, agrees, np.flatnonzero(is_used))
            with np.errstate(divide="ignore"):
                return np.exp(np.log(likelihoods).sum(axis=1))
        return 1.0 + (likelihoods * likelihoods * likelihoods).sum(axis=1)

    @property
    def _mixture(self) -> Mixture:
        one = self._params
        return (
            one.laser_z_hit,
            one.laser_z_short,
            one.laser_z_max,
            one.laser_z_rand,
            one.laser_sigma_hit_m,
            one.laser_lambda_short,
        )

    def _without_skipped(
        self, likelihoods: Floats, agrees: NDArray[np.bool_], columns: NDArray[np.int64]
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
            is_counted = np.zeros(all_columns, np.bool_)
            is_counted[columns] = counts
            counts = is_counted
        skipped = len(counts) - np.count_nonzero(counts)
        if skipped >= len(counts) * params.beam_skip_error_threshold:
            return likelihoods  # the filter may have converged to a wrong pose
        return likelihoods[:, counts]


def _transformed(poses: Floats, mount: Tuple[float, float]) -> Floats:
    """Return the poses float64[m, 3] of a laser that is mounted at a place of the base."""
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x = poses[:, 0] + mount[0] * cos - mount[1] * sin
    y = poses[:, 1] + mount[0] * sin + mount[1] * cos
    return np.column_stack((x, y, np.arctan2(sin, cos)))
