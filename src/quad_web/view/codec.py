"""One message to the page: a JSON header and the bytes of arrays.

A message is the length of the header (uint32, little-endian), the header (UTF-8, padded with spaces
until the arrays begin at a multiple of 8 bytes), and the arrays one after the other, each padded to
a multiple of 8 bytes. The header is::

    {"items": [{"key": "poses", "data": {...},
                "arrays": [{"name": "pose", "type": "f4", "shape": [2, 9], "offset": 0,
                            "bytes": 72, "deflated": false}]}],
     "removed": ["plan/3"], ...}

Offsets count from the first array. ``bytes`` is the length in the message. A deflated array is
compressed in the zlib format.
"""

from __future__ import annotations

import json
import struct
import weakref
import zlib
from typing import Any, Dict, Iterable, List, Mapping, MutableMapping, NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_web.view.state import Item

_LENGTH = struct.Struct("<I")
_ALIGNMENT = 8
_TYPES = {"f4": np.float32, "f8": np.float64, "i1": np.int8, "u1": np.uint8, "i4": np.int32}
_NAMES = {np.dtype(kind): name for name, kind in _TYPES.items()}
_DEFLATE_FROM = 4096
_DEFLATED_TYPES = ("i1", "u1")  # costmaps are flat; floats hardly become smaller
_FASTEST = 1


def encode(items: Iterable[Item], removed: Iterable[str] = (), **header: Any) -> bytes:
    """Return a message. An item that goes to several clients is encoded once.

    Args:
        items: Items that are new or have changed.
        removed: Keys of items that are no longer there.
        header: Further entries of the header.

    Raises:
        ValueError: An array has a type that the page does not know, or a number of the header or
            of an item's data is not finite.
    """
    entries: List[str] = []
    chunks: List[bytes] = []
    offset = 0
    for item in items:
        encoded = _encoded(item)
        entries.append(encoded.entry(offset))
        chunks.extend(encoded.chunks)
        offset += encoded.length
    rest = _json({**header, "removed": list(removed)})
    text = f'{{"items":[{",".join(entries)}],{rest[1:]}'.encode()
    text += b" " * (-(_LENGTH.size + len(text)) % _ALIGNMENT)
    return b"".join((_LENGTH.pack(len(text)), text, *chunks))


def decode(message: bytes) -> Tuple[Dict[str, Any], Dict[str, Mapping[str, NDArray[Any]]]]:
    """Return a message's header, and the arrays of its items by key and name.

    The page has the same in ``static/link.js``; tests and benches use this one.
    """
    (length,) = _LENGTH.unpack_from(message)
    header = json.loads(message[_LENGTH.size : _LENGTH.size + length])
    start = _LENGTH.size + length
    arrays: Dict[str, Mapping[str, NDArray[Any]]] = {}
    for item in header["items"]:
        arrays[item["key"]] = {
            described["name"]: _decoded(described, message, start) for described in item["arrays"]
        }
    return header, arrays


class _Encoded(NamedTuple):
    """An item's key and data as JSON, and its arrays: their content and their descriptions.

    The descriptions lack the offset, which depends on the items before.
    """

    start: str
    arrays: Tuple[str, ...]
    chunks: Tuple[bytes, ...]
    length: int

    def entry(self, offset: int) -> str:
        """Return the item's entry of the header; its first array is at an offset."""
        described = []
        for array, chunk in zip(self.arrays, self.chunks):
            described.append(f'{array},"offset":{offset}}}')
            offset += len(chunk)
        return f'{self.start},"arrays":[{",".join(described)}]}}'


# Items live until the state has newer ones.
_encoded_items: MutableMapping[Item, _Encoded] = weakref.WeakKeyDictionary()


def _encoded(item: Item) -> _Encoded:
    encoded = _encoded_items.get(item)
    if encoded is None:
        arrays = [_encoded_array(name, array) for name, array in item.arrays.items()]
        chunks = tuple(chunk for _, chunk in arrays)
        encoded = _Encoded(
            _json({"key": item.key, "data": item.data})[:-1],
            tuple(text for text, _ in arrays),
            chunks,
            sum(map(len, chunks)),
        )
        _encoded_items[item] = encoded
    return encoded


def _json(document: Any) -> str:
    return json.dumps(document, separators=(",", ":"), allow_nan=False)


def _encoded_array(name: str, array: NDArray[Any]) -> Tuple[str, bytes]:
    """Return an array's description as JSON without its end, and its padded content."""
    type_name = _NAMES.get(array.dtype)
    if type_name is None:
        raise ValueError(f"{name}: type {array.dtype}; expected one of {', '.join(_TYPES)}")
    content = np.ascontiguousarray(array).tobytes()
    is_deflated = type_name in _DEFLATED_TYPES and len(content) >= _DEFLATE_FROM
    if is_deflated:
        content = zlib.compress(content, _FASTEST)
    description = {
        "name": name,
        "type": type_name,
        "shape": list(array.shape),
        "bytes": len(content),
        "deflated": is_deflated,
    }
    return _json(description)[:-1], content + b"\0" * (-len(content) % _ALIGNMENT)


def _decoded(described: Mapping[str, Any], message: bytes, start: int) -> NDArray[Any]:
    first = start + described["offset"]
    content = message[first : first + described["bytes"]]
    if described["deflated"]:
        content = zlib.decompress(content)
    return np.frombuffer(content, _TYPES[described["type"]]).reshape(described["shape"])
