"""Worlds of the simulator Stage as trees of entities.

    include "map.inc"                      # beside the world
    define block model (size [1 1 1])      # a type of one's own
    floorplan (name "cave" size [16 16 0.8] bitmap "cave.png")
    block (pose [2 1 0 45])                # x, y and z in m, heading in degrees

Source: Stage's manual, "World files", and its reader, libstage/worldfile.cc.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Sequence, Tuple

from quad_nav.errors import InputError
from quad_nav.files.user_files import read_bytes
from quad_nav.sim.mesh import NotRepresented
from quad_nav.sim.model_files import find_file
from quad_nav.sim.sdf import MAX_LENGTH_M

MAX_BYTES = 4 * 1024 * 1024
MAX_ENTITIES = 20_000
MAX_INCLUDES = 100
MAX_DEPTH = 50
_TOKEN = re.compile(
    r"""(?P<blank>[ \t\r\n,;]+|\#[^\n]*) | "(?P<string>[^"\n]*)"
    | (?P<number>[-+.0-9][-+.0-9eE]*) | (?P<word>[A-Za-z_][\w.\-\[\]]*) | (?P<sign>[()\[\]])""",
    re.VERBOSE,
)


class Token(NamedTuple):
    """Word, string, number or bracket, whose kind it is itself, with its file and line."""

    kind: str
    text: str
    place: str


@dataclass
class Entity:
    """Model, device or other part of a world.

    Attributes:
        type: Type that Stage knows, or one that no file defines.
        called: Type as the world calls it.
        place: File and line.
        properties: Values of each property.
        parts: Entities in it, such as blocks and other models.
    """

    type: str
    called: str
    place: str
    properties: Dict[str, List[str]] = field(default_factory=dict)
    parts: List[Entity] = field(default_factory=list)

    def text(self, name: str, default: str = "") -> str:
        """Return the first value of a property."""
        return next(iter(self.properties.get(name, ())), default)

    def numbers(self, name: str, default: Sequence[float]) -> List[float]:
        """Return the numbers of a property, up to as many as the default has.

        Raises:
            NotRepresented: One is no number, or too large.
        """
        texts = self.properties.get(name)
        if texts is None:
            return list(default)
        try:
            values = [float(one) for one in texts[: len(default)]]
        except ValueError:
            values = []
        if not values or not all(abs(one) <= MAX_LENGTH_M for one in values):
            problem = f"'{' '.join(texts)}', expected numbers up to {MAX_LENGTH_M:g}"
            raise NotRepresented(f"{self.place}: {name}: {problem}")
        return values


def is_stage(path: Path) -> bool:
    """Return whether a world is one of Stage: those of Gazebo are XML."""
    content = read_bytes(path, MAX_BYTES * 16)
    return path.suffix == ".world" and not content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<")


@dataclass
class StageReader:
    """Reader of a world and the files that it includes.

    Attributes:
        path: The world.
        folders: Where files are that it names.
        missing: Included files that are not found.
    """

    path: Path
    folders: Sequence[Path]
    missing: List[str] = field(default_factory=list)
    _tokens: List[Token] = field(default_factory=list)
    _types: Dict[str, int] = field(default_factory=dict)
    _entities: int = 0
    _includes: int = 0
    _bytes: int = 0

    def read(self) -> Entity:
        """Return the world, whose parts are its models.

        Raises:
            InputError: A file cannot be read, is no world, or they are too large together.
        """
        self._tokens = [*self._read(self.path), Token(")", ")", f"{self.path}: the end")]
        world = Entity("", "", str(self.path))
        end = self._parts_of(world, 0, 0)
        if end < len(self._tokens):
            raise InputError([f"{self._tokens[end - 1].place}: ')', expected '(' before it"])
        return world

    def _read(self, path: Path) -> Iterator[Token]:
        """Return the tokens of a file, of the files that it includes, too."""
        content = read_bytes(path, MAX_BYTES).decode("utf-8-sig", "replace")
        self._bytes += len(content)
        if self._bytes > MAX_BYTES or self._includes > MAX_INCLUDES:
            limit = f"{MAX_BYTES} characters or {MAX_INCLUDES} included files"
            raise InputError([f"{path}: brings the world to more than {limit}"])
        line, at, is_include = 1, 0, False
        while at < len(content):
            match = _TOKEN.match(content, at)
            if match is None:
                expected = "expected a world of Gazebo (XML) or of Stage"
                raise InputError([f"{path}: line {line}: {content[at]!r}, {expected}"])
            kind, at = str(match.lastgroup), match.end()
            text = match.group(kind)
            if is_include and kind == "string":
                yield from self._include(text)
            elif kind != "blank" and text != "include":
                yield Token(text if kind == "sign" else kind, text, f"{path}: line {line}")
            is_include = text == "include" or (is_include and kind == "blank")
            line += match.group().count("\n")

    def _include(self, name: str) -> Iterator[Token]:
        self._includes += 1
        try:
            place = find_file(name, self.folders) or find_file(Path(name).name, self.folders)
        except InputError:  # it leads out of the folders
            place = None
        if place is None:
            self.missing.append(name)
        else:
            yield from self._read(place)

    def _parts_of(self, entity: Entity, at: int, depth: int) -> int:
        """Read the properties and parts of an entity up to its end; return the token after it."""
        while at < len(self._tokens):
            token = self._tokens[at]
            if token.kind == ")":
                return at + 1
            if token.kind != "word":
                raise InputError([f"{token.place}: '{token.text}', expected a word or ')'"])
            if token.text == "define":
                at = self._define(at)
            elif self._tokens[at + 1].kind == "(":
                part, at = self._entity(at, depth + 1)
                entity.parts.append(part)
            else:
                entity.properties[token.text], at = self._values(at + 1)
        last = entity.parts[-1]  # the world's own ')' has ended it
        raise InputError([f"{last.place}: {last.called}, expected ')' after its properties"])

    def _entity(self, at: int, depth: int) -> Tuple[Entity, int]:
        """Read an entity, for a defined type on top of what its definition gives it."""
        name = self._tokens[at]
        self._entities += 1
        if self._entities > MAX_ENTITIES or depth > MAX_DEPTH:
            limits = f"{MAX_ENTITIES} entities or {MAX_DEPTH} inside each other"
            raise InputError([f"{name.place}: more than {limits}"])
        if name.text in self._types:
            entity, _ = self._entity(self._types[name.text], depth + 1)
            entity.called, entity.place = name.text, name.place
        else:
            entity = Entity(name.text, name.text, name.place)
        return entity, self._parts_of(entity, at + 2, depth)

    def _define(self, at: int) -> int:
        """Keep where a type is defined; return the token after the definition."""
        kinds = [token.kind for token in self._tokens[at : at + 4]]
        if kinds != ["word", "word", "word", "("]:
            problem = "expected 'define', a name, a type and '('"
            raise InputError([f"{self._tokens[at].place}: {problem}"])
        self._types.setdefault(self._tokens[at + 1].text, at + 2)
        end, inside = at + 4, 1
        while inside and end < len(self._tokens):
            inside += {"(": 1, ")": -1}.get(self._tokens[end].kind, 0)
            end += 1
        return end

    def _values(self, at: int) -> Tuple[List[str], int]:
        """Return a value, or those between brackets, and the token after them."""
        first = end = at + (self._tokens[at].kind == "[")
        while self._tokens[end].kind in ("number", "string") and (end == at or first > at):
            end += 1
        if end == at or (first > at and self._tokens[end].kind != "]"):
            token = self._tokens[end]
            raise InputError([f"{token.place}: '{token.text}', expected a number or a string"])
        return [token.text for token in self._tokens[first:end]], end + (first > at)
