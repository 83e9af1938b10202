"""Messages between two processes, neither of which ever waits for the other."""

from __future__ import annotations

import contextlib
import select
import socket
import struct
from multiprocessing.reduction import ForkingPickler
from typing import Any, List, Tuple

_LENGTH = struct.Struct("<Q")
_READ_BYTES = 1 << 18


class MessageSocket:
    """Messages over a pair of sockets of two processes of one program, in order.

    They are packed as those of ``multiprocessing``'s pipes, which no one else can write to. What
    the operating system does not take at once stays here until the next ``flush``.
    """

    def __init__(self, stream: socket.socket) -> None:
        """Take over one end of a connected pair."""
        self._socket = stream
        self._socket.setblocking(False)
        self._outgoing = memoryview(b"")
        self._incoming = bytearray()
        self._is_at_end = False

    @staticmethod
    def pair() -> Tuple[MessageSocket, socket.socket]:
        """Return one end, and the other one as a socket that another process can get."""
        here, there = socket.socketpair()
        return MessageSocket(here), there

    @property
    def is_flushed(self) -> bool:
        """True if the operating system has taken all messages."""
        return not self._outgoing

    def send(self, message: Any) -> None:
        """Send a message, or begin to; never waits."""
        data = bytes(ForkingPickler.dumps(message))
        self._outgoing = memoryview(b"".join((self._outgoing, _LENGTH.pack(len(data)), data)))
        self.flush()

    def flush(self) -> None:
        """Pass on what the operating system takes now; drop all of it if the other end is gone."""
        try:
            while self._outgoing:
                self._outgoing = self._outgoing[self._socket.send(self._outgoing) :]
        except BlockingIOError:
            return
        except ConnectionError:
            self._outgoing = memoryview(b"")

    def receive(self) -> List[Any]:
        """Return the messages that are here.

        Raises:
            EOFError: The other end is closed, and all messages have been returned.
        """
        self._read()
        messages = []
        while len(self._incoming) >= _LENGTH.size:
            (length,) = _LENGTH.unpack_from(self._incoming)
            end = _LENGTH.size + length
            if len(self._incoming) < end:
                break
            messages.append(ForkingPickler.loads(bytes(self._incoming[_LENGTH.size : end])))
            del self._incoming[:end]
        if self._is_at_end and not messages:
            raise EOFError("the other process has closed its end")
        return messages

    def _read(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while not self._is_at_end:
                try:
                    data = self._socket.recv(_READ_BYTES)
                except ConnectionError:
                    data = b""
                self._incoming += data
                self._is_at_end = not data

    def wait(self, timeout_s: float) -> None:
        """Wait until there is something to receive, or to flush, or time is up."""
        writers = [] if self.is_flushed else [self._socket]
        select.select([self._socket], writers, [], timeout_s)

    def close(self) -> None:
        """Close this end; the other one sees it."""
        self._socket.close()
