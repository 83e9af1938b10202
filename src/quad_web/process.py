"""The server in a process of its own, for a source that must not wait for pages.

The source sends items, events and answers; it gets what the pages show and what people do. There
is never more than one batch on its way: the next one is made when the last one has arrived.
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import itertools
import multiprocessing
import os
import queue
import signal
import threading
import time
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any, Dict, FrozenSet, List, Optional, Tuple

from quad_nav.errors import InputError
from quad_nav.files.user_files import in_folder, outside_current_folder
from quad_web.server import Server, Urls, WebOptions, require_nicegui
from quad_web.view.actions import READS, Actions, Answer
from quad_web.view.state import FleetState, Item, Wanted

STARTS_WITHIN_S = 60.0
ANSWERS_WITHIN_S = 10.0
_LOOKS_EVERY_S = 0.1
_JOIN_TIMEOUT_S = 5.0


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
    """A person's action, see ``Actions.call``; ``number`` identifies its answer."""

    number: int
    name: str
    arguments: Tuple[Any, ...]


class Channel:
    """Messages to and from another process; a thread sends them, so that nobody waits."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._outgoing: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        threading.Thread(target=self._write, name="channel", daemon=True).start()

    def send(self, message: Any) -> None:
        """Send a message as it is now; it is lost if the other end is gone."""
        self._outgoing.put(bytes(ForkingPickler.dumps(message)))

    def _write(self) -> None:
        with contextlib.suppress(OSError, TypeError):  # the latter if it is closed meanwhile
            while True:
                self._connection.send_bytes(self._outgoing.get())

    def receive(self, timeout_s: float = 0.0) -> List[Any]:
        """Return the messages that are here; wait for the first one until time is up.

        Raises:
            EOFError: The other end is closed, and all messages have been returned.
        """
        messages: List[Any] = []
        try:
            while self._connection.poll(0.0 if messages else timeout_s):
                messages.append(self._connection.recv())
        except (EOFError, OSError):
            if not messages:
                raise EOFError("the other process has closed its end") from None
        return messages

    def close(self) -> None:
        """Close this end; the other one sees it."""
        self._connection.close()


class ServerProcess:
    """The server, seen from the source. No method waits, but for the constructor and ``close``.

    Attributes:
        urls: Addresses of the page.
        wanted: What each client shows.
        can_take: The last batch has arrived.
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
        self.can_take = self.is_alive = True
        self.urls = Urls("", "")
        self._calls: List[Call] = []
        self._problems: List[str] = []
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe()
        self._process = context.Process(
            target=in_folder,
            args=(os.getcwd(), _run, there, replace(options, on_ready=None), available),
            daemon=True,
        )
        with outside_current_folder():
            self._process.start()
        there.close()
        self._channel = Channel(here)
        self._await_start()

    def _await_start(self) -> None:
        end_s = time.monotonic() + STARTS_WITHIN_S
        while not self.urls.steer and not self._problems and self.is_alive:
            self.wait(_LOOKS_EVERY_S)
            if time.monotonic() > end_s:
                self._problems.append(
                    f"web: the page's server did not start in {STARTS_WITHIN_S:g} s"
                )
        if not self.urls.steer:
            self.close()
            raise InputError(self._problems or ["web: the page's server ended before it served"])

    def send(self, batch: Batch) -> None:
        """Send a batch; call it only if ``can_take``."""
        self.can_take = False
        self._channel.send(batch)

    def serve(self, actions: Actions) -> None:
        """Take what has come, and answer what people do."""
        self.wait(0.0)
        calls, self._calls = self._calls, []
        for call in calls:
            self._channel.send((call.number, actions.call(call.name, *call.arguments)))

    def wait(self, timeout_s: float) -> None:
        """Wait until something comes, or time is up, and take it."""
        if not self.is_alive:
            time.sleep(timeout_s)
            return
        try:
            for message in self._channel.receive(timeout_s):
                self._take(message)
        except EOFError:
            self.is_alive, self.can_take, self.wanted = False, False, ()

    def close(self) -> None:
        """End the process."""
        self._channel.close()
        self.is_alive = False
        self._process.join(_JOIN_TIMEOUT_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def _take(self, message: Any) -> None:
        if isinstance(message, Call):
            self._calls.append(message)
        elif isinstance(message, Urls):
            self.urls = message
        elif isinstance(message, InputError):
            self._problems += message.problems
        elif isinstance(message, tuple):
            self.wanted = message
        else:
            self.can_take = True


def _run(there: Connection, options: WebOptions, available: FrozenSet[str]) -> None:
    """Serve until the source closes its end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the source handles Ctrl-C
    source = ServedSource(there, available)
    try:
        server = Server(source.state, source, options)
        server.start()
    except InputError as error:
        there.send(error)
        return
    source.send(server.urls)
    with contextlib.suppress(EOFError):
        source.take_all()
    server.stop()


class ServedSource(Actions):
    """The source, seen from the server: its state, and its actions."""

    def __init__(self, connection: Connection, available: FrozenSet[str]) -> None:
        self.available = available
        self.state = FleetState()
        self._channel = Channel(connection)
        self.send = self._channel.send
        self._numbers = itertools.count()
        self._waiting: Dict[int, concurrent.futures.Future[Any]] = {}

    def take_all(self) -> None:
        """Take what the source sends, and tell it what the pages show.

        Raises:
            EOFError: The source has closed its end.
        """
        wanted: Tuple[Wanted, ...] = ()
        while True:
            for message in self._channel.receive(_LOOKS_EVERY_S):
                self._take(message)
            if self.state.wanted() != wanted:
                wanted = self.state.wanted()
                self.send(wanted)

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
        for event in message.events:
            self.state.add_event(*event)
        self.send(True)

    def call(self, name: str, *arguments: Any) -> Any:
        """Have the source carry out an action, and wait for what comes of it."""
        future: concurrent.futures.Future[Any] = concurrent.futures.Future()
        number = next(self._numbers)
        self._waiting[number] = future
        self.send(Call(number, name, arguments))
        try:
            return future.result(ANSWERS_WITHIN_S)
        except concurrent.futures.TimeoutError:
            self._waiting.pop(number, None)
            silence = f"{name}: the flight has not answered in {ANSWERS_WITHIN_S:g} s"
            return [] if name in READS else Answer(False, silence)
