"""Who may see the page, and who may steer.

Every request passes through ``Access`` before anything else, also those of WebSockets and of
NiceGUI's own channel:

* The name in ``Host`` must be one of the server's, so that no other site can be resolved to this
  address (DNS rebinding).
* ``Origin``, which browsers send with WebSockets and with requests of other sites, must be the
  page's own, and ``Sec-Fetch-Site`` must not name another site.
* With tokens, one of them must be in the URL, as ``?token=...``, or in the cookie that the page
  sets then. Tokens are compared in constant time.

Answers have headers that keep the page out of frames, and let it load and contact nothing but its
own server.
"""

from __future__ import annotations

import contextlib
import ipaddress
import secrets
import socket
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from typing import Any, Awaitable, Callable, Dict, FrozenSet, List, MutableMapping, Optional, Tuple
from urllib.parse import parse_qs, urlsplit

from quad_nav.errors import QuadError
from quad_web.view.actions import Role
from quad_web.view.result import REPORT, SUMMARY

ROLE = "quad.role"
"""Key of the role in the scope of a request."""

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Message, Receive, Send], Awaitable[None]]
Headers = List[Tuple[bytes, bytes]]

_PATHS = ("/_nicegui/", "/_nicegui_ws/")  # below these; uploads are elsewhere
_CACHED = ("static", "libraries", "components", "resources")  # their URLs change with them
_OWN_SITES = ("none", "same-origin")  # typed by a person, or of the page; none is another port's
_LOOPBACK_NAMES = frozenset({"localhost", "127.0.0.1", "::1"})


class Forbidden(QuadError):
    """A request is refused; the text is the answer."""


@dataclass(frozen=True)
class Tokens:
    """The token that allows to steer, and the one that allows to watch."""

    steer: str
    watch: str

    def role(self, token: str) -> Optional[Role]:
        """Return what a token allows, None for a wrong one; the time does not depend on it."""
        given = token.encode("utf-8", "replace")
        steers = secrets.compare_digest(given, self.steer.encode())
        watches = secrets.compare_digest(given, self.watch.encode())
        return Role.STEER if steers else Role.WATCH if watches else None


def is_loopback(address: str) -> bool:
    """Return whether an address or name reaches the own machine only."""
    with contextlib.suppress(ValueError):
        return address == "localhost" or ipaddress.ip_address(address).is_loopback
    return False


class Access:
    """Refuses requests, and passes all others on with their role in ``scope[ROLE]``.

    Without tokens everyone steers who reaches the server, which listens on an address or name.
    """

    def __init__(self, app: Application, address: str, port: int, tokens: Optional[Tokens]) -> None:
        self._app = app
        self._names = _own_names(address)
        self._any_number = not is_loopback(address)
        self._tokens = tokens
        self._cookie = f"quad_token_{port}"  # cookies are shared by all ports of a host

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Answer a request; an ASGI application."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = _headers(scope)
        try:
            self._check_host(headers)
            _check_origin(headers)
            scope[ROLE], token = self._role(scope, headers)
        except Forbidden as forbidden:
            await refuse(scope, send, 403, str(forbidden))
            return
        if not _is_served(scope):
            await refuse(scope, send, 404, f"nothing is here; expected {headers['host']}/")
            return
        added = _security_headers(scope["path"], headers["host"])
        if token and scope["path"] == "/":
            cookie = f"{self._cookie}={token}; Path=/; HttpOnly; SameSite=Strict"
            added.append((b"set-cookie", cookie.encode("latin-1")))
        await self._app(scope, receive, _with_headers(send, added))

    def _check_host(self, headers: Dict[str, str]) -> None:
        name = _host_name(headers.get("host", ""))
        if name not in self._names and not (self._any_number and _is_address(name)):
            raise Forbidden(
                "the name of this server is wrong; expected the address that quad printed"
            )

    def _role(self, scope: Message, headers: Dict[str, str]) -> Tuple[Role, str]:
        """Return the role, and the token if it is in the URL."""
        if self._tokens is None:
            return Role.STEER, ""
        query = parse_qs(scope.get("query_string", b"").decode("latin-1"))
        in_url = query.get("token", [""])[0]
        token = in_url or _cookie(headers.get("cookie", ""), self._cookie)
        role = self._tokens.role(token)
        if role is None:
            problem = "wrong token" if token else "token missing"
            raise Forbidden(f"{problem}; expected the address that quad printed, with its token")
        return role, in_url


def _own_names(address: str) -> FrozenSet[str]:
    if is_loopback(address):
        return _LOOPBACK_NAMES | {address}
    name = socket.gethostname().lower()
    return _LOOPBACK_NAMES | {address.lower(), name, f"{name.partition('.')[0]}.local"}


def _headers(scope: Message) -> Dict[str, str]:
    """Return the headers by lower-case name; one that is there twice has both values."""
    headers: Dict[str, str] = {}
    for raw_name, raw_value in scope["headers"]:
        name, value = raw_name.decode("latin-1").lower(), raw_value.decode("latin-1")
        separator = "; " if name == "cookie" else ", "
        headers[name] = f"{headers[name]}{separator}{value}" if name in headers else value
    return headers


def _host_name(host: str) -> str:
    """Return the name in a ``Host``, "" for one that is not valid."""
    try:
        parts = urlsplit(f"//{host}")
        _ = parts.port  # raises for one that is no number
    except ValueError:
        return ""
    return (parts.hostname or "") if parts.netloc == host and "@" not in host else ""


def _is_address(name: str) -> bool:
    with contextlib.suppress(ValueError):
        return bool(ipaddress.ip_address(name))
    return False


def _check_origin(headers: Dict[str, str]) -> None:
    host, origin = headers["host"].lower(), headers.get("origin")
    is_foreign = origin is not None and origin.lower() not in (f"http://{host}", f"https://{host}")
    # An image or a link of another page has no Origin.
    if is_foreign or headers.get("sec-fetch-site", "none").strip().lower() not in _OWN_SITES:
        raise Forbidden(
            f"the request comes from another site; expected one from {host}, or the address typed "
            "into the browser"
        )


def _cookie(text: str, name: str) -> str:
    try:
        cookie = SimpleCookie(text).get(name)
    except CookieError:
        return ""
    return cookie.value if cookie else ""


def _is_served(scope: Message) -> bool:
    path, method = scope["path"], scope.get("method", "GET")
    if scope["type"] == "http" and path in ("/", "/favicon.ico", REPORT, SUMMARY):
        return method in ("GET", "HEAD")
    if path.startswith("/_nicegui/"):
        return method in ("GET", "HEAD")
    return path.startswith(_PATHS) or (scope["type"] == "websocket" and path == "/stream")


def _security_headers(path: str, host: str) -> Headers:
    # NiceGUI's page has inline scripts and styles, and Vue compiles templates.
    policy = (
        "default-src 'self'; script-src 'self' blob: 'unsafe-inline' 'unsafe-eval'; "
        "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
        f"worker-src 'self' blob:; connect-src 'self' ws://{host} wss://{host}; "
        "object-src 'none'; base-uri 'self'; form-action 'none'; frame-ancestors 'none'"
    )
    parts = path.split("/")
    is_cached = path.startswith("/_nicegui/") and len(parts) > 4 and parts[3] in _CACHED
    return [
        (b"content-security-policy", policy.encode("latin-1")),
        (b"x-content-type-options", b"nosniff"),
        (b"x-frame-options", b"DENY"),
        (b"referrer-policy", b"no-referrer"),
        (b"cross-origin-resource-policy", b"same-origin"),
        (b"cross-origin-opener-policy", b"same-origin"),
        (b"cache-control", b"private, max-age=31536000, immutable" if is_cached else b"no-cache"),
    ]


def _with_headers(send: Send, added: Headers) -> Send:
    names = {name for name, _ in added}

    async def send_with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            own = [(name, value) for name, value in message["headers"] if name not in names]
            message = {**message, "headers": [*own, *added]}
        await send(message)

    return send_with_headers


async def refuse(scope: Message, send: Send, status: int, text: str) -> None:
    """Answer a request with a sentence, or close a WebSocket before it is accepted."""
    if scope["type"] == "websocket":
        await send({"type": "websocket.close"})  # before it is accepted: the answer is 403
        return
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"cache-control", b"no-store")]
    headers.append((b"x-content-type-options", b"nosniff"))
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": f"{status}: {text}\n".encode()})
