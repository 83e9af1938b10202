"""Parameters of the global planners."""

from __future__ import annotations

from quad_nav.config.spec import Choice, Domain, Table, double, flag, integer
from quad_nav.plan.orientations import OrientationMode

_ANY = Domain.ANY
_UNUSED = "read and never used"


NAVFN_TABLE = Table(
    fixed=(
        flag("allow_unknown", True, "allow_unknown", "Plans may cross unknown space."),
        double(
            "default_tolerance",
            0.0,
            "default_tolerance_m",
            "metres",
            "Maximum distance between the goal and the end of a plan.",
        ),
        flag("visualize_potential", False, "visualize_potential", "Publish the potential."),
        double("planner_window_x", 0.0, "planner_window_x_m", "metres", "Read and never used."),
        double("planner_window_y", 0.0, "planner_window_y_m", "metres", "Read and never used."),
    )
)


def _mode(mode: OrientationMode, name: str, description: str) -> Choice:
    return Choice(name, int(mode), description)


_ORIENTATIONS = (
    _mode(OrientationMode.NONE, "None", "No orientations added except goal orientation"),
    _mode(
        OrientationMode.FORWARD,
        "Forward",
        "Positive x axis points along path, except for the goal orientation",
    ),
    _mode(
        OrientationMode.INTERPOLATE,
        "Interpolate",
        "Orientations are a linear blend of start and goal pose",
    ),
    _mode(
        OrientationMode.FORWARD_THEN_INTERPOLATE,
        "ForwardThenInterpolate",
        "Forward orientation until last straightaway, then a linear blend until the goal pose",
    ),
    _mode(
        OrientationMode.BACKWARD,
        "Backward",
        "Negative x axis points along the path, except for the goal orientation",
    ),
    _mode(
        OrientationMode.LEFTWARD,
        "Leftward",
        "Positive y axis points along the path, except for the goal orientation",
    ),
    _mode(
        OrientationMode.RIGHTWARD,
        "Rightward",
        "Negative y axis points along the path, except for the goal orientation",
    ),
)


GLOBAL_PLANNER_TABLE = Table(
    reconfigurable=(
        integer("lethal_cost", 253, "lethal_cost", "", "Lethal Cost", _ANY, 1, 255),
        integer("neutral_cost", 50, "neutral_cost", "", "Neutral Cost", _ANY, 1, 255),
        double(
            "cost_factor",
            3.0,
            "cost_factor",
            "",
            "Factor to multiply each cost from costmap by",
            _ANY,
            0.01,
            5.0,
        ),
        flag("publish_potential", True, "publish_potential", "Publish Potential Costmap"),
        integer(
            "orientation_mode",
            int(OrientationMode.FORWARD),
            "orientation_mode",
            "",
            "How to set the orientation of each point",
            _ANY,
            0,
            6,
            choices=_ORIENTATIONS,
            choices_description="How to set the orientation of each point",
        ),
        integer(
            "orientation_window_size",
            1,
            "orientation_window_size",
            "",
            "What window to use to determine the orientation based on the position"
            " derivative specified by the orientation mode",
            _ANY,
            1,
            255,
        ),
        flag(
            "outline_map",
            True,
            "outline_map",
            "Outline the global costmap with lethal obstacles. For the usage of a non static"
            " (rolling window) global costmap this needs to be set to false",
        ),
    ),
    fixed=(
        flag("use_dijkstra", True, "use_dijkstra", "Dijkstra's search; A* when false."),
        flag(
            "use_quadratic",
            True,
            "use_quadratic",
            "Potentials as of a planar wave; a step from the cheapest neighbour when false.",
        ),
        flag(
            "use_grid_path",
            False,
            "use_grid_path",
            "The path goes from cell to cell; down the gradient when false.",
        ),
        flag(
            "old_navfn_behavior",
            False,
            "old_navfn_behavior",
            "Paths as NavfnROS has them, between the lower left corners of cells.",
        ),
        flag("allow_unknown", True, "allow_unknown", "Plans may cross unknown space."),
        integer(
            "publish_scale",
            100,
            "publish_scale",
            "",
            "The highest value of the published potential.",
            Domain.POSITIVE,
            1,
            127,
        ),
    ),
    ignored=(
        ("default_tolerance", _UNUSED),
        ("planner_window_x", _UNUSED),
        ("planner_window_y", _UNUSED),
        ("visualize_potential", "the name is publish_potential"),
    ),
)


CARROT_TABLE = Table(ignored=(("step_size", _UNUSED), ("min_dist_from_robot", _UNUSED)))
