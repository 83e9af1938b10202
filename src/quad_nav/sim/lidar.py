"""The LIDAR: which way its beams look, and the ranges they return.

What the beams hit is somebody else's business: a *caster* takes the beams' ends
and returns how far along each one something is hit, see ``RayCaster``.
"""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional, Protocol

import numpy as np

from quad_nav.errors import InputError
from quad_nav.geometry import Pose3D, Scan

MOUNT_HEIGHT_M = 0.06
base_from_lidar = Pose3D(0.0, 0.0, MOUNT_HEIGHT_M)


class RayCaster(Protocol):
    """Finds what beams hit; the world of bodies is one."""

    def cast(self, starts_m: np.ndarray, ends_m: np.ndarray) -> np.ndarray:
        """Fraction of the way to the first hit float64[m], +inf for none.

        ``starts_m`` and ``ends_m`` are float64[m, 3] in ``map``. A solid that
        a beam starts inside of is not hit.
        """


@dataclass(frozen=True)
class LidarParams:
    """Beam pattern and noise.

    Beams start at ``-scan_range_rad / 2`` and are ``step_size_rad`` apart; the
    last one is a step short of ``+scan_range_rad / 2``, so that a full turn has
    no beam twice.
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
            problems.append(f"step_size: {self.step_size_rad}, expected an angle that divides "
                            f"scan_range, {self.scan_range_rad}, into 2 or more")
        if not 0.0 <= self.range_min_m < self.range_max_m < math.inf:
            problems.append(f"range_min, range_max: {self.range_min_m}, {self.range_max_m}, "
                            "expected 0 <= range_min < range_max")
        if not 0.0 <= self.noise_std_m < math.inf:
            problems.append(f"range_noise: {self.noise_std_m}, expected metres, 0 or more")
        if problems:
            raise InputError(problems)

    @property
    def beam_count(self) -> int:
        return round(self.scan_range_rad / self.step_size_rad)

    @property
    def angle_min_rad(self) -> float:
        return -self.scan_range_rad / 2.0

    @property
    def angle_max_rad(self) -> float:
        """The last beam, one step short of ``scan_range_rad / 2``."""
        return self.angle_min_rad + (self.beam_count - 1) * self.step_size_rad


class Lidar:
    """Turns a pose into a scan; one object serves any number of quadcopters."""

    def __init__(self, params: LidarParams):
        self.params = params
        angles = params.angle_min_rad + params.step_size_rad * np.arange(params.beam_count)
        self._directions = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])

    def scan(self, stamp_s: float, map_from_lidar: Pose3D, caster: RayCaster,
             random: Optional[np.random.Generator] = None) -> Scan:
        """One turn, taken at an instant. ``random`` is needed when there is noise."""
        params = self.params
        directions = self._directions @ map_from_lidar.rotation.T
        origin = map_from_lidar.translation
        fractions = caster.cast(origin + params.range_min_m * directions,
                                origin + params.range_max_m * directions)
        ranges = params.range_min_m + fractions * (params.range_max_m - params.range_min_m)
        if params.noise_std_m > 0.0:
            if random is None:
                raise ValueError("a LIDAR with noise needs a random generator")
            ranges = self._with_noise(ranges, random)
        return Scan(stamp_s, params.angle_min_rad, params.step_size_rad, params.range_min_m,
                    params.range_max_m, ranges.astype(np.float32))

    def _with_noise(self, ranges_m: np.ndarray, random: np.random.Generator) -> np.ndarray:
        """Gaussian noise on the hits; a return stays within what the sensor can tell."""
        noisy = ranges_m + random.normal(0.0, self.params.noise_std_m, len(ranges_m))
        return np.where(np.isfinite(ranges_m),
                        np.clip(noisy, self.params.range_min_m, self.params.range_max_m), np.inf)
