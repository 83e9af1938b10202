"""Serve the page.

NiceGUI is an extra: ``pip install 'quad-nav[web]'``. Importing this module does not need it.
"""

from __future__ import annotations

import contextlib
import errno
import importlib
import importlib.util
import logging
import os
import re
import secrets
import socket
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Callable, Optional, Tuple

from quad_nav.errors import InputError
from quad_web.access import ROLE, Access, Tokens, is_loopback, refuse
from quad_web.connections import MAX_OF_ADDRESS, limited
from quad_web.page_limits import Complaints, drop_old_pages, limit_pages, only_texts
from quad_web.stream import Message, Receive, Send, Stream
from quad_web.view.actions import Actions, Role, WatchOnly
from quad_web.view.result import REPORT, SUMMARY
from quad_web.view.state import FleetState

_FIRST_PORT, _LAST_PORT = 8080, 8179
_TOKEN_BYTES = 24
_COMPRESSES_FROM = 1024
_TOKEN = re.compile("[A-Za-z0-9_-]+")
_ENDS_WITHIN_S = 5.0
_SILENT_FOR_MS = 20000
_MAX_MESSAGE = 2**20  # from the page; a page's largest are edited goals
_MAX_HEAD = 2**16  # cookies of all ports of this host are in it
_LOGGERS = (
    "asyncio",
    "uvicorn.error",
    "uvicorn.asgi",
    "nicegui",
    "engineio.server",
    "socketio.server",
)

# Once it is in a cookie, the token does not stay in the address, which others may see or copy.
_HIDE_TOKEN = "<script>if (location.search) history.replaceState(null, '', '/')</script>"


@dataclass(frozen=True)
class Urls:
    """Addresses of the page for those who steer and who watch; the same one without tokens."""

    steer: str
    watch: str


@dataclass(frozen=True)
class WebOptions:
    """Where and for whom the page is served.

    Attributes:
        address: Address or name to listen on; 0.0.0.0 or :: for all of the machine's. One that
            others reach needs tokens.
        port: 0 takes the first free one from 8080 on.
        steer_token: Who opens the page with it may steer. "" makes one up where it is needed.
        watch_token: Who opens the page with it may watch, likewise.
        title: Title of the page.
        on_ready: Called once the page can be opened.
    """

    address: str = "127.0.0.1"
    port: int = 0
    steer_token: str = ""
    watch_token: str = ""
    title: str = "quad"
    on_ready: Optional[Callable[[Urls], None]] = None

    def tokens(self) -> Optional[Tokens]:
        """Return the tokens, made up if there are none; None if no token is needed.

        Raises:
            InputError: Both are the same, or have characters that do not fit into a URL.
        """
        if is_loopback(self.address) and not self.steer_token and not self.watch_token:
            return None
        steer = self.steer_token or secrets.token_urlsafe(_TOKEN_BYTES)
        watch = self.watch_token or secrets.token_urlsafe(_TOKEN_BYTES)
        if steer == watch:
            raise InputError(["web: the tokens to steer and to watch are equal; expected two"])
        if not all(map(_TOKEN.fullmatch, (steer, watch))):
            raise InputError(["web: a token has odd characters; expected letters, digits, _ and -"])
        return Tokens(steer, watch)


class Server:
    """Serves the page from a thread; one at a time in a process.

    The socket is taken at once, so the addresses are known before ``start``.

    Attributes:
        port: The port.
        urls: Addresses of the page.

    Raises:
        InputError: NiceGUI is not installed, or the address cannot be listened on.
    """

    def __init__(self, state: FleetState, actions: Actions, options: WebOptions) -> None:
        require_nicegui()
        import nicegui
        from starlette.middleware.gzip import GZipMiddleware

        uvicorn: Any = importlib.import_module("uvicorn")
        http, websocket = _protocols()
        self._nicegui = nicegui
        pages = _nicegui_app(self._nicegui, state, actions, options)
        tokens = options.tokens()
        self._options = options
        self._socket = _bound(options)
        self.port = port = self._socket.getsockname()[1]
        self.urls = _urls(options.address, port, tokens)
        self._state, self._stream = state, Stream(state)
        # Compression halves the stream and quarters the page, for twice the server's time: worth it
        # where a radio link may be between.
        is_remote = not is_loopback(options.address)
        if is_remote:
            pages = GZipMiddleware(pages, minimum_size=_COMPRESSES_FROM, compresslevel=4)
        self._pages = pages
        config = uvicorn.Config(
            Access(self._route, options.address, port, tokens),
            interface="asgi3",
            # httptools, the default, takes heads without an end. h11 refuses a long one.
            http=http,
            ws=websocket,
            h11_max_incomplete_event_size=_MAX_HEAD,
            backlog=MAX_OF_ADDRESS,  # connections that are accepted at once, before any is dropped
            proxy_headers=False,
            server_header=False,
            log_config=None,
            access_log=False,
            ws_max_size=_MAX_MESSAGE,
            ws_per_message_deflate=is_remote,
            timeout_graceful_shutdown=1,
        )
        self._server = uvicorn.Server(config)
        self._server.capture_signals = contextlib.nullcontext  # they are left to the caller
        self._thread = threading.Thread(target=self._run, name="web", daemon=True)

    def start(self) -> None:
        """Serve, and return once the page can be opened.

        Raises:
            InputError: The server ended at once.
        """
        self._thread.start()
        while not self._server.started:
            if not self._thread.is_alive():
                raise InputError(["web: the server did not start; expected no error in the log"])
            self._thread.join(0.01)
        if self._options.on_ready:
            self._options.on_ready(self.urls)

    def wait(self) -> None:
        """Return when the server has stopped."""
        while self._thread.is_alive():
            self._thread.join(0.5)  # a wait without an end is not interrupted on all systems

    def stop(self) -> None:
        """Close all connections and stop; from any thread, also twice."""
        self._server.should_exit = True
        if self._thread.is_alive():
            self._thread.join(_ENDS_WITHIN_S)
        self._socket.close()

    def _run(self) -> None:
        complaints = Complaints(lambda: self._server.should_exit)
        loggers = [logging.getLogger(name) for name in _LOGGERS]
        for logger in loggers:
            logger.setLevel(logging.ERROR)
            logger.addFilter(complaints)
        try:
            self._server.run([self._socket])
        finally:
            for logger in loggers:
                logger.removeFilter(complaints)

    async def _route(self, scope: Message, receive: Receive, send: Send) -> None:
        if scope["type"] == "websocket" and scope["path"] == "/stream":
            await self._stream(scope, receive, send)
        elif scope["type"] == "websocket":
            await self._pages(scope, only_texts(receive), send)
        elif scope.get("path") in (REPORT, SUMMARY):
            await self._send_result(scope, receive, send)
        elif scope.get("path", "").startswith("/_nicegui_ws/"):  # socket.io without a WebSocket
            await refuse(scope, send, 404, "nothing is here; expected a WebSocket")
        else:
            await self._pages(scope, receive, send)
            drop_old_pages(self._nicegui)

    async def _send_result(self, scope: Message, receive: Receive, send: Send) -> None:
        """Send the report or the summary of a flight that has ended."""
        from starlette.responses import FileResponse, JSONResponse

        item = self._state.item("result")
        data = item.data if item else {}
        if scope["path"] == SUMMARY and data.get("summary"):
            await JSONResponse(data["summary"])(scope, receive, send)
        elif scope["path"] == REPORT and os.path.isfile(data.get("report", "")):
            await FileResponse(data["report"])(scope, receive, send)
        else:
            await refuse(scope, send, 404, "nothing is here; expected a flight that has ended")


def _protocols() -> Tuple[Any, Any]:
    from uvicorn.protocols.http.h11_impl import H11Protocol
    from uvicorn.protocols.websockets.auto import AutoWebSocketsProtocol

    return limited(H11Protocol, AutoWebSocketsProtocol)


def require_nicegui() -> None:
    """Check that NiceGUI is installed, without loading it.

    Raises:
        InputError: It is not.
    """
    if importlib.util.find_spec("nicegui") is None:
        raise InputError(
            [
                "web: NiceGUI is not installed; expected it from pip install 'quad-nav[web]', in a"
                " checkout from .venv/bin/pip install -r requirements-web.txt"
            ]
        )


def _nicegui_app(nicegui: Any, state: FleetState, actions: Actions, options: WebOptions) -> Any:
    """Return NiceGUI's application with the page; there is one application in a process."""
    page = importlib.import_module("quad_web.page")
    nicegui.app.config.add_run_config(
        reload=False,
        title=options.title,
        viewport="width=device-width, initial-scale=1",
        favicon="🚁",
        dark=None,  # as the reader prefers
        language="en-US",
        binding_refresh_interval=0.5,
        reconnect_timeout=10.0,  # a loaded machine may answer that late
        message_history_length=100,
        tailwind=False,
        prod_js=True,
        show_welcome_message=False,
    )
    limit_pages(nicegui)
    run: Any = importlib.import_module("nicegui.run")
    run.thread_pool = ThreadPoolExecutor(thread_name_prefix="web")  # the last server's has ended

    @nicegui.ui.page("/")
    def _index() -> None:
        role = nicegui.context.client.request.scope[ROLE]
        nicegui.ui.add_head_html(_HIDE_TOKEN)
        page.Page(state, actions if role is Role.STEER else WatchOnly(actions), role)

    return nicegui.app


def _bound(options: WebOptions) -> socket.socket:
    """Return a socket that listens where it is asked for."""
    family, place = _place(options)
    ports = [options.port] if options.port else range(_FIRST_PORT, _LAST_PORT + 1)
    problem = "all ports are in use"
    for port in ports:
        listener = socket.socket(family)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if options.address == "::":
            listener.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 0)
        if hasattr(socket, "TCP_USER_TIMEOUT"):
            # Who reads nothing for so long is cut off by the system, with what waits for it.
            # Connections have the option from here.
            listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _SILENT_FOR_MS)
        try:
            listener.bind((place[0], port, *place[2:]))
            listener.listen()
            return listener
        except OSError as error:
            listener.close()
            problem = error.strerror or str(error)
            if error.errno != errno.EADDRINUSE:
                break
    where = options.port or f"{_FIRST_PORT} to {_LAST_PORT}"
    raise InputError([f"web: cannot listen on {options.address}:{where}: {problem}"])


def _place(options: WebOptions) -> Tuple[Any, Tuple[Any, ...]]:
    """Return the family and the socket address of the address, which may be a name."""
    if not 0 <= options.port <= 65535:
        raise InputError([f"web: port {options.port}; expected 1 to 65535, or 0 for a free one"])
    try:
        found = socket.getaddrinfo(options.address, options.port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        raise InputError(
            [
                f"web: no address for {options.address} ({error}); expected an address or name of "
                "this machine, such as 0.0.0.0"
            ]
        ) from error
    family, _, _, _, place = found[0]
    return family, place


def _urls(address: str, port: int, tokens: Optional[Tokens]) -> Urls:
    if address in ("0.0.0.0", "::", ""):
        address = _outward_address()
    host = f"[{address}]" if ":" in address else address
    page = f"http://{host}:{port}/"
    if tokens is None:
        return Urls(page, page)
    return Urls(f"{page}?token={tokens.steer}", f"{page}?token={tokens.watch}")


def _outward_address() -> str:
    """Return the address that other machines reach this one by, or else its name."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # sends nothing
            return str(probe.getsockname()[0])
        except OSError:
            return socket.gethostname()
