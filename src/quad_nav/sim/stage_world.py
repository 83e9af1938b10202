"""Worlds of the simulator Stage as obstacles.

Models become obstacles from their bitmaps, blocks or sizes; robots (``position``) and their devices
do not. Stage's robots drive in a plane, so a world counts as a map: all heights are those of walls.
Bitmaps and blocks are scaled to their model's size, without the white around a bitmap, as in
libstage/blockgroup.cc.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import List, Sequence, Tuple

import numpy as np

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.sim.map_file import MAX_BOXES, rectangles_of
from quad_nav.sim.map_image import read_dark
from quad_nav.sim.mesh import Floats, NotRepresented, boxes_of, prism
from quad_nav.sim.model_files import find_file, model_folders
from quad_nav.sim.obstacles import Box
from quad_nav.sim.stage_file import Entity, StageReader
from quad_nav.sim.world_file import Findings, World, listed, printable

_SIZE = (0.1, 0.1, 0.1)
_THINNEST_M = 0.01
_ABOVE_ROBOTS_M = 0.5
"""Models that hang higher are no obstacles to the robots of Stage, which are 0.2 m high."""
_UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_DEVICES = (
    *("window", "block", "sensor", "ranger", "laser", "sonar", "camera", "fiducial", "gripper"),
    *("actuator", "blinkenlight", "blobfinder", "bumper", "fiducialfinder", "lightindicator"),
)


def load_stage_world(path: Path, height_m: float) -> World:
    """Read a world of Stage, whose obstacles are as high as walls.

    Raises:
        InputError: A file cannot be read, is no world of Stage, or has too many parts.
    """
    folders = [*model_folders(path), path.parent.parent]
    reader = StageReader(path, folders)
    world = reader.read()
    walk = _Walk(
        folders,
        height_m,
        _UNITS_M.get(world.text("unit_length"), 1.0),
        1.0 if world.text("unit_angle") == "radians" else math.pi / 180.0,
    )
    walk.parts(world, Pose2D(0.0, 0.0), 0.0)
    for name in reader.missing:
        walk.findings.leave_out(name, "<include> that is not found")
    remarks = list(walk.findings.remarks(path))
    if walk.robots:
        remarks.append(f"{path}: robots are no obstacles: {listed(walk.robots)}")
    return World(tuple(walk.findings.obstacles), tuple(remarks))


@dataclass
class _Walk:
    """Traversal of the models of a world.

    Attributes:
        folders: Where bitmaps are.
        height_m: Height of all obstacles.
        unit_m: Length of the world's unit.
        unit_rad: Angle of the world's unit.
        findings: What is found.
        robots: Name and pose of each robot.
    """

    folders: Sequence[Path]
    height_m: float
    unit_m: float
    unit_rad: float
    findings: Findings = field(default_factory=Findings)
    robots: List[str] = field(default_factory=list)

    def parts(self, entity: Entity, map_from_parent: Pose2D, floor_m: float) -> None:
        """Read the models in an entity, which stand on top of it."""
        for part in entity.parts:
            name = printable(part.text("name") or part.called)
            try:
                self._model(part, name, map_from_parent, floor_m)
            except NotRepresented as reason:
                self.findings.leave_out(name, str(reason))
            except InputError as error:
                self.findings.leave_out(name, "; ".join(error.problems))

    def _model(self, entity: Entity, name: str, map_from_parent: Pose2D, floor_m: float) -> None:
        if entity.type in _DEVICES:
            return
        pose, z_m = self._pose(entity, "pose")
        map_from_model = map_from_parent.compose(pose)
        if entity.type == "position":
            x_m, y_m, yaw_rad = (map_from_model.x_m, map_from_model.y_m, map_from_model.yaw_rad)
            self.robots.append(f"{name} at [{x_m:.2f}, {y_m:.2f}, {yaw_rad:.2f}]")
            return
        if entity.type != "model" and "bitmap" not in entity.properties:
            raise NotRepresented(f"{entity.type}, a type that no file defines")
        size = np.maximum(np.abs(entity.numbers("size", _SIZE)) * self.unit_m, _THINNEST_M)
        if not _is_solid(entity):
            self.findings.leave_out(name, "not touched and not seen in Stage")
        elif floor_m + z_m > _ABOVE_ROBOTS_M:
            self.findings.leave_out(name, "above the robots of Stage")
        else:
            map_from_body = map_from_model.compose(self._pose(entity, "origin")[0])
            self.findings.obstacles += self._boxes(entity, name, map_from_body, size)
        self.parts(entity, map_from_model, floor_m + z_m + (size[2] if len(size) > 2 else 0.0))

    def _pose(self, entity: Entity, name: str) -> Tuple[Pose2D, float]:
        """Return a pose and a height; Stage 2 has no heights."""
        values = [*entity.numbers(name, (0.0,) * 4)]
        x, y, *z, angle = values if len(values) > 2 else (*values, *(0.0,) * 3)
        x_m, y_m, z_m = (self.unit_m * one for one in (x, y, sum(z)))
        return Pose2D(x_m, y_m, self.unit_rad * angle), z_m

    def _boxes(self, entity: Entity, name: str, pose: Pose2D, size_m: Floats) -> List[Box]:
        """Return the body of a model, whose centre has a pose."""
        blocks = [one for one in entity.parts if one.type == "block"]
        shares = np.array([(0.0, 0.0, 1.0, 1.0)])
        boxes: List[Box] = []
        if "bitmap" in entity.properties:
            shares = self._bitmap(entity)
        elif blocks:
            sides = _sides(blocks) * (*size_m[:2], self.height_m)
            boxes, shares = boxes_of(name, sides, pose.to_3d()), shares[:0]
        elif entity.text("noblocks", "0") != "0":
            shares = shares[:0]
        if entity.text("boundary", "0") != "0":
            shares = np.concatenate([shares, _boundary(_THINNEST_M / size_m[:2])])
        for number, (x_m, y_m, x_size_m, y_size_m) in enumerate(shares * np.tile(size_m[:2], 2)):
            x_m, y_m = pose.transform(float(x_m), float(y_m))
            size = (float(x_size_m), float(y_size_m), self.height_m)
            boxes.append(Box(f"{name}_b{number}", x_m, y_m, *size, pose.yaw_rad))
        return boxes

    def _bitmap(self, entity: Entity) -> Floats:
        """Return rectangles, float64[n, 4], of the dark pixels of a bitmap; see ``_boundary``."""
        file = entity.text("bitmap")
        place = find_file(file, self.folders)
        if place is None:
            raise NotRepresented(f"bitmap {file} that is not found")
        dark = read_dark(place)
        rows, columns = (np.flatnonzero(dark.any(axis=axis)) for axis in (1, 0))
        if len(rows) == 0:
            raise NotRepresented(f"bitmap {file} without dark pixels")
        dark = dark[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        cells = rectangles_of(dark)
        if len(cells) > MAX_BOXES:
            raise NotRepresented(f"bitmap {file} of {len(cells)} boxes, at most {MAX_BOXES}")
        shares = cells / np.tile(dark.shape[::-1], 2)
        shares[:, :2] += shares[:, 2:] / 2 - 0.5
        return shares


def _is_solid(entity: Entity) -> bool:
    """Return whether robots touch a model or see it; Stage 3.2 renamed the latter's property."""
    (touched,) = entity.numbers("obstacle_return", (1.0,))
    (seen,) = entity.numbers("ranger_return", entity.numbers("laser_return", (1.0,)))
    return touched != 0.0 or seen > 0.0


def _boundary(thickness: Floats) -> Floats:
    """Return four walls as float64[4, 4], x, y and sizes in shares of the model's size."""
    x, y = thickness
    at_x, at_y = (1.0 - thickness) / 2
    return np.array(
        [(-at_x, 0.0, x, 1.0), (at_x, 0.0, x, 1.0), (0.0, -at_y, 1.0, y), (0.0, at_y, 1.0, y)]
    )


def _sides(blocks: Sequence[Entity]) -> Floats:
    """Return the sides of polygons as triangles, float64[n, 3, 3], in shares of the model's size.

    All blocks together are as large as the model.
    """
    outlines = []
    for block in blocks:
        names = (f"point[{k}]" for k in range(int(block.numbers("points", (0.0,))[0])))
        corners = [block.numbers(name, (0.0, 0.0)) for name in names]
        if len(corners) < 3 or any(len(one) != 2 for one in corners):
            raise NotRepresented(f"{block.place}: block: expected three points or more")
        outlines.append(np.array(corners))
    points = np.concatenate(outlines)
    low, high = points.min(axis=0), points.max(axis=0)
    shares = [(one - low) / np.maximum(high - low, 1e-9) - 0.5 for one in outlines]
    return np.concatenate([prism(one, is_closed=False) for one in shares]) + (0.0, 0.0, 0.5)
