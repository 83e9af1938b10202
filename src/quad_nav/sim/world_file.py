"""Gazebo worlds as obstacles: ``.world`` and ``.sdf`` files, and the models that they include.

Boxes, cylinders, spheres and meshes of the models' collisions become obstacles. A plane at z = 0 is
the floor. Actors with waypoints become moving obstacles, see ``sdf``. A remark names every other
solid that is left out, with the reason. Poses are composed along world, nested models, link and
collision. As in Gazebo, a saved ``<state>`` overrides the poses of models and links.
"""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Dict, Iterator, List, Optional, Sequence, Tuple

from quad_nav.errors import InputError
from quad_nav.files.xml_tree import Element, read_xml
from quad_nav.geometry import Pose3D
from quad_nav.sim.mesh import Floats, NotRepresented, boxes_of, read_triangles
from quad_nav.sim.model_files import find_file, find_map, find_model, model_folders
from quad_nav.sim.obstacles import Box, Obstacle
from quad_nav.sim.scene import MovingObstacle
from quad_nav.sim.sdf import (
    IDENTITY,
    SdfReader,
    actor_of,
    is_true,
    obstacles_of,
)

MAX_OBSTACLES = 100_000
MAX_INCLUDES = 16
"""Depth of included files; without a limit, a file that includes itself never ends."""
MAX_PARTS = 200_000
"""Number of models, links and collisions, included ones too: nested files multiply them."""
MAX_MESH_BYTES = 512 * 1024 * 1024
"""Size of all meshes, each counted once."""
MAX_BYTES = 64 * 1024 * 1024
"""Size of the world and of all files that it includes, each counted once."""

_LONGEST_NAME = 200
_NAMED = 10  # parts in one remark
_OTHER_SOLIDS = ("population", "road")
_LOST = ("mesh", "<include>", "heightmap")
"""Reasons of what a map may have."""
_NOT_FOUND = "that is not found, not in GAZEBO_MODEL_PATH either"


@dataclass(frozen=True)
class World:
    """Obstacles of a world, remarks on solids that are left out, and obstacles that move."""

    obstacles: Tuple[Obstacle, ...]
    remarks: Tuple[str, ...]
    moving: Tuple[MovingObstacle, ...] = ()


class _TooLarge(InputError):
    """A limit for a world as a whole is exceeded; other faults leave a part of it out."""


@dataclass
class Findings:
    """Results so far of reading a world and the files that it includes."""

    obstacles: List[Obstacle] = field(default_factory=list)
    moving: List[MovingObstacle] = field(default_factory=list)
    left_out: Dict[str, List[str]] = field(default_factory=dict)
    not_static: List[str] = field(default_factory=list)
    files: Dict[Path, Element] = field(default_factory=dict)
    meshes: Dict[Path, Floats] = field(default_factory=dict)
    bytes_read: int = 0
    mesh_bytes: int = 0
    parts: int = 0

    def read(self, path: Path) -> Element:
        """Return the root of a file; read a file once even if it is included repeatedly.

        Raises:
            InputError: The file cannot be read, or the files are too large together.
        """
        if path not in self.files:
            self.files[path] = read_xml(path)
            self.bytes_read += path.stat().st_size
            if self.bytes_read > MAX_BYTES:
                problem = f"brings the included files to {self.bytes_read} bytes"
                raise _TooLarge([f"{path}: {problem}, expected {MAX_BYTES} at most"])
        return self.files[path]

    def triangles(self, path: Path) -> Floats:
        """Return the triangles of a mesh file; read a file once."""
        if path not in self.meshes:
            self.mesh_bytes += path.stat().st_size
            if self.mesh_bytes > MAX_MESH_BYTES:
                raise NotRepresented(f"mesh that brings all of them above {MAX_MESH_BYTES} bytes")
            self.meshes[path] = read_triangles(path)
        return self.meshes[path]

    @contextmanager
    def part(self, name: str, path: Path) -> Iterator[None]:
        """Read a model, link or collision; with a fault, or without a shape here, it is left out.

        Raises:
            InputError: There are more than ``MAX_PARTS``.
        """
        self.parts += 1
        if self.parts > MAX_PARTS:
            what = "models, links and collisions, included ones counted"
            raise _TooLarge([f"{path}: more than {MAX_PARTS} {what}"])
        try:
            yield
        except NotRepresented as reason:
            self.leave_out(name, str(reason))
        except _TooLarge:
            raise
        except InputError as error:  # of an included file
            self.leave_out(name, "; ".join(error.problems))

    def leave_out(self, name: str, reason: str) -> None:
        """Keep what is left out, and why."""
        self.left_out.setdefault(reason, []).append(name)

    def remarks(self, path: Path) -> Iterator[str]:
        """Return a line on each reason why solids are left out, and on a map that may have them."""
        for reason, names in self.left_out.items():
            yield f"{path}: {len(names)} left out, {reason}: {listed(names)}"
        place = find_map(path) if any(one.startswith(_LOST) for one in self.left_out) else None
        if place is not None:
            yield f"{path}: what is left out may be in the map {place}: --scene {place}"
        if self.not_static:
            yield f"{path}: not static in Gazebo, but fixed here: {listed(self.not_static)}"


def load_world(path: Path) -> World:
    """Read a world, or a file with models only.

    Raises:
        InputError: The file cannot be read, or is no world, or one of too many parts.
    """
    findings = Findings()
    root = findings.read(path)
    if root.tag not in ("sdf", "gazebo"):
        raise InputError([f"{path}: line {root.line}: <{root.tag}>, expected <sdf>"])
    worlds = list(root.all("world"))
    if len(worlds) > 1:
        raise InputError([f"{path}: line {worlds[1].line}: a second <world>, expected one"])
    walk = _Walk(SdfReader(path), findings, model_folders(path))
    world = worlds[0] if worlds else root
    walk.models(world, IDENTITY, "", world.first("state"))
    for actor in world.all("actor"):
        walk.actor(actor)
    for tag in _OTHER_SOLIDS:
        for element in world.all(tag):
            findings.leave_out(element.attributes.get("name", tag), tag)
    if len(findings.obstacles) > MAX_OBSTACLES:
        shapes = len(findings.obstacles)
        raise InputError([f"{path}: {shapes} shapes, expected {MAX_OBSTACLES} at most"])
    remarks = tuple(findings.remarks(path))
    return World(tuple(findings.obstacles), remarks, tuple(findings.moving))


@dataclass(frozen=True)
class _Walk:
    """Traversal of the models of one file; each included file gets its own."""

    reader: SdfReader
    findings: Findings
    folders: Sequence[Path]
    depth: int = 0

    def models(
        self, parent: Element, map_from_parent: Pose3D, prefix: str, state: Optional[Element]
    ) -> None:
        """Read the models in a world or model, included ones too."""
        for child in parent.children:
            if child.tag not in ("model", "include"):
                continue
            with self.findings.part(prefix + _name_of(child), self.reader.path):
                read = self._include if child.tag == "include" else self._model
                read(child, map_from_parent, prefix, state)

    def actor(self, actor: Element) -> None:
        """Read an actor of the world."""
        name = _name_of(actor)
        with self.findings.part(name, self.reader.path):
            person = actor_of(self.reader, actor, name)
            if isinstance(person, MovingObstacle):
                self.findings.moving.append(person)
            else:
                self.findings.obstacles.append(person)

    def _model(
        self,
        model: Element,
        map_from_parent: Pose3D,
        prefix: str,
        state: Optional[Element],
        included_as: Optional[Element] = None,
    ) -> None:
        name = _name_of(included_as or model, _name_of(model))
        source = model
        if included_as is not None and included_as.first("pose") is not None:
            source = included_as
        if model.attributes.get("placement_frame"):
            raise NotRepresented("placed by a named frame")
        map_from_model = map_from_parent.compose(self.reader.pose(source))
        saved = _state_of(state, "model", name)
        if saved is not None:
            if set(saved.text_of("scale", "1").split()) - {"1", "1.0"}:
                raise NotRepresented("scaled in <state>")
            map_from_model = self.reader.pose(saved, map_from_model)
        static = (included_as.text_of("static") if included_as else "") or model.text_of("static")
        if not prefix and not is_true(static):
            self.findings.not_static.append(name)
        for link in model.all("link"):
            self._link(link, map_from_model, f"{prefix}{name}/", saved)
        self.models(model, map_from_model, f"{prefix}{name}/", saved)

    def _include(
        self, include: Element, map_from_parent: Pose3D, prefix: str, state: Optional[Element]
    ) -> None:
        uri = include.text_of("uri")
        if uri == "model://sun":
            return
        if self.depth >= MAX_INCLUDES:
            raise self.reader.fault(include, f"more than {MAX_INCLUDES} nested files")
        path = find_model(uri, self.folders)
        if path is None:
            if uri == "model://ground_plane":
                return
            self.findings.leave_out(f"{_name_of(include)} ({uri})", f"<include> {_NOT_FOUND}")
            return
        root = self.findings.read(path)
        walk = _Walk(SdfReader(path), self.findings, self.folders, self.depth + 1)
        for model in root.all("model"):
            walk._model(model, map_from_parent, prefix, state, include)

    def _link(
        self, link: Element, map_from_model: Pose3D, prefix: str, state: Optional[Element]
    ) -> None:
        name = prefix + _name_of(link)
        collisions = list(link.all("collision"))
        if not collisions and link.first("visual") is not None:
            self.findings.leave_out(name, "looks without a collision")
        with self.findings.part(name, self.reader.path):
            map_from_link = map_from_model.compose(self.reader.pose(link))
            saved = _state_of(state, "link", _name_of(link))
            if saved is not None:
                map_from_link = self.reader.pose(saved, map_from_link)
            for collision in collisions:
                self._collision(collision, map_from_link, f"{name}/")

    def _collision(self, collision: Element, map_from_link: Pose3D, prefix: str) -> None:
        name = prefix + _name_of(collision)
        with self.findings.part(name, self.reader.path):
            map_from_shape = map_from_link.compose(self.reader.pose(collision))
            geometry = collision.first("geometry") or Element("geometry", {}, collision.line)
            mesh = geometry.first("mesh")
            if mesh is not None:
                self.findings.obstacles += self._mesh(mesh, name, map_from_shape)
                return
            found = obstacles_of(self.reader, geometry, name, map_from_shape)
            self.findings.obstacles += found

    def _mesh(self, mesh: Element, name: str, map_from_mesh: Pose3D) -> List[Box]:
        if mesh.first("submesh") is not None:
            raise NotRepresented("mesh of which a part is named")
        place = find_file(mesh.text_of("uri"), (self.reader.path.parent, *self.folders))
        if place is None:
            raise NotRepresented(f"mesh {_NOT_FOUND}")
        scale = mesh.first("scale")
        factors = self.reader.numbers(scale, 3, "three numbers") if scale else [1.0] * 3
        return boxes_of(name, self.findings.triangles(place) * factors, map_from_mesh)


def listed(names: Sequence[str]) -> str:
    """Return names for a remark, many of them as a number."""
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return f"{', '.join(names[:_NAMED])}{more}"


def _state_of(state: Optional[Element], tag: str, name: str) -> Optional[Element]:
    """Return the element of a model or link in a saved state."""
    if state is None:
        return None
    return next((e for e in state.all(tag) if e.attributes.get("name") == name), None)


def _name_of(element: Element, default: str = "") -> str:
    given = element.text_of("name") if element.tag == "include" else element.attributes.get("name")
    name = given or default or element.text_of("uri").split("/")[-1] or element.tag
    return printable(name)


def printable(name: str) -> str:
    """Return a name as obstacles can have it."""
    return "".join(c if c.isprintable() else "?" for c in name[:_LONGEST_NAME])
