"""Gazebo worlds as obstacles: ``.world`` and ``.sdf`` files, and the models that they include.

Boxes, cylinders and spheres of the models' collisions become obstacles. A plane at z = 0 is the
floor. Actors with waypoints become moving obstacles, see ``sdf``. A remark names every other
solid that is left out, with the reason. Poses are composed along world, nested models, link and
collision. As in Gazebo, a saved ``<state>`` overrides the poses of models and links.
"""

from __future__ import annotations

import os
import re
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Dict, Iterator, List, Optional, Sequence, Tuple

from quad_nav.errors import InputError
from quad_nav.files.user_files import referenced_file
from quad_nav.files.xml_tree import Element, read_xml
from quad_nav.geometry import Pose3D
from quad_nav.sim.obstacles import Obstacle
from quad_nav.sim.scene import MovingObstacle
from quad_nav.sim.sdf import (
    IDENTITY,
    NotRepresented,
    SdfReader,
    actor_of,
    is_true,
    obstacle_of,
)

MAX_OBSTACLES = 100_000
MAX_INCLUDES = 16
"""Depth of included files; without a limit, a file that includes itself never ends."""
MAX_PARTS = 200_000
"""Number of models, links and collisions, included ones too: nested files multiply them."""
MAX_BYTES = 64 * 1024 * 1024
"""Size of the world and of all files that it includes, each counted once."""

_LONGEST_NAME = 200
_NAMED = 10  # parts in one remark
_SCHEME = "model://"
_OTHER_SOLIDS = ("population", "road")


@dataclass(frozen=True)
class GazeboWorld:
    """Obstacles of a world, remarks on solids that are left out, and obstacles that move."""

    obstacles: Tuple[Obstacle, ...]
    remarks: Tuple[str, ...]
    moving: Tuple[MovingObstacle, ...] = ()


@dataclass
class _Findings:
    """Results so far of reading a world and the files that it includes."""

    obstacles: List[Obstacle] = field(default_factory=list)
    moving: List[MovingObstacle] = field(default_factory=list)
    left_out: Dict[str, List[str]] = field(default_factory=dict)
    not_static: List[str] = field(default_factory=list)
    files: Dict[Path, Element] = field(default_factory=dict)
    bytes_read: int = 0
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
                raise InputError([f"{path}: {problem}, expected {MAX_BYTES} at most"])
        return self.files[path]

    @contextmanager
    def part(self, name: str, path: Path) -> Iterator[None]:
        """Read a model, link or collision, which is left out if no obstacle represents it.

        Raises:
            InputError: There are more than ``MAX_PARTS``.
        """
        self.parts += 1
        if self.parts > MAX_PARTS:
            what = "models, links and collisions, included ones counted"
            raise InputError([f"{path}: more than {MAX_PARTS} {what}"])
        try:
            yield
        except NotRepresented as reason:
            self.leave_out(name, str(reason))

    def leave_out(self, name: str, reason: str) -> None:
        self.left_out.setdefault(reason, []).append(name)


def load_world(path: Path, model_path: Sequence[Path] = ()) -> GazeboWorld:
    """Read a world, or a file with models only.

    ``<include>`` looks for ``model://`` beside the file, in the folders ``models`` there and one
    level up, and in the folders of ``model_path``.

    Raises:
        InputError: The file cannot be read, or is no world, or one of too many parts.
    """
    findings = _Findings()
    root = findings.read(path)
    if root.tag not in ("sdf", "gazebo"):
        raise InputError([f"{path}: line {root.line}: <{root.tag}>, expected <sdf>"])
    worlds = list(root.all("world"))
    if len(worlds) > 1:
        raise InputError([f"{path}: line {worlds[1].line}: a second <world>, expected one"])
    folders = (path.parent, path.parent / "models", path.parent.parent / "models", *model_path)
    walk = _Walk(SdfReader(path), findings, folders)
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
    found = {
        f"{len(names)} left out, {reason}": names for reason, names in findings.left_out.items()
    }
    if findings.not_static:
        found["not static in Gazebo, but fixed here"] = findings.not_static
    remarks = tuple(f"{path}: {what}: {_listed(names)}" for what, names in found.items())
    return GazeboWorld(tuple(findings.obstacles), remarks, tuple(findings.moving))


@dataclass(frozen=True)
class _Walk:
    """Traversal of the models of one file; each included file gets its own."""

    reader: SdfReader
    findings: _Findings
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
            raise NotRepresented(f"<include> of {uri or 'nothing'}, not found")
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
            obstacle = obstacle_of(self.reader, geometry, name, map_from_shape)
            if obstacle is not None:
                self.findings.obstacles.append(obstacle)


def _listed(names: Sequence[str]) -> str:
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
    return "".join(c if c.isprintable() else "?" for c in name[:_LONGEST_NAME])


def find_model(uri: str, folders: Sequence[Path]) -> Optional[Path]:
    """Return the SDF file of a model in the first folder that has it, None if none has.

    ``model://name`` is a folder. Its ``model.config`` names the file, or several, of which the one
    with the highest version counts. Without ``model.config``, or with one that is no XML, it is
    ``model.sdf``. URIs that lead out of the folders are not found.

    Raises:
        InputError: A link or a ``model.config`` leads out of the folders.
    """
    name = PurePosixPath(uri[len(_SCHEME) :] if uri.startswith(_SCHEME) else uri)
    if "://" in str(uri[len(_SCHEME) :]) or name.is_absolute() or ".." in name.parts:
        return None
    if not name.parts:
        return None
    for folder in folders:
        place = folder / name
        if not os.path.exists(place):  # Path.exists raises where a name is too long
            continue
        referenced_file(folder, str(name), folders)
        path = _sdf_in(place, folders) if place.is_dir() else place
        if os.path.exists(path):
            return path
    return None


def _sdf_in(folder: Path, folders: Sequence[Path]) -> Path:
    config = folder / "model.config"
    try:
        files = list(read_xml(config).all("sdf")) if config.exists() else []
    except InputError:  # many have an & in their descriptions; Gazebo's own reader goes on, too
        files = []
    named = [(_version(sdf.attributes.get("version", "")), sdf.text.strip()) for sdf in files]
    return referenced_file(folder, max(named)[1] if named else "model.sdf", folders)


def _version(text: str) -> Tuple[int, ...]:
    return tuple(int(part) for part in text.split(".") if re.fullmatch("[0-9]{1,9}", part))
