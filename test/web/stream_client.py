"""A client of ``/stream`` in Python."""

from __future__ import annotations

import json
from contextlib import contextmanager
from typing import Any, Dict, Iterable, Iterator, Optional
from urllib.parse import urlsplit

from websockets.sync.client import connect

from quad_web.view.codec import decode


@contextmanager
def open_stream(url: str) -> Iterator[StreamReader]:
    """Connect to the stream of the page at an address."""
    parts = urlsplit(url)
    query = f"?{parts.query}" if parts.query else ""
    with connect(
        f"ws://{parts.netloc}/stream{query}",
        origin=f"http://{parts.netloc}",
        max_size=None,
        compression=None,
    ) as socket:
        yield StreamReader(socket)


class StreamReader:
    """A connection to a server's stream.

    Attributes:
        size: Bytes of the last message.
    """

    def __init__(self, socket: Any) -> None:
        self._socket = socket
        self.size = 0

    def want(self, layers: Iterable[str] = (), robot: Optional[int] = None) -> None:
        """Say which layers to send, and the selected robot; before, the server sends no layer."""
        self._send({"want": {"layers": list(layers), "robot": robot}})

    def receive(self, acknowledge: bool = True, timeout_s: float = 10.0) -> Dict[str, Any]:
        """Return the header of the next message.

        Raises:
            TimeoutError: None comes in time.
        """
        message = self._socket.recv(timeout_s)
        self.size = len(message)
        header, _ = decode(message)
        if acknowledge:
            self._send({"ack": header["seq"]})
        return header

    def item(self, key: str) -> Any:
        """Return the data of the next item with a key."""
        while True:
            for item in self.receive()["items"]:
                if item["key"] == key:
                    return item["data"]

    def _send(self, message: Dict[str, Any]) -> None:
        self._socket.send(json.dumps(message))
