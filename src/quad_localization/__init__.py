"""Know where the robots are: localization on a known map, or on one that grows, and map files.

Reading order of amcl: ``localizer`` (the node without ROS), ``particle_filter`` with ``clusters``
and ``covariance_axes``; ``odometry_models``; ``laser`` with ``scan_beams`` and ``occupancy_map``;
``place_search``; ``parameters``. Of slam: ``slam`` and ``growing_map``. ``map_files`` reads and
saves maps.
"""

from __future__ import annotations

from quad_localization.localizer import Amcl, Observation, PoseEstimate, Update
from quad_localization.occupancy_map import OccupancyMap
from quad_localization.parameters import AmclParams, read_params

__all__ = [
    "Amcl",
    "AmclParams",
    "Observation",
    "OccupancyMap",
    "PoseEstimate",
    "Update",
    "read_params",
]
