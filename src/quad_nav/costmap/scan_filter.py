"""Scan filters: parts that see a scan before the costmaps do.

A filter may reject a scan, mask beams and forget points, and it may track moving obstacles. The
filters of a robot are a list in YAML, ``scan_filters``; ``docs/plugins.md`` has an example. The
idea is that of the filter chains of ROS's laser_filters.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.tracks import Tracks
from quad_nav.geometry import Pose3D, Scan

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ScanSituation:
    """Circumstances of a scan.

    Attributes:
        now_s: Current time.
        sensor: Name of the sensor's topic or observation source.
        pose: Pose of the sensor at the scan's stamp: in the local costmap's frame if an obstacle
            layer of that costmap takes the scan, else in the frame of the first costmap that does.
        is_local: ``pose`` is in the local costmap's frame.
        expected_period_s: Longest silence of the sensor that every layer accepts; 0 for any.
        heights_m: Lowest and greatest height of points that the layers mark, in the same frame.
        known_circles: float64[k, 3], rows x, y, radius in the same frame: the peers.
    """

    now_s: float
    sensor: str
    pose: Pose3D
    is_local: bool
    expected_period_s: float
    heights_m: Tuple[float, float]
    known_circles: Floats


@dataclass(frozen=True)
class FilteredScan:
    """A scan on its way through the filters.

    Attributes:
        scan: The scan.
        rejected: Why no layer may have it, "" if they may. Later filters do not see it.
        masked: bool[n], beams that clear and do not mark; None for no beam.
        vacated: float64[k, 3], points in the frame of the situation's pose that an obstacle has
            left: the layers forget them.
    """

    scan: Scan
    rejected: str = ""
    masked: Optional[NDArray[np.bool_]] = None
    vacated: Floats = field(default_factory=lambda: np.empty((0, 3)))


class ScanFilter:
    """Base of scan filters. One object has the scans of all sensors of a robot.

    Attributes:
        params_class: Dataclass that declares the parameters, see ``quad_nav.parameter``; None for
            a filter that checks its parameters itself.
    """

    params_class: Optional[type] = None

    def filter(self, filtered: FilteredScan, situation: ScanSituation) -> FilteredScan:
        """Return a scan with what this filter changes of it; by default nothing."""
        return filtered

    def tracks(self, now_s: float) -> Optional[Tracks]:
        """Return the moving obstacles that are known at a time; None if it tracks none."""
        return None

    def reset(self) -> None:
        """Forget earlier scans, after the clock has jumped."""


class ScanFilters:
    """The scan filters of one robot, in the order of the YAML.

    Attributes:
        filters: The filters.
    """

    def __init__(self, filters: Sequence[ScanFilter] = ()) -> None:
        self.filters = tuple(filters)

    def filter(self, scan: Scan, situation: ScanSituation) -> FilteredScan:
        """Pass a scan through the filters until one rejects it."""
        filtered = FilteredScan(scan)
        for scan_filter in self.filters:
            filtered = scan_filter.filter(filtered, situation)
            if filtered.rejected:
                break
        return filtered

    def tracks(self, now_s: float) -> Optional[Tracks]:
        """Return the moving obstacles of the first filter that tracks them, None if none does."""
        for scan_filter in self.filters:
            tracks = scan_filter.tracks(now_s)
            if tracks is not None:
                return tracks
        return None

    def reset(self) -> None:
        """Forget earlier scans, after the clock has jumped."""
        for scan_filter in self.filters:
            scan_filter.reset()
