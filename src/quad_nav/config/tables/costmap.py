"""Parameters of a costmap itself; those of its layers are in ``layers``."""

from __future__ import annotations

from quad_nav.config.spec import Domain, Table, double, flag, integer, text
from quad_nav.config.texts import polygon_from_text

_ANY, _POSITIVE = Domain.ANY, Domain.POSITIVE


COSTMAP_TABLE = Table(
    reconfigurable=(
        double(
            "transform_tolerance",
            0.3,
            "transform_tolerance_s",
            "seconds",
            "Specifies the delay in transform (tf) data that is tolerable in seconds.",
            low=0,
            high=10,
        ),
        double(
            "update_frequency",
            5.0,
            "update_frequency_hz",
            "Hz",
            "The frequency in Hz for the map to be updated.",
            low=0,
            high=100,
        ),
        double(
            "publish_frequency",
            0.0,
            "publish_frequency_hz",
            "Hz",
            "The frequency in Hz for the map to publish display information.",
            low=0,
            high=100,
        ),
        integer(
            "width",
            10,
            "width_m",
            "metres",
            "The width of the map in meters.",
            _POSITIVE,
            0,
            convert=float,
        ),
        integer(
            "height",
            10,
            "height_m",
            "metres",
            "The height of the map in meters.",
            _POSITIVE,
            0,
            convert=float,
        ),
        double(
            "resolution",
            0.05,
            "resolution_m",
            "metres",
            "The resolution of the map in meters/cell.",
            _POSITIVE,
            0,
            50,
        ),
        double(
            "origin_x",
            0.0,
            "origin_x_m",
            "metres",
            "The x origin of the map in the global frame in meters.",
            _ANY,
        ),
        double(
            "origin_y",
            0.0,
            "origin_y_m",
            "metres",
            "The y origin of the map in the global frame in meters.",
            _ANY,
        ),
        text(
            "footprint",
            "[]",
            "footprint",
            "a list [[x1, y1], [x2, y2], [x3, y3], ...] of metres",
            "The footprint of the robot specified in the robot_base_frame coordinate frame as a"
            " list in the format: [ [x1, y1], [x2, y2], ...., [xn, yn] ].",
            convert=polygon_from_text,
        ),
        double(
            "robot_radius",
            0.46,
            "robot_radius_m",
            "metres",
            "The radius of the robot in meters, this parameter should only be set for"
            " circular robots, all others should use the footprint parameter described"
            " above.",
            low=0,
            high=10,
        ),
        double(
            "footprint_padding",
            0.01,
            "footprint_padding_m",
            "metres",
            "How much to pad (increase the size of) the footprint, in meters.",
            _ANY,
        ),
    ),
    fixed=(
        text("global_frame", "map", "global_frame", "a frame's name", "The costmap's frame."),
        text(
            "robot_base_frame",
            "base_link",
            "robot_base_frame",
            "a frame's name",
            "The robot's frame.",
        ),
        flag("rolling_window", False, "rolling_window", "The map moves with the robot."),
        flag(
            "track_unknown_space",
            False,
            "track_unknown_space",
            "Cells are unknown, not free, until a sensor sees them.",
        ),
        flag(
            "always_send_full_costmap",
            False,
            "always_send_full_costmap",
            "Publish the whole grid, no updates.",
        ),
        double("inscribed_radius", 0.325, "", "metres", "In local_costmap: read and never used."),
        double(
            "circumscribed_radius",
            0.46,
            "",
            "metres",
            "In local_costmap: a quarter of aggressive_reset/reset_distance.",
        ),
    ),
)
