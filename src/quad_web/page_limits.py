"""Limits on what NiceGUI keeps of pages, and takes from them.

A page may only watch, and still send any event, any number of times, without a browser. NiceGUI
keeps a page that is not connected for up to a minute, and whatever a page calls itself for a month.
"""

from __future__ import annotations

import asyncio
import functools
import inspect
import logging
import time
from pathlib import Path
from typing import Any, Callable, Dict

from quad_nav.errors import QuadError, excerpt
from quad_web.access import Message, Receive

MAX_OPENING = 32
"""Pages that are not connected: they are being opened, or their connection was lost."""
MAX_WAITING = 100
"""Messages that wait for a page; with more the page is disconnected, and may connect again."""
REPEATS_AFTER_S = 5.0
MAX_KINDS = 20

_MAX_NAME = 100  # characters of what a page calls itself; NiceGUI's names have 36
_NAMES = ("client_id", "tab_id", "old_tab_id", "document_id")
_HANDSHAKE = "quad.handshake"  # key of a connection that had one
_TAB_STORAGE_S = 60.0  # nothing is stored there
_PACKAGE = Path(__file__).parent


class _Refused(QuadError):
    """A page sends what no page sends."""


def limit_pages(nicegui: Any) -> None:
    """Limit what NiceGUI takes from pages; a second call changes nothing."""
    nicegui.app.config.socket_io_js_transports = ["websocket"]
    nicegui.app.storage.max_tab_storage_age = _TAB_STORAGE_S
    channel = nicegui.core.sio
    channel.eio.create_queue = _Waiting
    for name, handler in list(channel.handlers["/"].items()):
        if not hasattr(handler, "__wrapped__"):
            channel.on(name, _guarded(name, handler, channel))


def drop_old_pages(nicegui: Any) -> None:
    """Drop the oldest of too many pages that are not connected."""
    pages = nicegui.Client.instances.values()
    opening = [one for one in pages if not one.shared and not one.has_socket_connection]
    opening.sort(key=lambda one: one.created)
    for one in opening[: max(0, len(opening) - MAX_OPENING)]:
        one.delete()


def only_texts(receive: Receive) -> Receive:
    """End a WebSocket at a binary message: NiceGUI would collect any number of them."""

    async def receive_text() -> Message:
        message = await receive()
        if message.get("bytes") is not None:
            return {"type": "websocket.disconnect", "code": 1003}  # RFC 6455: unsupported data
        return message

    return receive_text


class _Waiting(asyncio.Queue):  # type: ignore[type-arg]  # which Python 3.8 does not subscript
    """Messages that wait for a page; too many are replaced by the end of its connection."""

    async def put(self, item: Any) -> None:
        """Add a message."""
        if self.qsize() >= MAX_WAITING:
            while not self.empty():
                self.get_nowait()
                self.task_done()
            item = None
        await super().put(item)


def _guarded(name: str, handler: Callable[..., Any], channel: Any) -> Callable[..., Any]:
    """Return a handler of a kind of message that logs faults as those of the page."""
    count = len(inspect.signature(handler).parameters)

    @functools.wraps(handler)
    async def guarded(*arguments: Any) -> Any:
        try:
            if name == "handshake":
                _check_handshake(channel.get_environ(arguments[0]), arguments[1])
            result = handler(*arguments[:count])
            return await result if inspect.isawaitable(result) else result
        except Exception:  # whatever a page sends leads to
            logging.getLogger("nicegui").exception("a page sent an invalid %s", name)
            return False

    return guarded


def _check_handshake(connection: Dict[str, Any], message: Dict[str, Any]) -> None:
    if _HANDSHAKE in connection:
        raise _Refused("a second handshake; expected one for each connection")
    names = [message.get(name) for name in _NAMES]
    if not all(one is None or isinstance(one, str) and len(one) <= _MAX_NAME for one in names):
        raise _Refused(f"names of the page; expected up to {_MAX_NAME} characters each")
    connection[_HANDSHAKE] = True


class Complaints(logging.Filter):
    """Log each kind of fault in one line, every 5 s at most, and 20 kinds at most.

    A traceback has some fifty lines, and a page may cause a thousand in a second. Nothing is logged
    while the server ends, which cuts connections off.
    """

    def __init__(self, is_ending: Callable[[], bool]) -> None:
        super().__init__()
        self._is_ending = is_ending
        self._logged_s: Dict[object, float] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether to log a record, and change it."""
        error = record.exc_info[1] if record.exc_info else None
        text, _, _ = record.getMessage().partition("\n")
        kind: object = record.msg
        if error is not None:
            kind = place = _place(error)
            about = "" if text == str(error) else f"{text}: "
            text = f"{about}{type(error).__name__}: {excerpt(str(error))} ({place})"
        record.msg, record.args = f"web: {excerpt(text, 1000)}", ()
        record.exc_info = record.exc_text = record.stack_info = None
        now_s = time.monotonic()
        if self._is_ending():
            return False
        if now_s < self._logged_s.get(kind, 0.0) + REPEATS_AFTER_S:
            return False
        if kind not in self._logged_s and len(self._logged_s) >= MAX_KINDS:
            return False
        self._logged_s[kind] = now_s
        return True


def _place(error: BaseException) -> str:
    """Return the file and line of an error: the last ones of this package, or else of any."""
    place = "?"
    own = ""
    trace = error.__traceback__
    while trace is not None:
        path = Path(trace.tb_frame.f_code.co_filename)
        place = f"{path.name}:{trace.tb_lineno}"
        own = place if _PACKAGE in path.parents and path != Path(__file__) else own
        trace = trace.tb_next
    return own or place
