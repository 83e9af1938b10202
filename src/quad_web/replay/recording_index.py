"""Find messages of a recording by topic and time, without reading the others.

The index has 24 bytes for each message; a few unpacked chunks stay in memory.
"""

from __future__ import annotations

import collections
from pathlib import Path
from typing import Dict, List, Optional, OrderedDict, Tuple

import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag1 import Reader, ReaderError

from quad_nav.recording.bag_file import Message, TopicFilter, recording_faults, wanted_kinds
from quad_nav.recording.messages import decode

_KEPT_BYTES = 64 * 2**20  # of unpacked chunks
_CONNECTION = 7  # op of a bag's record that describes a topic


class RecordingIndex:
    """Random access to the messages of the wanted topics.

    Attributes:
        kinds: Topics and their types, such as ``nav_msgs/Path``.
    """

    def __init__(self, path: Path, wanted: TopicFilter) -> None:
        """Read the index of a file.

        Raises:
            InputError: The file is not a recording, is damaged or was not completed.
        """
        self._path = path
        self.kinds: Dict[str, str] = {}
        self._kept: OrderedDict[int, bytes] = collections.OrderedDict()
        places: Dict[str, List[Tuple[int, int, int]]] = {}
        with recording_faults(path):
            self._reader = Reader(path)
            self._reader.open()
            kinds = wanted_kinds(path, self._reader, wanted)
            for connection in self._reader.connections:
                if connection.id in kinds:
                    topic = connection.topic
                    self.kinds[topic] = kinds[connection.id]
                    places.setdefault(topic, []).extend(self._reader.indexes[connection.id])
            self._reader.indexes.clear()  # large, and not needed any more
            self._places = {topic: _sorted(entries) for topic, entries in places.items()}

    def times_ns(self, topic: str) -> NDArray[np.int64]:
        """Return the times of recording of a topic's messages, int64[n], in order."""
        return self._places[topic][:, 0]

    def read(self, topic: str, number: int) -> Message:
        """Read a message by its number in the topic, from 0.

        Raises:
            InputError: The file is damaged there, or cannot be read.
        """
        stamp_ns, chunk, offset = self._places[topic][number].tolist()
        kind = self.kinds[topic]
        with recording_faults(self._path):
            data = _content(self._unpacked(chunk), offset)
            return Message(topic, kind, stamp_ns, decode(data, kind))

    def close(self) -> None:
        """Close the file."""
        self._reader.close()

    def _unpacked(self, chunk: int) -> bytes:
        if chunk in self._kept:
            self._kept.move_to_end(chunk)
            return self._kept[chunk]
        data = self._kept[chunk] = self._read_chunk(chunk)
        while len(self._kept) > 1 and sum(map(len, self._kept.values())) > _KEPT_BYTES:
            self._kept.popitem(last=False)
        return data

    def _read_chunk(self, chunk: int) -> bytes:
        place = self._reader.chunks[chunk]
        file = self._reader.bio
        assert file is not None
        file.seek(place.datapos)
        data = file.read(place.datasize)
        if len(data) < place.datasize:
            raise ReaderError(f"Got only {len(data)} of requested {place.datasize} bytes, damaged.")
        unpacked: bytes = place.decompressor(data)
        return unpacked


def _content(data: bytes, offset: int) -> bytes:
    """Return the serialized message at an offset of a chunk."""
    while True:
        header, offset = _field(data, offset)
        content, offset = _field(data, offset)
        if _op(header) != _CONNECTION:
            return content


def _field(data: bytes, offset: int) -> Tuple[bytes, int]:
    """Return a field that its length precedes, and where the next one begins."""
    end = offset + 4 + int.from_bytes(data[offset : offset + 4], "little")
    if end > len(data):
        raise ReaderError("Header of a message is damaged.")
    return data[offset + 4 : end], end


def _op(header: bytes) -> Optional[int]:
    """Return the kind of a bag's record."""
    offset = 0
    while offset < len(header):
        entry, offset = _field(header, offset)
        name, _, value = entry.partition(b"=")
        if name == b"op":
            return value[0]
    raise ReaderError("Header of a message is damaged.")


def _sorted(places: List[Tuple[int, int, int]]) -> NDArray[np.int64]:
    """Return places int64[n, 3] in the order of time."""
    array = np.array(places, dtype=np.int64).reshape(-1, 3)
    return array[np.argsort(array[:, 0], kind="stable")]
