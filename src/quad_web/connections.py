"""Limits on the connections of the server.

uvicorn waits for the head of a request for ever, takes connections until the process can open no
more files, and writes to a client that does not read. Whoever reaches the port could lock everyone
else out or fill the memory, without a token.

Where there are too many connections, the one is dropped that has waited longest for a request: a
new page can be opened while somebody holds all the others.
"""

from __future__ import annotations

import asyncio
from typing import Any, List, Set, Tuple

MAX_CONNECTIONS = 256
MAX_OF_ADDRESS = 128
"""Connections from one address. Each of 32 pages keeps two."""
HEAD_WITHIN_S = 5.0
"""Time for the head of a request, from the one before it or from the beginning."""
READS_WITHIN_S = 20.0
MAX_UNREAD = 16 * 2**20
"""Bytes that may wait for a client that sends pings and reads nothing."""


class LimitedProtocol(asyncio.Protocol):
    """Mixin for uvicorn's protocols that drops clients that do not read.

    Attributes:
        connections: The connections of the server.
        began_s: Time of the last request, or of the beginning.
    """

    connections: Set[Any]
    transport: Any
    client: Any
    loop: asyncio.AbstractEventLoop
    began_s = 0.0
    is_dropped = False
    _unread: Any = None

    @property
    def address(self) -> str:
        """The client's address."""
        return str(self.client[0]) if self.client else ""

    def drop(self) -> None:
        """Close the connection, with everything that waits for the client."""
        self.is_dropped = True
        self.transport.abort()

    def data_received(self, data: bytes) -> None:
        """Take what the client sends, unless it leaves too much unread."""
        super().data_received(data)
        if self.transport.get_write_buffer_size() > MAX_UNREAD:
            self.drop()

    def pause_writing(self) -> None:
        """Give the client some time to read what was sent."""
        super().pause_writing()
        self._unread = self.loop.call_later(READS_WITHIN_S, self.drop)

    def resume_writing(self) -> None:
        """Go on."""
        super().resume_writing()
        self._unread.cancel()

    def connection_lost(self, exc: Any) -> None:
        """Forget the client."""
        super().connection_lost(exc)
        if self._unread is not None:
            self._unread.cancel()


class LimitedHttp(LimitedProtocol):
    """Mixin for uvicorn's protocol of HTTP, which counts the connections."""

    cycle: Any
    _cycle: Any = None

    @property
    def is_waiting(self) -> bool:
        """True if there is no request to answer."""
        is_answered = self.cycle is None or self.cycle.response_complete
        return bool(is_answered and not self.transport.get_write_buffer_size())

    def connection_made(self, transport: Any) -> None:
        """Take a connection, and drop one where there are too many."""
        super().connection_made(transport)
        self.began_s = self.loop.time()
        self.loop.call_later(HEAD_WITHIN_S, self._look)
        kept = [one for one in self.connections if not one.is_dropped]
        own = [one for one in kept if one.address == self.address]
        if len(own) > MAX_OF_ADDRESS:
            _drop_oldest(own)
        elif len(kept) > MAX_CONNECTIONS:
            _drop_oldest(kept)

    def data_received(self, data: bytes) -> None:
        """Take what the client sends."""
        super().data_received(data)
        if self.cycle is not self._cycle:
            self._cycle, self.began_s = self.cycle, self.loop.time()

    def _look(self) -> None:
        """Drop the connection if it has waited too long for a request."""
        if self not in self.connections:  # it is closed, or a WebSocket now
            return
        left_s = self.began_s + HEAD_WITHIN_S - self.loop.time()
        if self.is_waiting and left_s <= 0.0:
            self.drop()
        else:
            self.loop.call_later(left_s if left_s > 0.0 else HEAD_WITHIN_S, self._look)


def limited(http: Any, websocket: Any) -> Tuple[Any, Any]:
    """Return uvicorn's protocols of HTTP and of WebSockets with these limits."""
    return (
        type("Http", (LimitedHttp, http), {}),
        type("WebSocket", (LimitedProtocol, websocket), {}),
    )


def _drop_oldest(connections: List[Any]) -> None:
    """Drop the one that has waited longest, or else the oldest; never an open WebSocket."""
    requests = [one for one in connections if isinstance(one, LimitedHttp)]
    min(requests, key=lambda one: (not one.is_waiting, one.began_s)).drop()
