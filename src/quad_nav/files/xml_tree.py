"""XML files as trees of elements with line numbers; the only module that imports defusedxml.

Entities and document type definitions are refused: with them a small file can fill the memory or
read other files.
"""

from __future__ import annotations

import re
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
_DECLARATION = re.compile(rb"<\?xml\s[^<>]*>")


@dataclass
class Element:
    """Element of an XML file; ``line`` is the one on which it starts."""

    tag: str
    attributes: Dict[str, str]
    line: int
    text: str = ""
    children: List[Element] = field(default_factory=list)

    @property
    def size(self) -> int:
        """Number of elements, itself included."""
        return 1 + sum(child.size for child in self.children)

    def all(self, tag: str) -> Iterator[Element]:
        """Return the children with a tag."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Optional[Element]:
        """Return the first child with a tag, None if there is none."""
        return next(self.all(tag), None)

    def text_of(self, tag: str, default: str = "") -> str:
        """Return the text of the first child with a tag."""
        child = self.first(tag)
        return default if child is None else child.text.strip()


def read_xml(path: Path, max_elements: int = MAX_ELEMENTS) -> Element:
    """Read an XML file of at most ``max_elements`` and return its root element.

    Raises:
        InputError: The file cannot be read, is not XML, or is too large; with the line.
    """
    builder = _Builder(path, max_elements)
    content = read_bytes(path, MAX_BYTES)
    if not content.startswith(b"<?xml"):  # some have blanks or a comment before it
        content = _DECLARATION.sub(b"", content, count=1)
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
    def __init__(self, path: Path, max_elements: int) -> None:
        super().__init__()
        self._path = path
        self._max_elements = max_elements
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
        if self._elements > self._max_elements:
            raise InputError(
                [f"{self._path}: line {self.line}: more than {self._max_elements} elements"]
            )
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
