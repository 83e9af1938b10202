"""LIDAR: its mount, its beams, and scans from the distances that its beams measure.

``casters`` finds what the beams hit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import InputError
from quad_nav.geometry import Pose3D, Scan
from quad_nav.sim.flight import BodyState
from quad_nav.sim.scene import MOUNT_HEIGHT_M

Floats = NDArray[np.float64]

base_from_lidar = Pose3D(0.0, 0.0, MOUNT_HEIGHT_M)


@dataclass(frozen=True)
class LidarParams:
    """Beam pattern and noise.

    The first beam is at ``-scan_range_rad / 2``, the last one a step before
    ``+scan_range_rad / 2``, so that no beam of a full turn occurs twice.

    Attributes:
        scan_range_rad: Angle that a scan covers.
        step_size_rad: Angle between two beams.
        range_min_m: Smallest range.
        range_max_m: Largest range.
        noise_std_m: Standard deviation of the ranges' Gaussian noise.

    Raises:
        InputError: A value is out of range; lists all of them.
    """

    scan_range_rad: float = 2.0 * math.pi
    step_size_rad: float = 2.0 * math.pi / 512
    range_min_m: float = 0.02
    range_max_m: float = 60.0
    noise_std_m: float = 0.0

    def __post_init__(self) -> None:
        problems = []
        if not 0.0 < self.scan_range_rad <= 2.0 * math.pi + 1e-9:
            problems.append(f"scan_range: {self.scan_range_rad}, expected an angle in (0, 2 pi]")
        beams = self.scan_range_rad / self.step_size_rad if self.step_size_rad > 0.0 else 0.0
        if not (1.5 < beams < math.inf and abs(beams - round(beams)) < 0.01):
            problems.append(
                f"step_size: {self.step_size_rad}, expected an angle that divides "
                f"scan_range, {self.scan_range_rad}, into 2 or more"
            )
        if not 0.0 <= self.range_min_m < self.range_max_m < math.inf:
            problems.append(
                f"range_min, range_max: {self.range_min_m}, {self.range_max_m}, "
                "expected 0 <= range_min < range_max"
            )
        if not 0.0 <= self.noise_std_m < math.inf:
            problems.append(f"range_noise: {self.noise_std_m}, expected metres, 0 or more")
        if problems:
            raise InputError(problems)

    @property
    def beam_count(self) -> int:
        """Number of beams in a scan."""
        return round(self.scan_range_rad / self.step_size_rad)

    @property
    def angle_min_rad(self) -> float:
        """Angle of the first beam."""
        return -self.scan_range_rad / 2.0

    @property
    def angle_max_rad(self) -> float:
        """Angle of the last beam, one step before ``scan_range_rad / 2``."""
        return self.angle_min_rad + (self.beam_count - 1) * self.step_size_rad


def beam_directions(params: LidarParams) -> Floats:
    """Return the beams' unit vectors float64[beams, 3] in the LIDAR's frame."""
    angles = params.angle_min_rad + params.step_size_rad * np.arange(params.beam_count)
    return np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])


def lidar_poses(bodies: BodyState, robots: Sequence[int]) -> Tuple[Floats, Floats]:
    """Return positions float64[n, 3] and rotations float64[n, 3, 3] of LIDARs in ``map``."""
    rotations, positions_m = bodies.rotations, bodies.positions_m
    if list(robots) != list(range(len(positions_m))):
        rotations, positions_m = rotations[list(robots)], positions_m[list(robots)]
    return positions_m + rotations @ base_from_lidar.translation, rotations


def make_scan(
    params: LidarParams,
    stamp_s: float,
    distances_m: Floats,
    random: Optional[np.random.Generator] = None,
) -> Scan:
    """Make a scan of distances float64[beams], +inf for no hit, with noise from ``random``.

    Raises:
        ValueError: There is noise but no source for it.
    """
    if params.noise_std_m > 0.0:
        if random is None:
            raise ValueError("a LIDAR with noise needs a random generator")
        distances_m = _with_noise(params, distances_m, random)
    return Scan(
        stamp_s,
        params.angle_min_rad,
        params.step_size_rad,
        params.range_min_m,
        params.range_max_m,
        distances_m.astype(np.float32),
    )


def _with_noise(params: LidarParams, distances_m: Floats, random: np.random.Generator) -> Floats:
    """Add Gaussian noise to the hits, within the limits of the range."""
    noisy = distances_m + random.normal(0.0, params.noise_std_m, len(distances_m))
    return np.where(
        np.isfinite(distances_m), np.clip(noisy, params.range_min_m, params.range_max_m), np.inf
    )
