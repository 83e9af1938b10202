"""Reads recordings of ROS 1 messages: bags, and MCAP with the same bytes in it."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Dict, Iterator, NamedTuple, Tuple

from mcap.exceptions import McapError
from mcap.reader import make_reader
from rosbags.rosbag1 import Reader, ReaderError

from quad_nav.errors import InputError
from quad_nav.files.user_files import open_file
from quad_nav.recording.messages import decode

Wanted = Callable[[str, str], bool]
"""Whether a topic of a type, as ``nav_msgs/Path``, is to be read."""


class Message(NamedTuple):
    """``stamp_ns`` is when it was recorded."""

    topic: str
    kind: str
    stamp_ns: int
    content: Any


def read_messages(path: Path, wanted: Wanted) -> Iterator[Message]:
    """The messages of the wanted topics by the time that they were recorded.

    One chunk is in memory at a time; what is not wanted is not decoded.

    Raises:
        InputError: no recording, or one that is damaged or was not completed.
    """
    open_file(path).close()  # not a pipe, which the libraries would wait for
    read = _read_mcap if path.suffix == ".mcap" else _read_bag
    try:
        for topic, kind, stamp_ns, data in read(path, wanted):
            yield Message(topic, kind, stamp_ns, decode(data, kind))
    except OSError as error:
        raise InputError(
            [f"{path}: cannot be read: {error.strerror or error}; expected a recorded flight"]
        ) from error
    except (ReaderError, McapError) as error:
        raise InputError([f"{path}: {_why(error)}"]) from error
    except MemoryError:
        raise
    except Exception as error:
        # What the two libraries raise for damaged files is not their own errors alone:
        # struct's, lz4's and AssertionError are among it.
        raise InputError(
            [f"{path}: is damaged ({type(error).__name__}: {error}); expected a recorded flight"]
        ) from error


_Raw = Tuple[str, str, int, bytes]


def _read_bag(path: Path, wanted: Wanted) -> Iterator[_Raw]:
    with Reader(path) as reader:
        kinds: Dict[int, str] = {}
        for connection in reader.connections:
            kind = connection.msgtype.replace("/msg/", "/")
            if wanted(connection.topic, kind):
                kinds[connection.id] = kind
        connections = [c for c in reader.connections if c.id in kinds]
        if connections:  # an empty list would mean all of them
            for connection, stamp_ns, data in reader.messages(connections):
                yield connection.topic, kinds[connection.id], stamp_ns, data


def _read_mcap(path: Path, wanted: Wanted) -> Iterator[_Raw]:
    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        if summary is None:
            raise McapError("has no index, so it was not completed")
        topics = [
            channel.topic
            for channel in summary.channels.values()
            if channel.message_encoding == "ros1"
            and wanted(channel.topic, summary.schemas[channel.schema_id].name)
        ]
        if topics:
            for schema, channel, message in reader.iter_messages(topics):
                assert schema is not None
                yield channel.topic, schema.name, message.log_time, message.data


def _why(error: Exception) -> str:
    said = str(error).rstrip(".")
    if "not indexed" in said:
        return "has no index, so its recording was not completed; `rosbag reindex` fixes it"
    if "damaged" in said or "Header" in said:
        return f"is cut short or damaged ({said}); expected a complete bag, `rosbag reindex` helps"
    return f"is no recording that can be read ({said}); expected a ROS 1 bag or MCAP"
