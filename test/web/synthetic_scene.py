"""Where the made-up fleet flies: pillars, a few other solids, two that move; and diagnostics."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Dict, List, Tuple

import numpy as np

from quad_nav.sim.motion import Motion, Walkers
from quad_nav.sim.obstacles import Box, Cylinder, Sphere
from quad_nav.sim.scene import MovingObstacle, Scene, Walls
from quad_web.view.items import scene_item
from quad_web.view.state import Item

Size = Tuple[float, float]


def scene(size_m: Size, centres: Any, has_obstacles: bool) -> Dict[str, Any]:
    """Return the item ``scene``: a pillar at each of float[n, 2] centres, and a few solids."""
    x_m, y_m = size_m
    pillars = [Cylinder(f"pillar{i}", x, y, 0.35, 1.6) for i, (x, y) in enumerate(centres.tolist())]
    solids = (
        *pillars,
        Box("table", 1.2, 1.0, 1.2, 0.8, 0.5),
        Box("beam", x_m - 2.0, 1.0, 2.0, 0.2, 0.2, bottom_m=1.8, yaw_rad=0.5),
        Sphere("ball", 1.0, y_m - 1.0, 1.0, 0.3),
    )
    made_up = Scene("made up", x_m, y_m, 1.0, Walls(), solids, ())
    if has_obstacles:
        cart = Box("cart", 0.0, 0.0, 0.9, 0.5, 1.2)
        moving = (MovingObstacle(cart, Motion((0.0,), ((0.0, 0.0, 0.0),))),)
        made_up = replace(made_up, moving=moving, walkers=Walkers(1))
    return scene_item(made_up).data


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
