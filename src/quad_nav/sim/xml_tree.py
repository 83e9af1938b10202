"""XML files as trees whose elements know their line, the only file that imports defusedxml.

Entities and document type definitions are refused: they can make a small file fill
the memory or read other files.
"""

from __future__ import annotations

import xml.sax
from dataclasses import dataclass, field
from pathlib import Path
from typing import Dict, Iterator, List, Optional
from xml.sax.handler import ContentHandler
from xml.sax.xmlreader import AttributesImpl, Locator

import defusedxml.sax
from defusedxml.common import DefusedXmlException

from quad_nav.errors import InputError
from quad_nav.files.user_files import read_bytes

MAX_BYTES = 32 * 1024 * 1024
MAX_DEPTH = 100
MAX_ELEMENTS = 1_000_000


@dataclass
class Element:
    """One element: its name, attributes, text, the elements in it and where it starts."""

    tag: str
    attributes: Dict[str, str]
    line: int
    text: str = ""
    children: List[Element] = field(default_factory=list)

    def all(self, tag: str) -> Iterator[Element]:
        """The elements directly in it that are called ``tag``."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Optional[Element]:
        return next(self.all(tag), None)

    def text_of(self, tag: str, default: str = "") -> str:
        """The text of the first such element in it."""
        child = self.first(tag)
        return default if child is None else child.text.strip()


def read_xml(path: Path) -> Element:
    """The root element of a file. Raises ``InputError`` with the line if it is not XML."""
    builder = _Builder(path)
    content = read_bytes(path, MAX_BYTES)
    try:
        defusedxml.sax.parseString(content, builder, forbid_dtd=True)
    except DefusedXmlException as error:
        raise InputError(
            [
                f"{path}: line {builder.line}: DOCTYPE and entities are refused, "
                "expected XML without them"
            ]
        ) from error
    except xml.sax.SAXParseException as error:
        raise InputError(
            [
                f"{path}: line {error.getLineNumber()}, column "
                f"{(error.getColumnNumber() or 0) + 1}: {error.getMessage()}"
            ]
        ) from error
    return builder.root


class _Builder(ContentHandler):
    def __init__(self, path: Path):
        super().__init__()
        self._path = path
        self._open: List[Element] = []
        self._texts: List[List[str]] = []
        self._elements = 0
        self.root = Element("", {}, 0)

    @property
    def line(self) -> int:
        return self._place.getLineNumber() or 1

    def setDocumentLocator(self, locator: Locator) -> None:
        self._place = locator

    def startElement(self, name: str, attrs: AttributesImpl) -> None:
        element = Element(name, dict(attrs.items()), self.line)
        self._elements += 1
        if self._elements > MAX_ELEMENTS:
            raise InputError([f"{self._path}: line {self.line}: more than {MAX_ELEMENTS} elements"])
        if len(self._open) >= MAX_DEPTH:
            raise InputError(
                [
                    f"{self._path}: line {self.line}: more than {MAX_DEPTH} elements "
                    "inside each other"
                ]
            )
        if self._open:
            self._open[-1].children.append(element)
        else:
            self.root = element
        self._open.append(element)
        self._texts.append([])

    def endElement(self, name: str) -> None:
        self._open.pop().text = "".join(self._texts.pop())

    def characters(self, content: str) -> None:
        self._texts[-1].append(content)
