"""Where the made-up fleet flies: pillars, a few other solids, two that move; and diagnostics."""

from __future__ import annotations

import math
from typing import Any, Dict, List, Tuple

import numpy as np

from quad_web.view.state import Item

Size = Tuple[float, float]


def scene(size_m: Size, centres: Any, has_obstacles: bool) -> Dict[str, Any]:
    """Return the item ``scene``: a pillar at each of float[n, 2] centres, and a few solids."""
    x_m, y_m = size_m

    def box(
        name: str,
        x: float,
        y: float,
        sx: float,
        sy: float,
        height: float,
        bottom: float = 0.0,
        yaw: float = 0.0,
    ) -> Dict[str, Any]:
        return {
            "kind": "box",
            "x": x,
            "y": y,
            "bottom": bottom,
            "height": height,
            "size": [sx, sy],
            "yaw": yaw,
            "name": name,
            "crosses": bottom <= 1.0 <= bottom + height,
        }

    pillars = [
        {
            "kind": "cylinder",
            "x": float(x),
            "y": float(y),
            "bottom": 0.0,
            "height": 1.6,
            "radius": 0.35,
            "yaw": 0.0,
            "name": f"pillar{i}",
            "crosses": True,
        }
        for i, (x, y) in enumerate(centres)
    ]
    return {
        "size_m": [x_m, y_m],
        "origin_m": [0.0, 0.0],
        "altitude_m": 1.0,
        "walls": [
            box("wall_west", -0.05, y_m / 2, 0.1, y_m, 2.0),
            box("wall_east", x_m + 0.05, y_m / 2, 0.1, y_m, 2.0),
            box("wall_south", x_m / 2, -0.05, x_m + 0.2, 0.1, 2.0),
            box("wall_north", x_m / 2, y_m + 0.05, x_m + 0.2, 0.1, 2.0),
        ],
        "moving": moving() if has_obstacles else [],
        "solids": [
            *pillars,
            box("table", 1.2, 1.0, 1.2, 0.8, 0.5),
            box("beam", x_m - 2.0, 1.0, 2.0, 0.2, 0.2, bottom=1.8, yaw=0.5),
            {
                "kind": "sphere",
                "x": 1.0,
                "y": y_m - 1.0,
                "bottom": 0.7,
                "height": 0.6,
                "radius": 0.3,
                "yaw": 0.0,
                "name": "ball",
                "crosses": True,
            },
        ],
    }


def moving() -> List[Dict[str, Any]]:
    """Return a cart and a person, wherever they are."""
    standing = {"x": 0.0, "y": 0.0, "bottom": 0.0, "yaw": 0.0, "crosses": True}
    return [
        {**standing, "kind": "box", "name": "cart", "size": [0.9, 0.5], "height": 1.2},
        {
            **standing,
            "kind": "cylinder",
            "name": "person_0",
            "radius": 0.25,
            "height": 1.75,
            "person": True,
        },
    ]


def obstacles(size_m: Size, time_s: float) -> Item:
    """Return where the cart (to and fro at 0.5 m/s) and the person (on a circle) are."""
    x_m, y_m = size_m
    way_m = x_m - 2.0
    at_m = 0.5 * time_s % (2.0 * way_m)
    is_back = at_m > way_m
    cart = (1.0 + (2.0 * way_m - at_m if is_back else at_m), y_m - 0.5, math.pi * is_back)
    angle = time_s / 2.0
    person = (
        x_m / 2 + math.cos(angle),
        y_m / 2 + math.sin(angle),
        (angle + math.pi / 2) % (2 * math.pi),
    )
    return Item("obstacles", None, {"poses": np.array([cart, person], np.float32)})


def tracks(robot: int, places: Item) -> Item:
    """Return a robot's tracks of the cart and of the hidden person, and a suspect at (6, 1).

    Both go at 0.5 m/s; the person is tracked 0.1 m to the east.
    """
    rows = []
    for (x_m, y_m, yaw_rad), radius_m, kind in zip(places.arrays["poses"], (0.5, 0.3), (0, 1)):
        velocity = 0.5 * math.cos(yaw_rad), 0.5 * math.sin(yaw_rad)
        rows.append((x_m + 0.1 * kind, y_m, *velocity, radius_m, kind))
    rows.append((6.0, 1.0, 0.0, 0.0, 0.4, 2))
    return Item(f"track/{robot}", None, {"rows": np.array(rows, np.float32)})


def statuses(n: int) -> List[Dict[str, Any]]:
    """Return diagnostics: one warning, and the rest is well."""
    simulator = {"real_time_factor": "1.00", "rate": "1", "contacts": "0"}
    return [
        {
            "name": "simulator",
            "level": "OK",
            "message": "keeps its rate",
            "hardware": "pybullet",
            "values": simulator,
            "age_s": 0.4,
        },
        *(
            {
                "name": f"move_base{i}",
                "level": "WARN" if i == 1 else "OK",
                "message": "control loop missed 3 cycles" if i == 1 else "in time",
                "hardware": "",
                "values": {"cycle_s": "0.012", "missed": "3" if i == 1 else "0"},
                "age_s": 0.9,
            }
            for i in range(n)
        ),
    ]
