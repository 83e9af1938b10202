"""Find messages of a recording by topic and time, without reading the others.

The index has 24 bytes for each message; a few unpacked chunks stay in memory.
"""

from __future__ import annotations

import collections
from pathlib import Path
from typing import Dict, List, Optional, OrderedDict, Protocol, Tuple

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Chunk, MessageIndex
from mcap.stream_reader import get_chunk_data_stream
from numpy.typing import NDArray
from rosbags.rosbag1 import Reader, ReaderError

from quad_nav.recording.bag_file import Message, TopicFilter, message_kind, recording_faults
from quad_nav.recording.messages import decode

_KEPT_BYTES = 64 * 2**20  # of unpacked chunks
_CONNECTION = 7  # op of a bag's record that describes a topic
_OPCODE_AND_LENGTH = 1 + 8  # of an MCAP record
_MESSAGE_HEAD = 2 + 4 + 8 + 8  # channel, sequence, log time, publish time


class _Chunks(Protocol):
    """Chunks of a file, and the places of its messages."""

    kinds: Dict[str, str]
    places: Dict[str, List[Tuple[int, int, int]]]  # topic -> time, chunk, offset in it

    def unpacked(self, chunk: int) -> bytes:
        """Read a chunk."""

    def content(self, data: bytes, offset: int) -> bytes:
        """Return the serialized message at an offset of a chunk."""

    def close(self) -> None:
        """Close the file."""


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
        with recording_faults(path):
            make = _McapChunks if path.suffix == ".mcap" else _BagChunks
            self._chunks: _Chunks = make(path, wanted)
            self._places = {topic: _sorted(places) for topic, places in self._chunks.places.items()}
        self._chunks.places = {}
        self.kinds = self._chunks.kinds
        self._kept: OrderedDict[int, bytes] = collections.OrderedDict()

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
            data = self._chunks.content(self._unpacked(chunk), offset)
            return Message(topic, kind, stamp_ns, decode(data, kind))

    def close(self) -> None:
        """Close the file."""
        self._chunks.close()

    def _unpacked(self, chunk: int) -> bytes:
        if chunk in self._kept:
            self._kept.move_to_end(chunk)
            return self._kept[chunk]
        data = self._kept[chunk] = self._chunks.unpacked(chunk)
        while len(self._kept) > 1 and sum(map(len, self._kept.values())) > _KEPT_BYTES:
            self._kept.popitem(last=False)
        return data


class _BagChunks:
    """Chunks of a ROS 1 bag."""

    def __init__(self, path: Path, wanted: TopicFilter) -> None:
        self._reader = Reader(path)
        self._reader.open()
        self.kinds: Dict[str, str] = {}
        self.places: Dict[str, List[Tuple[int, int, int]]] = {}
        for connection in self._reader.connections:
            topic, kind = connection.topic, message_kind(connection.msgtype)
            if wanted(topic, kind):
                self.kinds[topic] = kind
                self.places.setdefault(topic, []).extend(self._reader.indexes[connection.id])
        self._reader.indexes.clear()  # large, and not needed any more

    def unpacked(self, chunk: int) -> bytes:
        at = self._reader.chunks[chunk]
        file = self._reader.bio
        assert file is not None
        file.seek(at.datapos)
        data = file.read(at.datasize)
        if len(data) < at.datasize:
            raise ReaderError(f"Got only {len(data)} of requested {at.datasize} bytes, damaged.")
        unpacked: bytes = at.decompressor(data)
        return unpacked

    def content(self, data: bytes, offset: int) -> bytes:
        while True:
            header, offset = _field(data, offset)
            content, offset = _field(data, offset)
            if _op(header) != _CONNECTION:
                return content

    def close(self) -> None:
        self._reader.close()


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


class _McapChunks:
    """Chunks of an MCAP file with ROS 1 messages."""

    def __init__(self, path: Path, wanted: TopicFilter) -> None:
        self._file = path.open("rb")
        summary = make_reader(self._file).get_summary()
        if summary is None:
            raise McapError("no index, the recording was not completed")
        self.kinds = {
            channel.topic: summary.schemas[channel.schema_id].name
            for channel in summary.channels.values()
            if channel.message_encoding == "ros1"
            and wanted(channel.topic, summary.schemas[channel.schema_id].name)
        }
        self.places: Dict[str, List[Tuple[int, int, int]]] = {topic: [] for topic in self.kinds}
        for chunk in summary.chunk_indexes:
            for channel, at in chunk.message_index_offsets.items():
                places = self.places.get(summary.channels[channel].topic)
                if places is not None:
                    start = chunk.chunk_start_offset
                    places += [(time, start, offset) for time, offset in self._index(at)]

    def _index(self, offset: int) -> List[Tuple[int, int]]:
        self._file.seek(offset + _OPCODE_AND_LENGTH)
        return MessageIndex.read(ReadDataStream(self._file)).records

    def unpacked(self, chunk: int) -> bytes:
        self._file.seek(chunk + _OPCODE_AND_LENGTH)
        stream, length = get_chunk_data_stream(Chunk.read(ReadDataStream(self._file)))
        return stream.read(length)

    def content(self, data: bytes, offset: int) -> bytes:
        start = offset + _OPCODE_AND_LENGTH
        end = start + int.from_bytes(data[offset + 1 : start], "little")
        if end > len(data):
            raise McapError("Header of a message is damaged")
        return data[start + _MESSAGE_HEAD : end]

    def close(self) -> None:
        self._file.close()


def _sorted(places: List[Tuple[int, int, int]]) -> NDArray[np.int64]:
    """Return places int64[n, 3] in the order of time."""
    array = np.array(places, dtype=np.int64).reshape(-1, 3)
    return array[np.argsort(array[:, 0], kind="stable")]
