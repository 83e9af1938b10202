"""Find messages of a recording by topic and time, without reading the others."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, List, Tuple

import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag1 import Reader
from rosbags.rosbag1.reader import IndexData

from quad_nav.recording.bag_file import Message, TopicFilter, recording_faults, wanted_kinds
from quad_nav.recording.messages import decode


class RecordingIndex:
    """Random access to the messages of the wanted topics; the index has 24 bytes for each.

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
        places: Dict[str, List[Tuple[int, ...]]] = {}
        with recording_faults(path):
            self._reader = Reader(path)
            self._reader.open()
            try:
                kinds = wanted_kinds(path, self._reader, wanted)
            except BaseException:
                self._reader.close()
                raise
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
        place = IndexData(*self._places[topic][number].tolist())
        connection = next(one for one in self._reader.connections if one.topic == topic)
        kind = self.kinds[topic]
        with recording_faults(self._path):
            self._reader.indexes = {connection.id: [place]}  # the reader reads what is listed
            _, stamp_ns, data = next(self._reader.messages([connection]))
            return Message(topic, kind, stamp_ns, decode(data, kind))

    def close(self) -> None:
        """Close the file."""
        self._reader.close()


def _sorted(places: List[Tuple[int, ...]]) -> NDArray[np.int64]:
    """Return places int64[n, 3] in the order of time."""
    array = np.array(places, dtype=np.int64).reshape(-1, 3)
    return array[np.argsort(array[:, 0], kind="stable")]
