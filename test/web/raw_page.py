"""A page without a browser: it sends what it likes."""

from __future__ import annotations

import http.client
import json
import re
import struct
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Iterator, List, Tuple
from urllib.parse import urlsplit

from websockets.sync.client import connect

CLIENT = r"client_id\W+([0-9a-f-]{36})"


def get(url: str) -> bytes:
    """Return the page at an address; it is not connected."""
    parts = urlsplit(url)
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=20.0)
    connection.request("GET", f"/?{parts.query}")
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    assert answer.status == 200
    return body


def handshake_head(url: str, path: str = "/stream") -> bytes:
    """Return the request that opens a WebSocket."""
    return (
        f"GET {path}?{urlsplit(url).query} HTTP/1.1\r\nHost: {urlsplit(url).netloc}\r\n"
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    ).encode()


def masked(opcode: int, content: bytes) -> bytes:
    """Return a WebSocket frame of at most 125 bytes."""
    return struct.pack("BB4x", 0x80 | opcode, 0x80 | len(content)) + content


def memory_bytes(pid: int) -> int:
    """Return the memory of a process."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * 4096


class RawPage:
    """A connected page.

    Attributes:
        id: NiceGUI's name of it.
        listeners: Element's number and name of everything that its elements send.
        socket: NiceGUI's channel.
    """

    def __init__(self, html: str, socket: Any) -> None:
        self.id: str = re.findall(CLIENT, html)[0]
        numbers_and_elements = re.split(r'"(\d+)":\{"tag', html)[1:]
        self.listeners: List[Tuple[int, str]] = [
            (int(number), listener)
            for number, element in zip(numbers_and_elements[::2], numbers_and_elements[1::2])
            for listener in re.findall(r'listener_id":"([0-9a-f-]+)', element)
        ]
        self.socket = socket

    def emit(self, name: str, message: Any) -> None:
        """Send a message."""
        self.socket.send("42" + json.dumps([name, message]))

    def shake_hands(self, **names: Any) -> None:
        """Send what a page sends first."""
        own = {"tab_id": "t", "old_tab_id": None, "document_id": "d", "next_message_id": 0}
        self.emit("handshake", {"client_id": self.id, **own, **names})

    def is_answered(self) -> bool:
        """Return whether the server still handles messages of this page."""
        self.socket.send("421" + json.dumps(["ack", {"client_id": self.id, "next_message_id": 0}]))
        while True:
            text = self.socket.recv(20.0)
            if text.startswith("431"):
                return True
            if text == "2":
                self.socket.send("3")


@contextmanager
def raw_page(url: str) -> Iterator[RawPage]:
    """Open a page at an address and connect it."""
    html = get(url).decode()
    with channel(url, re.findall(CLIENT, html)[0]) as socket:
        yield RawPage(html, socket)


@contextmanager
def channel(url: str, page: str) -> Iterator[Any]:
    """Open NiceGUI's channel of a page."""
    parts = urlsplit(url)
    query = f"EIO=4&transport=websocket&client_id={page}&{parts.query}"
    place = f"ws://{parts.netloc}/_nicegui_ws/socket.io/?{query}"
    with connect(place, origin=f"http://{parts.netloc}", max_size=None) as socket:
        assert socket.recv(20.0).startswith("0")
        socket.send("40")
        assert socket.recv(20.0).startswith("40")
        yield socket
