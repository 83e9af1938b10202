"""Shapes of obstacles. What a shape is, it says itself; drawings take its outline and height.

The physics engine (``body``), the LIDAR's kernel (``rays``), RViz (``topics.markers``) and the page
(``orbit_scene.js``) have a table each by ``Obstacle.shape``, and fail at a shape that they do not
know.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import Any, Callable, ClassVar, Dict, Mapping, Sequence, Tuple, Type, cast

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.document import Checker
from quad_nav.geometry import Coordinate, Pose2D, rotate_vectors

Floats = NDArray[np.float64]
Triple = Tuple[float, float, float]

ROUND_CORNERS = 32
"""Corners of the outline of a round obstacle."""
_OPTIONAL = ("yaw", "bottom")
"""Keys of scene files that are 0 by default, and may be below."""


class Obstacle(ABC):
    """Upright obstacle with its centre at (x, y), a frozen dataclass. Lengths in metres.

    Attributes:
        shape: Name of the shape in scene files.
        keys: The fields of each key in scene files, beside name, shape, centre and motion.
        name: Unique in a scene.
        bottom_m: Height of the lowest point above the floor.
        height_m: Distance from the lowest to the highest point.
        yaw_rad: Rotation about the vertical axis; 0 for what looks the same from all sides.
    """

    shape: ClassVar[str]
    keys: ClassVar[Mapping[str, Sequence[str]]]
    name: str
    x_m: float
    y_m: float
    bottom_m: float
    height_m: float
    yaw_rad: float = 0.0

    @classmethod
    def read(
        cls, check: Checker, entry: Dict[str, Any], place: str, name: str, x_m: float, y_m: float
    ) -> Obstacle:
        """Read the shape's own keys of an obstacle in a scene file; ``check`` gets the faults."""
        given: Dict[str, float] = {}
        for key, names in cls.keys.items():
            if len(names) > 1:
                given.update(
                    zip(names, check.numbers(entry, key, place, len(names), positive=True))
                )
            elif key in _OPTIONAL:
                given[names[0]] = check.number(entry, key, place, 0.0)
            else:
                given[names[0]] = check.number(entry, key, place, positive=True)
        return cls._of(check, place, name, x_m, y_m, given)

    @classmethod
    def _of(
        cls, check: Checker, place: str, name: str, x_m: float, y_m: float, given: Dict[str, float]
    ) -> Obstacle:
        """Return an obstacle that stands or hangs."""
        if given["bottom_m"] < 0.0:
            problem = f"{given['bottom_m']:g} m is below the floor, expected 0 or more"
            check.fault(f"{place}.bottom", problem)
        made: Obstacle = cast(Any, cls)(name, x_m, y_m, **given)
        return made

    @property
    @abstractmethod
    def half_m(self) -> Triple:
        """Half of the extent along the obstacle's own x, y and z."""

    @property
    @abstractmethod
    def reach_m(self) -> float:
        """Radius of an upright cylinder around the centre that holds the obstacle."""

    @abstractmethod
    def corners_m(self, count: int = ROUND_CORNERS) -> Floats:
        """Return the outline from above in the obstacle's frame, float64[k, 2], counter-clockwise.

        Args:
            count: Number of corners of a round outline.
        """

    @abstractmethod
    def surface_distance_m(self, x_m: Coordinate, y_m: Coordinate, z_m: float) -> Any:
        """Return the distance from a point, or from each of many, to the surface.

        Args:
            x_m: Number or float64[...], in ``map``.
            y_m: Of the same shape.
            z_m: Height above the floor.

        Returns:
            Of the same shape; negative inside the obstacle.
        """

    @classmethod
    def distances_to(cls, obstacles: Sequence[Any]) -> Callable[[float, float, float], Floats]:
        """Return a function of (x, y, z) for ``surface_distance_m`` of many of this shape.

        Its result is float64[n]. A shape that scenes have thousands of has a faster one. It can be
        pickled, because scenes are sent to other processes.
        """
        return partial(_distances_to_each, obstacles)

    @property
    def top_m(self) -> float:
        """Height of the highest point above the floor."""
        return self.bottom_m + self.height_m

    @property
    def centre_m(self) -> Triple:
        """Centre (x, y, z) in ``map``."""
        return (self.x_m, self.y_m, self.bottom_m + self.height_m / 2)

    def crosses(self, altitude_m: float) -> bool:
        """Return whether the obstacle is in the way at an altitude, not above or below it."""
        return self.bottom_m <= altitude_m <= self.top_m

    def outline_m(self, count: int = ROUND_CORNERS) -> Floats:
        """Return the closed outline from above in ``map``, float64[k, 2]; see ``corners_m``."""
        corners = self.corners_m(count)
        pose = Pose2D(self.x_m, self.y_m, self.yaw_rad)
        return pose.transform_points(np.concatenate([corners, corners[:1]]))

    def placed(self, pose: Sequence[float]) -> Obstacle:
        """Return the obstacle at a pose (x_m, y_m, yaw_rad) in ``map``."""
        x_m, y_m, yaw_rad = map(float, pose)
        turns = any(one.name == "yaw_rad" for one in fields(cast(Any, self)))
        return self.changed(x_m=x_m, y_m=y_m, **({"yaw_rad": yaw_rad} if turns else {}))

    def changed(self, **changes: Any) -> Obstacle:
        """Return the obstacle with other values of some fields."""
        changed: Obstacle = replace(cast(Any, self), **changes)
        return changed

    def document(self) -> Dict[str, Any]:
        """Return the entry of a scene file that ``read`` makes an equal obstacle of."""
        entry = {"name": self.name, "centre": [self.x_m, self.y_m], "shape": self.shape}
        for key, names in self.keys.items():
            values = [getattr(self, name) for name in names]
            if key != "bottom" or self.bottom_m:
                entry[key] = values if len(values) > 1 else values[0]
        return entry


@dataclass(frozen=True)
class Box(Obstacle):
    """Upright box with its centre at (x, y), rotated by ``yaw_rad`` about its vertical axis."""

    shape = "box"
    keys = {
        "size": ("size_x_m", "size_y_m"),
        "yaw": ("yaw_rad",),
        "height": ("height_m",),
        "bottom": ("bottom_m",),
    }

    name: str
    x_m: float
    y_m: float
    size_x_m: float
    size_y_m: float
    height_m: float
    yaw_rad: float = 0.0
    bottom_m: float = 0.0

    @property
    def half_m(self) -> Triple:
        """Half of the extent along the obstacle's own x, y and z."""
        return (self.size_x_m / 2, self.size_y_m / 2, self.height_m / 2)

    @property
    def reach_m(self) -> float:
        """Radius of an upright cylinder around the centre that holds the obstacle."""
        return math.hypot(self.size_x_m, self.size_y_m) / 2

    def corners_m(self, count: int = ROUND_CORNERS) -> Floats:
        """Return the outline from above in the obstacle's frame; see ``Obstacle.corners_m``."""
        x_m, y_m, _ = self.half_m
        return np.array([(x_m, y_m), (-x_m, y_m), (-x_m, -y_m), (x_m, -y_m)])

    def surface_distance_m(self, x_m: Coordinate, y_m: Coordinate, z_m: float) -> Any:
        """Return the distance to the surface; see ``Obstacle.surface_distance_m``."""
        x, y = Pose2D(self.x_m, self.y_m, self.yaw_rad).inverse_transform(x_m, y_m)
        outside = (
            np.abs(x) - self.size_x_m / 2.0,
            np.abs(y) - self.size_y_m / 2.0,
            _outside_slab(z_m, self.bottom_m, self.height_m),
        )
        return _signed_distance(outside)

    @classmethod
    def distances_to(cls, obstacles: Sequence[Box]) -> Callable[[float, float, float], Floats]:
        """Return a function for the distances to many boxes; a map has thousands."""
        centres = np.array([box.centre_m for box in obstacles])
        halves = np.array([[box.size_x_m, box.size_y_m, box.height_m] for box in obstacles]) / 2
        cos = np.array([math.cos(box.yaw_rad) for box in obstacles])
        sin = np.array([math.sin(box.yaw_rad) for box in obstacles])
        return partial(_distances_to_boxes, centres, halves, cos, sin)


class _Round(Obstacle):
    """Obstacle that is round from above."""

    radius_m: float

    @property
    def half_m(self) -> Triple:
        """Half of the extent along the obstacle's own x, y and z."""
        return (self.radius_m, self.radius_m, self.height_m / 2)

    @property
    def reach_m(self) -> float:
        """Radius of an upright cylinder around the centre that holds the obstacle."""
        return self.radius_m

    def corners_m(self, count: int = ROUND_CORNERS) -> Floats:
        """Return the outline from above in the obstacle's frame; see ``Obstacle.corners_m``."""
        angles = np.linspace(0.0, 2 * np.pi, count + 1)[:-1]
        return self.radius_m * np.column_stack([np.cos(angles), np.sin(angles)])


@dataclass(frozen=True)
class Cylinder(_Round):
    """Upright cylinder with its axis at (x, y)."""

    shape = "cylinder"
    keys = {"radius": ("radius_m",), "height": ("height_m",), "bottom": ("bottom_m",)}

    name: str
    x_m: float
    y_m: float
    radius_m: float
    height_m: float
    bottom_m: float = 0.0

    def surface_distance_m(self, x_m: Coordinate, y_m: Coordinate, z_m: float) -> Any:
        """Return the distance to the surface; see ``Obstacle.surface_distance_m``."""
        outside = (
            np.hypot(x_m - self.x_m, y_m - self.y_m) - self.radius_m,
            _outside_slab(z_m, self.bottom_m, self.height_m),
        )
        return _signed_distance(outside)

    @classmethod
    def distances_to(cls, obstacles: Sequence[Cylinder]) -> Callable[[float, float, float], Floats]:
        """Return a function for the distances to many cylinders; a wood has hundreds."""
        centres = np.array([one.centre_m for one in obstacles])
        radii = np.array([one.radius_m for one in obstacles])
        half_heights = np.array([one.height_m / 2 for one in obstacles])
        return partial(_distances_to_cylinders, centres, radii, half_heights)


@dataclass(frozen=True)
class Sphere(_Round):
    """Sphere with its centre at (x, y, z)."""

    shape = "sphere"
    keys = {"radius": ("radius_m",), "bottom": ("bottom_m",)}

    name: str
    x_m: float
    y_m: float
    z_m: float
    radius_m: float
    bottom_m: float = field(init=False, repr=False, compare=False)
    height_m: float = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "bottom_m", self.z_m - self.radius_m)
        object.__setattr__(self, "height_m", 2.0 * self.radius_m)

    @classmethod
    def _of(
        cls, check: Checker, place: str, name: str, x_m: float, y_m: float, given: Dict[str, float]
    ) -> Sphere:
        """Return a sphere of which a part is above the floor."""
        radius_m, bottom_m = given["radius_m"], given["bottom_m"]
        if bottom_m + 2 * radius_m <= 0.0:
            problem = f"{bottom_m:g} m puts the obstacle below the floor, expected a higher one"
            check.fault(f"{place}.bottom", problem)
        return cls(name, x_m, y_m, bottom_m + radius_m, radius_m)

    def surface_distance_m(self, x_m: Coordinate, y_m: Coordinate, z_m: float) -> Any:
        """Return the distance to the surface; see ``Obstacle.surface_distance_m``."""
        dx, dy, dz = x_m - self.x_m, y_m - self.y_m, z_m - self.z_m
        return np.sqrt(dx * dx + dy * dy + dz * dz) - self.radius_m


SHAPES: Mapping[str, Type[Obstacle]] = {one.shape: one for one in (Box, Cylinder, Sphere)}


def _outside_slab(z_m: float, bottom_m: float, height_m: float) -> float:
    """Return the distance of z from a horizontal slab; negative inside."""
    return max(bottom_m - z_m, z_m - bottom_m - height_m)


def _signed_distance(outside_m: Tuple[Any, ...]) -> Any:
    """Return the distance to a product of intervals from the distances to each interval.

    Outside, the distance is the norm of the positive parts. Inside, it is that to the nearest
    face.
    """
    distance_m = np.sqrt(sum(np.maximum(d, 0.0) ** 2 for d in outside_m))
    deepest_m = outside_m[0]
    for d in outside_m[1:]:
        deepest_m = np.maximum(deepest_m, d)
    return np.where(distance_m > 0.0, distance_m, deepest_m)[()]


def _distances_to_each(obstacles: Sequence[Obstacle], x_m: float, y_m: float, z_m: float) -> Floats:
    return np.array([one.surface_distance_m(x_m, y_m, z_m) for one in obstacles])


def _distances_to_boxes(
    centres: Floats, halves: Floats, cos: Floats, sin: Floats, x_m: float, y_m: float, z_m: float
) -> Floats:
    dx, dy, dz = ((x_m, y_m, z_m) - centres).T
    local = (*rotate_vectors(cos, -sin, dx, dy), dz)
    outside = np.abs(local).T - halves
    distances: Floats = _signed_distance((outside[:, 0], outside[:, 1], outside[:, 2]))
    return distances


def _distances_to_cylinders(
    centres: Floats, radii: Floats, half_heights: Floats, x_m: float, y_m: float, z_m: float
) -> Floats:
    dx, dy, dz = ((x_m, y_m, z_m) - centres).T
    distances: Floats = _signed_distance((np.hypot(dx, dy) - radii, np.abs(dz) - half_heights))
    return distances
