"""Write ROS messages to ROS 1 bags.

A bag is written as ``<name>.active``, as ``rosbag record`` does, and renamed when it is
complete. Until then an older recording of that name stays in place.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import Any, Dict, Optional

import lz4.frame
from rosbags.rosbag1 import Writer

from quad_nav.errors import InputError
from quad_nav.files.output import make_folder
from quad_nav.recording.messages import definition, encode, long_name
from quad_nav.scenario.rules import START_S

SUFFIX = ".bag"


def create(path: Path) -> BagWriter:
    """Create a recording.

    Raises:
        InputError: The name has another suffix, or the file cannot be created.
    """
    if path.suffix != SUFFIX:
        raise InputError(
            [f"{path}: unknown recording format; expected a name that ends with {SUFFIX}"]
        )
    active = path.with_name(path.name + ".active")
    try:
        if path.is_dir():
            raise IsADirectoryError(None, "is a folder")
        make_folder(path.parent)
        with contextlib.suppress(FileNotFoundError):
            active.unlink()
        return BagWriter(path, active)
    except OSError as error:
        raise InputError(
            [f"{path}: cannot write the recording: {error.strerror}; expected a writable file"]
        ) from error


class BagWriter:
    """ROS 1 bag in LZ4 chunks of 1 MiB; takes messages in the order of their stamps."""

    def __init__(self, path: Path, active: Path) -> None:
        self._path, self._active = path, active
        self._writer = Writer(active)
        self._writer.set_compression(Writer.CompressionFormat.LZ4)
        self._writer.compressor = _compressed
        self._error: Optional[OSError] = None
        self._writer.open()

    def add_topic(self, topic: str, kind: str, latched: bool, node: str) -> Any:
        """Return a topic's handle for ``write``; ``kind`` is a type such as ``nav_msgs/Path``.

        Raises:
            OSError: The file cannot be written.
        """
        text, digest = definition(kind)
        return self._writer.add_connection(
            topic, long_name(kind), msgdef=text, md5sum=digest, callerid=node, latching=int(latched)
        )

    def write(self, handle: Any, stamp_ns: int, data: bytes) -> None:
        """Append one serialized message.

        Raises:
            OSError: The file cannot be written; ``close`` shortens the bag.
        """
        try:
            self._writer.write(handle, stamp_ns, data)
        except OSError as error:
            self._error = error
            raise

    def close(self) -> None:
        """Complete the bag; after a write error, without its newest chunks.

        Raises:
            OSError: Part of the recording is lost. The rest is readable.
        """
        try:
            if self._error is None:
                self._writer.close()
        except OSError as error:
            self._error = error
        if self._error is not None:
            self._close_shortened()
        os.replace(self._active, self._path)
        if self._error is not None:
            raise self._error

    def _close_shortened(self) -> None:
        """Drop the newest chunks of a full disk until the index fits."""
        writer = self._writer
        while True:
            chunks = [chunk for chunk in writer.chunks if chunk.pos != -1]
            lost = chunks.pop() if chunks else None
            if writer.bio is not None:
                with contextlib.suppress(OSError):
                    writer.bio.close()  # its buffer does not fit on the disk
            if lost is None:
                self._active.unlink()
                raise OSError(None, "no room for a single chunk")
            writer.bio = self._active.open("r+b")
            writer.bio.truncate(lost.pos)
            writer.bio.seek(lost.pos)
            writer.chunks[:] = chunks
            with contextlib.suppress(OSError):
                writer.close()
                return


def _compressed(data: bytes) -> bytes:
    """Compress to the only kind of LZ4 that ROS reads; ``rosbag play`` refuses rosbags' own."""
    packed: bytes = lz4.frame.compress(
        data, block_linked=False, content_checksum=True, store_size=False
    )
    return packed


START_NS = round(START_S * 1e9)


def stamp_at(time_s: float) -> int:
    """Convert a time of the flight to nanoseconds on the recording's clock."""
    return round(time_s * 1e9) + START_NS


class TopicWriter:
    """Writes messages by topic; announces each topic with its first message.

    After a write error it drops all further messages, and ``problem`` holds the reason.
    """

    def __init__(self, file: BagWriter) -> None:
        self._file = file
        self._handles: Dict[str, Any] = {}
        self.problem = ""

    def write(self, topic: str, stamp: int, content: Any, node: str, latched: bool = False) -> None:
        """Serialize a message of ``messages.message`` and append it."""
        self.write_bytes(
            topic, content.__msgtype__.replace("/msg/", "/"), stamp, encode(content), node, latched
        )

    def write_bytes(
        self, topic: str, kind: str, stamp: int, data: bytes, node: str, latched: bool = False
    ) -> None:
        """Append a serialized message of type ``kind``."""
        if self.problem:
            return
        try:
            if topic not in self._handles:
                self._handles[topic] = self._file.add_topic(topic, kind, latched, node)
            self._file.write(self._handles[topic], stamp, data)
        except OSError as error:
            self.problem = _write_problem(error)

    def close(self) -> None:
        """Complete the file; a failure is kept in ``problem``."""
        try:
            self._file.close()
        except OSError as error:
            self.problem = self.problem or _write_problem(error)


def _write_problem(error: OSError) -> str:
    return f"cannot write the recording: {error.strerror or error}"
