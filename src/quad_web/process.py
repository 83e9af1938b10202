"""The server in a process of its own, for a source that must not wait for pages.

The source sends items, events and answers; it gets what the pages show and what people do. There
is never more than one batch on its way: the next one is made when the last one has arrived.
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import importlib.util
import inspect
import itertools
import multiprocessing
import os
import signal
import socket
import threading
import time
from dataclasses import dataclass, field, replace
from typing import Any, Callable, Dict, FrozenSet, List, Optional, Tuple

from quad_nav.errors import InputError
from quad_nav.files.user_files import in_folder, outside_current_folder
from quad_web.server import Server, Urls, WebOptions
from quad_web.view.actions import Actions, Answer
from quad_web.view.message_socket import MessageSocket
from quad_web.view.state import FleetState, Item, Wanted

STARTS_WITHIN_S = 60.0
ANSWERS_WITHIN_S = 10.0
_LOOKS_EVERY_S = 0.1
_JOIN_TIMEOUT_S = 5.0
_LISTS = ("parameters", "goal_files", "check_goals")
_METHODS = tuple(
    name for name in vars(Actions) if callable(vars(Actions)[name]) and not name.startswith("_")
)


@dataclass(frozen=True)
class Batch:
    """What has changed in the source.

    Attributes:
        items: New items.
        removed: Keys of items that are gone.
        events: Time, text, level and robot of new events.
        clears: Remove everything before, as for another flight.
    """

    items: List[Item] = field(default_factory=list)
    removed: Tuple[str, ...] = ()
    events: List[Tuple[float, str, str, Optional[int]]] = field(default_factory=list)
    clears: bool = False


@dataclass(frozen=True)
class Call:
    """A person's action: method and arguments of ``Actions``; ``number`` identifies its answer."""

    number: int
    name: str
    arguments: Dict[str, Any]


class ServerProcess:
    """The server, seen from the source. No method waits, but for the constructor and ``close``.

    Attributes:
        urls: Addresses of the page.
        wanted: What each client shows.
        calls: Actions that have no answer yet.
        is_alive: The process serves.
    """

    def __init__(self, options: WebOptions, available: FrozenSet[str]) -> None:
        """Start the process and wait until the page can be opened.

        Args:
            options: Where and for whom the page is served.
            available: Names of the actions that the source can carry out.

        Raises:
            InputError: NiceGUI is not installed, or the address cannot be listened on.
        """
        require_nicegui()
        self.wanted: Tuple[Wanted, ...] = ()
        self.calls: List[Call] = []
        self.is_alive = True
        self._has_arrived = True
        self.urls = Urls("", "")
        self._problems: List[str] = []
        self._socket, there = MessageSocket.pair()
        context = multiprocessing.get_context("spawn")
        self._process = context.Process(
            target=in_folder,
            args=(os.getcwd(), _run, there, replace(options, on_ready=None), available),
            daemon=True,
        )
        with outside_current_folder():
            self._process.start()
        there.close()
        self._await_start()

    def _await_start(self) -> None:
        end_s = time.monotonic() + STARTS_WITHIN_S
        while not self.urls.steer and not self._problems and self.is_alive:
            self._socket.wait(max(0.0, end_s - time.monotonic()))
            self.poll()
            if time.monotonic() > end_s:
                self._problems.append(
                    f"web: the page's server did not start in {STARTS_WITHIN_S:g} s"
                )
        if not self.urls.steer:
            self.close()
            raise InputError(self._problems or ["web: the page's server ended before it served"])

    @property
    def can_take(self) -> bool:
        """True if the last batch has arrived."""
        return self.is_alive and self._has_arrived and self._socket.is_flushed

    def send(self, batch: Batch) -> None:
        """Send a batch; call it only if ``can_take``."""
        self._has_arrived = False
        self._socket.send(batch)

    def answer(self, call: Call, value: Any) -> None:
        """Answer an action."""
        self._socket.send((call.number, value))

    def poll(self) -> None:
        """Take what has come, and pass on what waits."""
        if not self.is_alive:
            return
        self._socket.flush()
        try:
            for message in self._socket.receive():
                self._take(message)
        except EOFError:
            self.is_alive, self.wanted = False, ()

    def wait(self, timeout_s: float) -> None:
        """Wait until something comes, or time is up."""
        if self.is_alive:
            self._socket.wait(timeout_s)
        else:
            time.sleep(timeout_s)

    def close(self) -> None:
        """End the process."""
        self._socket.close()
        self.is_alive = False
        self._process.join(_JOIN_TIMEOUT_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def _take(self, message: Any) -> None:
        if isinstance(message, Call):
            self.calls.append(message)
        elif isinstance(message, Urls):
            self.urls = message
        elif isinstance(message, InputError):
            self._problems += message.problems
        elif isinstance(message, tuple):
            self.wanted = message
        else:
            self._has_arrived = True


def require_nicegui() -> None:
    """Check that NiceGUI is installed, without loading it.

    Raises:
        InputError: It is not.
    """
    if importlib.util.find_spec("nicegui") is None:
        raise InputError(
            [
                "web: NiceGUI is not installed; install it with pip install 'quad-nav[web]', in a"
                " checkout with .venv/bin/pip install '.[web]'"
            ]
        )


def _run(there: socket.socket, options: WebOptions, available: FrozenSet[str]) -> None:
    """Serve until the source closes its end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the source handles Ctrl-C
    ServedSource(MessageSocket(there), available).run(options)


class ServedSource(Actions):
    """The source, seen from the server: its state, and its actions."""

    def __init__(self, messages: MessageSocket, available: FrozenSet[str]) -> None:
        self.available = available
        self.state = FleetState()
        self._messages = messages
        self._lock = threading.Lock()
        self._numbers = itertools.count()
        self._waiting: Dict[int, concurrent.futures.Future[Any]] = {}

    def run(self, options: WebOptions) -> None:
        """Serve until the source closes its end."""
        try:
            server = Server(self.state, self, options)
            server.start()
        except InputError as error:
            self._send(error)
            while not self._messages.is_flushed:
                self._messages.wait(_LOOKS_EVERY_S)
                self._messages.flush()
            return
        self._send(server.urls)
        with contextlib.suppress(EOFError):
            self.take_all()
        server.stop()

    def take_all(self) -> None:
        """Take what the source sends, and tell it what the pages show.

        Raises:
            EOFError: The source has closed its end.
        """
        wanted: Tuple[Wanted, ...] = ()
        while True:
            self._messages.wait(_LOOKS_EVERY_S)
            with self._lock:
                self._messages.flush()
                messages = self._messages.receive()
            for message in messages:
                self._take(message)
            if self.state.wanted() != wanted:
                wanted = self.state.wanted()
                self._send(wanted)

    def _take(self, message: Any) -> None:
        if not isinstance(message, Batch):
            number, value = message
            future = self._waiting.pop(number, None)
            if future is not None:
                future.set_result(value)
            return
        if message.clears:
            self.state.clear()
        self.state.put_all(message.items, message.removed)
        for time_s, text, level, robot in message.events:
            self.state.add_event(time_s, text, level, robot)
        self._send(True)

    def call(self, name: str, arguments: Dict[str, Any]) -> Any:
        """Have the source carry out an action, and wait for what comes of it."""
        future: concurrent.futures.Future[Any] = concurrent.futures.Future()
        number = next(self._numbers)
        self._waiting[number] = future
        self._send(Call(number, name, arguments))
        try:
            return future.result(ANSWERS_WITHIN_S)
        except concurrent.futures.TimeoutError:
            self._waiting.pop(number, None)
            silence = f"{name}: the flight has not answered in {ANSWERS_WITHIN_S:g} s"
            return [] if name in _LISTS else Answer(False, silence)

    def _send(self, message: Any) -> None:
        with self._lock:
            self._messages.send(message)


def _forwarded(name: str) -> Callable[..., Any]:
    signature = inspect.signature(getattr(Actions, name))

    def forward(source: ServedSource, *arguments: Any, **named: Any) -> Any:
        bound = signature.bind(source, *arguments, **named).arguments
        return source.call(name, {key: bound[key] for key in bound if key != "self"})

    forward.__doc__ = f"Have the source carry out ``Actions.{name}``."
    return forward


for _name in _METHODS:
    setattr(ServedSource, _name, _forwarded(_name))
