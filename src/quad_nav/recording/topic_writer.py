"""The topics of a recording: each is announced with its first message."""

from __future__ import annotations

from typing import Any, Dict

from quad_nav.recording.messages import encode
from quad_nav.recording.record_file import RecordFile
from quad_nav.topics.flight_info import START_S

START_NS = round(START_S * 1e9)


def stamp_at(time_s: float) -> int:
    """Nanoseconds on the recording's clock at a time of the flight."""
    return round(time_s * 1e9) + START_NS


class Topics:
    """Writes messages until the file takes no more; ``problem`` then says why."""

    def __init__(self, file: RecordFile):
        self._file = file
        self._handles: Dict[str, Any] = {}
        self.problem = ""

    def write(self, topic: str, stamp: int, content: Any, node: str, latched: bool = False) -> None:
        """``content`` is a message of ``record_messages``."""
        self.write_bytes(
            topic, content.__msgtype__.replace("/msg/", "/"), stamp, encode(content), node, latched
        )

    def write_bytes(
        self, topic: str, kind: str, stamp: int, data: bytes, node: str, latched: bool = False
    ) -> None:
        if self.problem:
            return
        try:
            if topic not in self._handles:
                self._handles[topic] = self._file.add_topic(topic, kind, latched, node)
            self._file.write(self._handles[topic], stamp, data)
        except OSError as error:
            self.problem = _said(error)

    def close(self) -> None:
        try:
            self._file.close()
        except OSError as error:
            self.problem = self.problem or _said(error)


def _said(error: OSError) -> str:
    return f"the recording cannot be written: {error.strerror or error}"
