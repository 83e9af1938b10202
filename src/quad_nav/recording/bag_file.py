"""Read messages and their times from recordings, which are ROS 1 bags."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, NamedTuple, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag1 import Reader, ReaderError

from quad_nav.errors import InputError
from quad_nav.files.user_files import open_file
from quad_nav.recording.messages import decode, definition

TopicFilter = Callable[[str, str], bool]
"""Returns true for topics to read, given the topic and its type, such as ``nav_msgs/Path``."""


Progress = Callable[[float], object]
"""Called with the share of a recording that is read, from 0 to 1."""


def no_progress(share: float) -> None:
    """Tell nobody."""


class Message(NamedTuple):
    """One recorded message; ``stamp_ns`` is the time of recording, ``kind`` its type."""

    topic: str
    kind: str
    stamp_ns: int
    content: Any


def read_messages(
    path: Path, wanted: TopicFilter, progress: Progress = no_progress
) -> Iterator[Message]:
    """Yield the messages of the wanted topics in the order of recording.

    One chunk is in memory at a time. Unwanted messages are not decoded.

    Raises:
        InputError: The file is not a recording, is damaged or was not completed.
    """
    open_file(path).close()  # refuses pipes, on which rosbags would block
    with recording_faults(path):
        for topic, kind, stamp_ns, data, share in _read(path, wanted):
            progress(share)
            yield Message(topic, kind, stamp_ns, decode(data, kind))


@contextmanager
def recording_faults(path: Path) -> Iterator[None]:
    """Say what is wrong with a recording whatever rosbags raises while it reads it.

    Raises:
        InputError: The file is not a recording, is damaged or was not completed.
    """
    try:
        yield
    except OSError as error:
        raise InputError(
            [f"{path}: cannot read: {error.strerror or error}; expected a recorded flight"]
        ) from error
    except ReaderError as error:
        raise InputError([f"{path}: {_problem_text(error)}"]) from error
    except (MemoryError, InputError):
        raise
    except Exception as error:
        # For damaged files rosbags also raises errors of struct and lz4, AssertionError and others.
        raise InputError(
            [f"{path}: damaged file ({type(error).__name__}: {error}); expected a recorded flight"]
        ) from error


def message_kind(name: str) -> str:
    """Return a type as ROS spells it, ``nav_msgs/Path``, from rosbags' ``nav_msgs/msg/Path``."""
    return name.replace("/msg/", "/")


def wanted_kinds(path: Path, reader: Reader, wanted: TopicFilter) -> Dict[int, str]:
    """Return the types of the wanted connections of an open recording, by their numbers.

    Raises:
        InputError: One of our own types has another definition.
    """
    kinds: Dict[int, str] = {}
    for connection in reader.connections:
        kind = message_kind(connection.msgtype)
        if wanted(connection.topic, kind):
            if kind.startswith("quad/") and connection.digest != definition(kind)[1]:
                raise InputError(
                    [
                        f"{path}: {connection.topic}: {kind} has another definition, expected"
                        " that of this version; read it with the version that made it"
                    ]
                )
            kinds[connection.id] = kind
    return kinds


_Raw = Tuple[str, str, int, bytes, float]


def _share(stamp_ns: int, start_ns: int, end_ns: int) -> float:
    return (stamp_ns - start_ns) / max(end_ns - start_ns, 1)


def _read(path: Path, wanted: TopicFilter) -> Iterator[_Raw]:
    with Reader(path) as reader:
        kinds = wanted_kinds(path, reader, wanted)
        connections = [c for c in reader.connections if c.id in kinds]
        if connections:  # an empty list would mean all of them
            for connection, stamp_ns, data in reader.messages(connections):
                share = _share(stamp_ns, reader.start_time, reader.end_time)
                yield connection.topic, kinds[connection.id], stamp_ns, data, share


def _problem_text(error: Exception) -> str:
    text = str(error).rstrip(".")
    if "not indexed" in text:
        return "no index, the recording was not completed; run `rosbag reindex`"
    if "damaged" in text or "Header" in text:
        return f"truncated or damaged ({text}); expected a complete bag, run `rosbag reindex`"
    return f"cannot read as a recording ({text}); expected a ROS 1 bag"


class FlightClock:
    """Converts times of recording to times of the flight.

    A recorder that was started before the simulation stores wall times: ``/clock`` counts.

    Args:
        clocks_ns: Time of recording, and time on ``/clock``, of each of its messages.
        start_s: Start of the flight on the recording's clock.
    """

    def __init__(self, clocks_ns: Sequence[Tuple[int, int]], start_s: float) -> None:
        self._clocks_ns = np.array(clocks_ns, np.int64).reshape(-1, 2)
        self._start_s = start_s

    def times_s(self, stamps_ns: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the last times on ``/clock`` before times of recording, float64[n], in order."""
        if len(self._clocks_ns):
            numbers = np.searchsorted(self._clocks_ns[:, 0], stamps_ns, side="right") - 1
            stamps_ns = self._clocks_ns[np.maximum(numbers, 0), 1]
        times_s: NDArray[np.float64] = np.maximum.accumulate(stamps_ns / 1e9 - self._start_s)
        return times_s
