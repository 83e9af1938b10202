"""Who is let in: tokens, hosts, origins and paths, without a server."""

from __future__ import annotations

import asyncio
import socket

import pytest

from quad_nav.errors import InputError
from quad_web.access import ROLE, Access, Tokens, is_loopback
from quad_web.server import WebOptions
from quad_web.view.actions import Role

TOKENS = Tokens("steer-abc", "watch-def")


class Answer:
    """Status, headers and body of an answer, and the role with which the application was called."""

    def __init__(self):
        self.status, self.headers, self.body, self.role = None, {}, b"", None

    async def take(self, message):
        if message["type"] == "http.response.start":
            self.status = message["status"]
            self.headers = {name.decode(): value.decode() for name, value in message["headers"]}
        elif message["type"] == "websocket.close":
            self.status = 403
        elif message["type"] == "websocket.accept":
            self.status = 101
        else:
            self.body += message["body"]


def ask(
    path="/",
    query="",
    host="127.0.0.1:8080",
    kind="http",
    method="GET",
    tokens=None,
    address="127.0.0.1",
    **headers,
):
    answer = Answer()

    async def app(scope, receive, send):
        answer.role = scope[ROLE]
        if kind == "websocket":
            await send({"type": "websocket.accept"})
            return
        own = [(b"cache-control", b"own"), (b"content-type", b"text/html")]
        await send({"type": "http.response.start", "status": 200, "headers": own})
        await send({"type": "http.response.body", "body": b"page"})

    scope = {
        "type": kind,
        "path": path,
        "query_string": query.encode(),
        "headers": [
            (b"host", host.encode()),
            *((k.encode(), v.encode()) for k, v in headers.items()),
        ],
    }
    if kind == "http":
        scope["method"] = method
    asyncio.run(Access(app, address, 8080, tokens)(scope, None, answer.take))
    return answer


PLACES = [
    ("http", "/"),
    ("http", "/_nicegui/2/static/x.js"),
    ("websocket", "/stream"),
    ("websocket", "/_nicegui_ws/socket.io/"),
]


@pytest.mark.parametrize("kind, path", PLACES)
def test_other_sites_names_and_tokens_are_refused_everywhere(kind, path):
    """A site whose name leads to this address (DNS rebinding) has its own name in Host."""
    right = {"kind": kind, "query": "token=steer-abc", "tokens": TOKENS}
    for site in ("cross-site", "same-site", "Cross-Site", "", "other"):
        assert ask(path, **right, **{"sec-fetch-site": site}).status == 403, site
    for origin in ("http://evil.example", "null", "http://127.0.0.1:8081", "ftp://127.0.0.1:8080"):
        assert ask(path, **right, origin=origin).status == 403, origin
    for host in (
        "evil.example",
        "127.0.0.1.evil.example",
        "localhost@evil.example",
        "",
        "10.0.0.1:8080",
        "localhost:x",
        "localhost/..",
        "localhost, evil.example",
        "[::1",
    ):
        assert ask(path, **right, host=host).status == 403, host
    for token in ("", "steer-ab", "steer-abcx", "STEER-ABC", "ä", "%00", "watch-de", "None", "*"):
        answer = ask(path, f"token={token}", kind=kind, tokens=TOKENS)
        assert (answer.status, answer.role) == (403, None), token
        assert "set-cookie" not in answer.headers
    assert ask(path, kind=kind, tokens=TOKENS, cookie="quad_token_8080=wrong").status == 403
    for headers in (
        {},
        {"origin": "http://127.0.0.1:8080"},
        {"origin": "https://127.0.0.1:8080"},
        {"sec-fetch-site": "same-origin"},
        {"sec-fetch-site": "none"},
    ):
        answer = ask(path, **right, **headers)
        assert answer.status in (101, 200) and answer.role is Role.STEER
    for host in ("localhost", "localhost:9000", "[::1]:8080", "127.0.0.1", "LOCALHOST:1"):
        assert ask(path, **right, host=host).status in (101, 200), host


def test_a_refusal_says_what_is_missing():
    expected = b"403: token missing; expected the address that quad printed, with its token\n"
    assert ask(tokens=TOKENS).body == expected
    assert ask(query="token=no", tokens=TOKENS).body.startswith(b"403: wrong token; ")
    assert ask(query="a=b&token=watch-def", tokens=TOKENS).role is Role.WATCH


def test_on_loopback_everyone_steers():
    answer = ask()
    assert (answer.status, answer.role, answer.body) == (200, Role.STEER, b"page")
    assert "set-cookie" not in answer.headers


def test_with_an_address_numbers_and_the_own_names_are_let_in():
    outside = {"address": "0.0.0.0", "tokens": TOKENS, "query": "token=steer-abc"}
    name = socket.gethostname()
    for host in ("192.168.1.20:8080", "[fe80::1]:8080", f"{name}:8080", "localhost"):
        assert ask(host=host, **outside).status == 200, host
    assert ask(host="evil.example", **outside).status == 403
    assert ask(host="lab.example:8080", **{**outside, "address": "lab.example"}).status == 200


def test_the_token_is_remembered_in_a_cookie_that_scripts_cannot_read():
    answer = ask(query="token=watch-def", tokens=TOKENS)
    cookie, *attributes = answer.headers["set-cookie"].split("; ")
    assert (cookie, set(attributes)) == (
        "quad_token_8080=watch-def",
        {"Path=/", "HttpOnly", "SameSite=Strict"},
    )
    again = ask("/stream", kind="websocket", tokens=TOKENS, cookie=f"other=1; {cookie}")
    assert (again.status, again.role) == (101, Role.WATCH)


def test_a_wrong_token_in_the_address_counts_more_than_a_right_cookie():
    cookie = "quad_token_8080=steer-abc"
    assert ask(query="token=no", tokens=TOKENS, cookie=cookie).status == 403
    assert ask(query="token=watch-def", tokens=TOKENS, cookie=cookie).role is Role.WATCH


@pytest.mark.parametrize(
    "path, method, kind",
    [
        ("/", "POST", "http"),
        ("/docs", "GET", "http"),
        ("/_nicegui/client/1/upload/2", "POST", "http"),
        ("/stream", "GET", "http"),
        ("/other", "GET", "websocket"),
    ],
)
def test_nothing_else_is_served(path, method, kind):
    answer = ask(path, method=method, kind=kind)
    assert (answer.status, answer.role) == (404 if kind == "http" else 403, None)


def test_answers_keep_the_page_to_itself():
    headers = ask().headers
    policy = dict(part.split(" ", 1) for part in headers["content-security-policy"].split("; "))
    assert policy["default-src"] == "'self'"
    assert policy["frame-ancestors"] == "'none'"
    assert policy["connect-src"] == "'self' ws://127.0.0.1:8080 wss://127.0.0.1:8080"
    assert (headers["x-content-type-options"], headers["referrer-policy"]) == (
        "nosniff",
        "no-referrer",
    )
    assert (headers["cache-control"], headers["content-type"]) == ("no-cache", "text/html")
    cached = ask("/_nicegui/2.24/components/abc/arena.js").headers["cache-control"]
    assert cached == "private, max-age=31536000, immutable"
    assert ask("/_nicegui/2.24/dynamic_resources/x").headers["cache-control"] == "no-cache"


def test_tokens_are_made_up_where_others_reach_the_page():
    assert all(map(is_loopback, ("127.0.0.1", "127.8.0.1", "::1", "localhost")))
    assert not any(map(is_loopback, ("0.0.0.0", "::", "192.168.1.1", "localhost.example", "")))
    assert WebOptions().tokens() is None
    first, second = WebOptions(address="0.0.0.0").tokens(), WebOptions(address="0.0.0.0").tokens()
    assert len({first.steer, first.watch, second.steer, second.watch}) == 4
    assert len(first.steer) == 32
    assert WebOptions(steer_token="abc").tokens().steer == "abc"
    for faulty in (
        {"steer_token": "a b"},
        {"watch_token": "ä"},
        {"steer_token": "a", "watch_token": "a"},
    ):
        with pytest.raises(InputError, match="web: "):
            WebOptions(**faulty).tokens()
