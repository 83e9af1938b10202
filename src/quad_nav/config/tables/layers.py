"""Parameters of the costmap layers and of their sources."""

from __future__ import annotations

from quad_nav.config.spec import Choice, Domain, Table, double, flag, integer, text

_ANY, _POSITIVE = Domain.ANY, Domain.POSITIVE


ENABLED = flag("enabled", True, "enabled", "Whether to apply this plugin or not")


_FOOTPRINT_CLEARING = flag(
    "footprint_clearing_enabled",
    True,
    "footprint_clearing_enabled",
    "Whether to clear the robot's footprint of lethal obstacles",
)


_MAX_OBSTACLE_HEIGHT = double(
    "max_obstacle_height",
    2.0,
    "max_obstacle_height_m",
    "metres",
    "The maximum height of any obstacle to be inserted into the costmap in meters.",
    _ANY,
    0,
    50,
)


_COMBINATION_METHOD = integer(
    "combination_method",
    1,
    "combination_method",
    "",
    "Method for combining two layers",
    choices=(
        Choice("Overwrite", 0, "Overwrite values"),
        Choice("Maximum", 1, "Take the maximum of the values"),
        Choice("Nothing", 99, "Do nothing"),
    ),
    choices_description="Method for combining layers enum",
)


_SENSORS = (
    double(
        "obstacle_range",
        2.5,
        "obstacle_range_m",
        "metres",
        "Maximum distance at which obstacles are marked, for sources that set none.",
    ),
    double(
        "raytrace_range",
        3.0,
        "raytrace_range_m",
        "metres",
        "Maximum distance to which space is cleared, for sources that set none.",
    ),
    flag("track_unknown_space", False, "track_unknown_space", "The costmap's if unset."),
    text(
        "observation_sources",
        "",
        "",
        "names separated by blanks",
        "The sensors. Each has a namespace of its name.",
    ),
)


VOXEL_LAYER_TABLE = Table(
    reconfigurable=(
        ENABLED,
        _FOOTPRINT_CLEARING,
        _MAX_OBSTACLE_HEIGHT,
        double(
            "origin_z", 0.0, "origin_z_m", "metres", "The z origin of the map in meters.", _ANY, 0
        ),
        double(
            "z_resolution",
            0.2,
            "z_resolution_m",
            "metres",
            "The z resolution of the map in meters/cell.",
            _POSITIVE,
            0,
            50,
        ),
        integer(
            "z_voxels",
            10,
            "z_voxels",
            "",
            "The number of voxels in each vertical column.",
            _POSITIVE,
            0,
            16,
        ),
        integer(
            "unknown_threshold",
            15,
            "unknown_threshold",
            "",
            "The number of unknown cells allowed in a column considered to be known",
            low=0,
            high=16,
        ),
        integer(
            "mark_threshold",
            0,
            "mark_threshold",
            "",
            "The maximum number of marked cells allowed in a column considered to be free",
            low=0,
            high=16,
        ),
        _COMBINATION_METHOD,
    ),
    fixed=(
        *_SENSORS,
        flag(
            "publish_voxel_map",
            False,
            "publish_voxel_map",
            "Publish the marked voxels as markers.",
        ),
    ),
)


# Parameters of a voxel layer that an obstacle layer lacks.
VOXEL_PARAMETERS = (
    "origin_z",
    "z_resolution",
    "z_voxels",
    "unknown_threshold",
    "mark_threshold",
    "publish_voxel_map",
)


OBSTACLE_LAYER_TABLE = Table(
    reconfigurable=(ENABLED, _FOOTPRINT_CLEARING, _MAX_OBSTACLE_HEIGHT, _COMBINATION_METHOD),
    fixed=_SENSORS,
    ignored=tuple((name, "only a costmap_2d::VoxelLayer reads it") for name in VOXEL_PARAMETERS),
)


SOURCE_TABLE = Table(
    fixed=(
        text("topic", "", "topic", "a topic's name", "The source's name if unset."),
        text(
            "sensor_frame",
            "",
            "sensor_frame",
            "a frame's name",
            "Frame of the sensor; the frame of its messages if unset.",
        ),
        text(
            "data_type",
            "PointCloud",
            "data_type",
            "LaserScan, PointCloud or PointCloud2",
            "The type of the topic.",
        ),
        double(
            "observation_persistence",
            0.0,
            "observation_persistence_s",
            "seconds",
            "Time for which observations are kept; 0 keeps only the newest.",
        ),
        double(
            "expected_update_rate",
            0.0,
            "expected_update_period_s",
            "seconds",
            "A period, not a rate: the costmap is not current when the sensor has sent nothing"
            " for longer. 0 disables the check.",
        ),
        double(
            "min_obstacle_height",
            0.0,
            "min_obstacle_height_m",
            "metres",
            "Points below this height are ignored.",
            _ANY,
        ),
        double(
            "max_obstacle_height",
            2.0,
            "max_obstacle_height_m",
            "metres",
            "Points above this height are ignored.",
            _ANY,
        ),
        double(
            "obstacle_range",
            2.5,
            "obstacle_range_m",
            "metres",
            "Maximum distance at which obstacles are marked; the layer's if unset.",
        ),
        double(
            "raytrace_range",
            3.0,
            "raytrace_range_m",
            "metres",
            "Maximum distance to which space is cleared; the layer's if unset.",
        ),
        flag("marking", True, "marking", "The sensor marks obstacles."),
        flag("clearing", False, "clearing", "The sensor clears the space in front of obstacles."),
        flag(
            "inf_is_valid",
            False,
            "inf_is_valid",
            "Beams of a LaserScan that return inf clear up to range_max.",
        ),
    )
)


INFLATION_LAYER_TABLE = Table(
    reconfigurable=(
        ENABLED,
        double(
            "cost_scaling_factor",
            10.0,
            "cost_scaling_factor",
            "1/m",
            "A scaling factor to apply to cost values during inflation.",
            low=0,
            high=100,
        ),
        double(
            "inflation_radius",
            0.55,
            "inflation_radius_m",
            "metres",
            "The radius in meters to which the map inflates obstacle cost values.",
            low=0,
            high=50,
        ),
        flag("inflate_unknown", False, "inflate_unknown", "Whether to inflate unknown cells."),
    )
)


STATIC_LAYER_TABLE = Table(
    reconfigurable=(ENABLED,),
    fixed=(
        text("map_topic", "map", "map_topic", "a topic's name", "Topic of the map."),
        flag("first_map_only", False, "first_map_only", "Ignore all maps but the first."),
        flag(
            "subscribe_to_updates",
            False,
            "subscribe_to_updates",
            "Subscribe to the updates of the map too.",
        ),
        flag(
            "track_unknown_space",
            True,
            "track_unknown_space",
            "Unknown cells of the map stay unknown.",
        ),
        flag(
            "use_maximum",
            False,
            "use_maximum",
            "Use the maximum of the map's and the other layers' costs.",
        ),
        integer(
            "lethal_cost_threshold",
            100,
            "lethal_cost_threshold",
            "",
            "Minimum occupancy of an obstacle.",
            low=0,
            high=100,
        ),
        integer(
            "unknown_cost_value",
            -1,
            "unknown_cost_value",
            "",
            "The occupancy that means unknown; counts modulo 256.",
        ),
        flag(
            "trinary_costmap",
            True,
            "trinary_costmap",
            "Cells are free, unknown or obstacles, without values between.",
        ),
    ),
)
