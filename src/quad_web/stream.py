"""Send the items of a state to pages, each over one WebSocket.

A page sends JSON: ``{"want": {"layers": [...], "robot": 3}}`` at any time, with ``null`` for no
robot, and ``{"ack": seq}`` for each message, when it is drawn. With ``"every": false`` in ``want``
the costly layers are the selected robot's alone. The server sends messages of
``view.codec`` with the header entries ``seq``, counted from 0, and ``wall_s``, its own time. It
sends about ten messages per second at most, none before the last one is acknowledged, and without
changes one without items each second. Messages without items are acknowledged, too. A page that is
not visible acknowledges at once, without drawing.

So a slow page gets fewer messages, each with what is new then, and nothing queues up for it. A page
that does not acknowledge is dropped after ``ACKNOWLEDGES_WITHIN_S``; it may connect again.
"""

from __future__ import annotations

import asyncio
import json
import time
from contextlib import suppress
from typing import Any, Awaitable, Callable, Dict, Mapping, MutableMapping

from quad_nav.errors import QuadError, excerpt
from quad_web.view.codec import encode
from quad_web.view.state import LAYERS, Changes, FleetState, Wanted

PERIOD_S = 0.09
"""Least time between messages on average: a source of ten changes per second never waits long."""
KEEP_ALIVE_S = 1.0
ACKNOWLEDGES_WITHIN_S = 10.0
MAX_CLIENTS = 32

_LATE_S = 0.05  # after a late message the next ones may be earlier by so much
_MAX_TEXT = 4096
_MAX_ROBOT = 10**6
_MAX_REASON = 120  # bytes; a WebSocket allows 123
_REFUSED, _BUSY = 1008, 1013  # RFC 6455 and its registry: policy violation, try again later

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]


class Refused(QuadError):
    """A page's connection is closed for what it sent, or failed to send."""


class Stream:
    """Serves the WebSockets of all pages; an ASGI application."""

    def __init__(self, state: FleetState) -> None:
        self._state = state
        self._clients = 0

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Serve one page until it closes its connection or is dropped."""
        await receive()  # websocket.connect
        await send({"type": "websocket.accept"})
        if self._clients >= MAX_CLIENTS:
            await _close(send, _BUSY, f"{MAX_CLIENTS} pages are open; expected fewer")
            return
        self._clients += 1
        client = _Client(self._state, receive, send)
        try:
            with suppress(OSError):  # the page leaves while a message is on its way
                await client.run()
        except Refused as refused:
            await _close(send, _REFUSED, str(refused))
        finally:
            self._clients -= 1


class _Client:
    def __init__(self, state: FleetState, receive: Receive, send: Send) -> None:
        self._state = state
        self._receive = receive
        self._send = send
        self._loop = asyncio.get_running_loop()
        self._wanted = Wanted()
        self._number = -1
        self._seq = -1
        self._acknowledged = asyncio.Event()
        self._changed = asyncio.Event()
        self._is_told = False

    async def run(self) -> None:
        """Serve the page.

        Raises:
            Refused: It sends what it may not, or does not acknowledge.
        """
        self._number = self._state.add_client(self._wanted)
        self._state.add_listener(self._tell)
        tasks = {asyncio.ensure_future(self._read()), asyncio.ensure_future(self._write())}
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            self._state.remove_listener(self._tell)
            self._state.remove_client(self._number)
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    def _tell(self) -> None:
        """Wake the writer; from any thread, and once until it has looked."""
        if not self._is_told:
            self._is_told = True
            with suppress(RuntimeError):  # the loop has ended
                self._loop.call_soon_threadsafe(self._changed.set)

    async def _read(self) -> None:
        while True:
            event = await self._receive()
            if event["type"] == "websocket.disconnect":
                return
            message = _parsed(event.get("text"))
            if "want" in message:
                self._wanted = _wanted(message["want"])
                self._state.set_wanted(self._number, self._wanted)
                self._changed.set()
            if message.get("ack") == self._seq:
                self._acknowledged.set()

    async def _write(self) -> None:
        versions: Mapping[str, int] = {}
        keep_alive_s = due_s = 0.0
        while True:
            self._changed.clear()
            self._is_told = False
            changes = self._state.changes(self._wanted, versions)
            begin_s = self._loop.time()
            if changes.items or changes.removed or begin_s >= keep_alive_s:
                versions = changes.versions
                await self._deliver(changes)
                due_s = max(due_s, begin_s - _LATE_S) + PERIOD_S
                await asyncio.sleep(due_s - self._loop.time())
                keep_alive_s = begin_s + KEEP_ALIVE_S
            await _within(self._changed.wait(), keep_alive_s - self._loop.time())

    async def _deliver(self, changes: Changes) -> None:
        """Send a message and wait until it is acknowledged."""
        self._seq += 1
        self._acknowledged.clear()
        content = encode(changes.items, changes.removed, seq=self._seq, wall_s=time.time())
        is_sent = await _within(
            self._send({"type": "websocket.send", "bytes": content}), ACKNOWLEDGES_WITHIN_S
        )
        del content
        if not is_sent or not await _within(self._acknowledged.wait(), ACKNOWLEDGES_WITHIN_S):
            raise Refused(
                f"no acknowledgement of message {self._seq} within {ACKNOWLEDGES_WITHIN_S:g} s"
            )


async def _within(awaitable: Awaitable[object], timeout_s: float) -> bool:
    """Await something; return whether it ended in time. Else it is cancelled.

    ``asyncio.wait_for`` may swallow the cancellation of its caller before Python 3.12.
    """
    task = asyncio.ensure_future(awaitable)
    try:
        await asyncio.wait({task}, timeout=timeout_s)
        if not task.done():
            return False
        task.result()
        return True
    finally:
        task.cancel()


def _parsed(text: Any) -> Dict[str, Any]:
    """Return the JSON object of a page's message."""
    if not isinstance(text, str) or len(text) > _MAX_TEXT:
        raise Refused(f"message is binary or too long; expected up to {_MAX_TEXT} characters")
    try:
        message = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise Refused(f"message {excerpt(text, 40)} is not JSON") from error
    if not isinstance(message, dict):
        raise Refused(f"message {excerpt(text, 40)}; expected an object with want or ack")
    return message


def _wanted(want: Any) -> Wanted:
    """Return what a page asks for; layers that this version does not know are left out."""
    layers = want.get("layers") if isinstance(want, dict) else None
    if not isinstance(layers, list) or not all(isinstance(layer, str) for layer in layers):
        raise Refused('want has no valid layers; expected {"layers": ["plan"], "robot": 0}')
    robot = want.get("robot")
    is_number = isinstance(robot, int) and not isinstance(robot, bool)
    if robot is not None and not (is_number and 0 <= robot < _MAX_ROBOT):
        raise Refused("robot of want is not valid; expected a number from 0 or null")
    every = want.get("every", True)
    if not isinstance(every, bool):
        raise Refused("every of want is not valid; expected true or false")
    return Wanted(frozenset(LAYERS).intersection(layers), robot, every)


async def _close(send: Send, code: int, reason: str) -> None:
    reason = reason.encode()[:_MAX_REASON].decode(errors="ignore")
    # A page that does not read does not take the reason either.
    await _within(send({"type": "websocket.close", "code": code, "reason": reason}), PERIOD_S)
