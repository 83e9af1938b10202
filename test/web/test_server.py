"""A real server: its sockets, tokens on the wire, clients that do not read, and its end."""

from __future__ import annotations

import http.client
import os
import signal
import socket
import struct
import threading
import time
from urllib.parse import urlsplit

import pytest
from raw_page import handshake_head
from stream_client import open_stream
from synthetic import SyntheticFleet
from synthetic_actions import SyntheticActions
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from quad_web import stream as web_stream
from quad_web.server import Server, WebOptions

TOKENS = {"steer_token": "steer-abc", "watch_token": "watch-def"}
PATIENCE_S = 20.0
LISTENS = "0A"


@pytest.fixture
def fleet():
    fleet = SyntheticFleet(3)
    fleet.start()
    yield fleet
    fleet.stop()


@pytest.fixture
def here(fleet):
    """Start a server in this process with options."""
    servers = []

    def start(**options):
        server = Server(fleet.state, SyntheticActions(fleet), WebOptions(**options))
        servers.append(server)
        server.start()
        return server

    yield start
    for server in servers:
        server.stop()


def until(condition):
    """Wait until a condition holds."""
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end_s
        time.sleep(0.01)


def get(url, path=None, **headers):
    """Return the status, headers and body of an answer."""
    parts = urlsplit(url)
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=PATIENCE_S)
    connection.request("GET", path or f"/?{parts.query}", headers=headers)
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer.status, answer.headers, body


def listening(pid):
    """Return (address, port) of the TCP sockets on which a process listens, and of UDP ones."""
    own = {os.readlink(f"/proc/{pid}/fd/{name}") for name in os.listdir(f"/proc/{pid}/fd")}
    places = []
    for table, family in (
        ("tcp", socket.AF_INET),
        ("tcp6", socket.AF_INET6),
        ("udp", socket.AF_INET),
        ("udp6", socket.AF_INET6),
    ):
        with open(f"/proc/{pid}/net/{table}") as file:
            rows = [line.split() for line in file.readlines()[1:]]
        for row in rows:
            if f"socket:[{row[9]}]" in own and (row[3] == LISTENS or table.startswith("udp")):
                number, port = row[1].split(":")
                words = [
                    struct.pack("=I", int(number[k : k + 8], 16)) for k in range(0, len(number), 8)
                ]
                places.append((socket.inet_ntop(family, b"".join(words)), int(port, 16)))
    return places


def test_by_default_it_listens_on_loopback_alone(server):
    with open_stream(server.url) as stream:
        stream.receive()
        assert listening(server.process.pid) == [("127.0.0.1", urlsplit(server.url).port)]


def test_with_an_address_it_listens_there(serve):
    server = serve("--address", "0.0.0.0")
    (place,) = listening(server.process.pid)
    assert place[0] == "0.0.0.0"
    assert all("?token=" in url for url in server.urls)
    assert server.urls[0] != server.urls[1]


def test_what_others_get_is_compressed(here):
    for address, expected in (("127.0.0.1", None), ("0.0.0.0", "gzip")):
        server = here(address=address, **TOKENS)
        url = f"http://127.0.0.1:{server.port}/?token=steer-abc"
        _, headers, _ = get(url, **{"Accept-Encoding": "gzip"})
        assert headers["content-encoding"] == expected
        with connect(f"ws://127.0.0.1:{server.port}/stream?token=steer-abc") as stream:
            extensions = stream.response.headers.get("Sec-WebSocket-Extensions", "")
        assert ("permessage-deflate" in extensions) == (expected == "gzip")
        server.stop()


def test_ipv6(here):
    server = here(address="::1")
    assert server.urls.steer.startswith("http://[::1]:")
    assert get(server.urls.steer)[0] == 200
    with open_stream(server.urls.steer) as stream:
        assert stream.item("scene")["altitude_m"] == 1.0


def test_wrong_tokens_and_other_sites_see_nothing(here):
    server = here(**TOKENS)
    status, headers, body = get(server.urls.steer, "/?token=wrong")
    assert (status, headers["set-cookie"]) == (403, None) and b"script" not in body
    assert get(server.urls.steer, Host="evil.example")[0] == 403
    assert get(server.urls.steer, "/_nicegui_ws/socket.io/?EIO=4&transport=polling")[0] == 403
    for path in ("/stream?", "/_nicegui_ws/socket.io/?EIO=4&transport=websocket&"):
        for query, origin in (
            ("", None),
            ("token=wrong", None),
            ("token=steer-abc", "http://evil.example"),
            ("token=steer-abc", f"http://localhost:{server.port}"),
        ):
            with pytest.raises(InvalidStatus, match="HTTP 403"):
                with connect(f"ws://127.0.0.1:{server.port}{path}{query}", origin=origin):
                    pass
    status, headers, _ = get(server.urls.watch)
    cookie = headers["set-cookie"].split(";")[0]  # replaces the token
    assert (status, cookie.split("=")[1]) == (200, "watch-def")
    assert get(server.urls.watch, "/", Cookie=cookie)[0] == 200
    assert get(server.urls.watch, "/", Cookie=cookie[:-1])[0] == 403


def test_a_client_that_does_not_read_is_dropped_and_costs_others_nothing(here, fleet, monkeypatch):
    monkeypatch.setattr(web_stream, "ACKNOWLEDGES_WITHIN_S", 3.0)
    server = here()
    place = ("127.0.0.1", urlsplit(server.urls.steer).port)
    deaf = socket.create_connection(place)
    deaf.sendall(handshake_head(server.urls.steer))
    until(lambda: len(fleet.state.wanted()) == 1)
    with open_stream(server.urls.steer) as reading:
        reading.want(["scan"])
        times_s = [reading.item("flight")["time_s"] for _ in range(5)]
        assert times_s == sorted(set(times_s))
        while len(fleet.state.wanted()) == 2:
            reading.receive()
        assert [wanted.layers for wanted in fleet.state.wanted()] == [{"scan"}]
    deaf.close()


def test_a_stop_closes_connections_and_frees_the_port(here, fleet):
    server = here()
    port = urlsplit(server.urls.steer).port
    with connect(f"ws://127.0.0.1:{port}/stream") as stream:
        stream.recv(PATIENCE_S)
        threading.Thread(target=server.stop).start()
        with pytest.raises(ConnectionClosed) as closed:
            for _ in range(100):
                stream.recv(PATIENCE_S)
    assert closed.value.rcvd.code == 1012  # the service restarts
    server.wait()
    assert fleet.state.wanted() == ()
    again = here(port=port)
    assert get(again.urls.steer)[0] == 200


def test_ctrl_c_ends_a_server_with_an_open_page(serve):
    server = serve()
    with open_stream(server.url) as stream:
        stream.receive()
        server.process.send_signal(signal.SIGINT)
        assert server.process.wait(PATIENCE_S) == 0


def test_no_folder_is_made(serve, tmp_path, monkeypatch):
    """NiceGUI keeps what it stores in .nicegui; nothing is stored."""
    monkeypatch.chdir(tmp_path)
    server = serve()
    assert get(server.url)[0] == 200
    assert list(tmp_path.iterdir()) == []
