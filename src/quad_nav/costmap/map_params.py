"""Parameters of a costmap without its layers. They are read without the costmap's kernels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

from quad_nav.files.number_texts import Polygon, polygon_from_text
from quad_nav.parameter import (
    POSITIVE,
    deviation,
    fixed_flag,
    fixed_number,
    fixed_text,
    number,
    positive,
    signed,
    text,
    whole,
)

_POLYGON = "a list [[x1, y1], [x2, y2], [x3, y3], ...] of metres"


@dataclass(frozen=True)
class MapParams:
    """Parameters of the map that the layers write to.

    Attributes:
        footprint: Unpadded, in the robot's frame; None for a circle of ``robot_radius_m``.
        publish_on_time: Publish at the rate that is asked for, only what has changed, and a map
            that has moved in full to every subscriber. False restores upstream behaviour: more
            than a period lies between two messages, the last window is repeated while there is
            none, and a new subscriber's full map counts as everybody's.
    """

    transform_tolerance_s: float = number(
        "transform_tolerance", 0.3, "seconds", 0, 10, "Tolerated age of transforms."
    )
    update_frequency_hz: float = number("update_frequency", 5.0, "Hz", 0, 100, "Rate of updates.")
    publish_frequency_hz: float = number(
        "publish_frequency", 0.0, "Hz", 0, 100, "Rate of messages; 0 for none."
    )
    width_m: float = whole(
        "width", 10, "metres", 0, None, "Width of the map.", domain=POSITIVE, convert=float
    )
    height_m: float = whole(
        "height", 10, "metres", 0, None, "Height of the map.", domain=POSITIVE, convert=float
    )
    resolution_m: float = positive("resolution", 0.05, "metres", 0, 50, "Side of a cell.")
    origin_x_m: float = signed(
        "origin_x", 0.0, "metres", None, None, "x of the lower left corner in the global frame."
    )
    origin_y_m: float = signed(
        "origin_y", 0.0, "metres", None, None, "y of the lower left corner in the global frame."
    )
    footprint: Optional[Polygon] = text(
        "footprint", "[]", _POLYGON, "Outline of the robot.", convert=polygon_from_text
    )
    robot_radius_m: float = number(
        "robot_radius", 0.46, "metres", 0, 10, "Radius of a round robot, if footprint is not set."
    )
    footprint_padding_m: float = signed(
        "footprint_padding", 0.01, "metres", None, None, "Distance by which outlines are padded."
    )

    global_frame: str = fixed_text("global_frame", "map", "a frame's name", "The costmap's frame.")
    robot_base_frame: str = fixed_text(
        "robot_base_frame", "base_link", "a frame's name", "The robot's frame."
    )
    rolling_window: bool = fixed_flag("rolling_window", False, "The map moves with the robot.")
    track_unknown_space: bool = fixed_flag(
        "track_unknown_space", False, "Cells are unknown, not free, until a sensor sees them."
    )
    footprint_topic: str = fixed_text(
        "footprint_topic", "footprint", "a topic's name", "Topic that sets the outline; a Polygon."
    )
    published_footprint_topic: str = fixed_text(
        "published_footprint_topic", "footprint", "a topic's name", "Topic of the placed outline."
    )
    always_send_full_costmap: bool = fixed_flag(
        "always_send_full_costmap", False, "Publish the whole grid, no updates."
    )
    inscribed_radius_m: float = fixed_number(
        "inscribed_radius", 0.325, "metres", "In local_costmap: read and never used."
    )
    circumscribed_radius_m: float = fixed_number(
        "circumscribed_radius", 0.46, "metres", "Sizes what recoveries and make_plan clear."
    )
    publish_on_time: bool = deviation()
