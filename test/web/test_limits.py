"""What clients can do to the server without a browser: connections, heads, events, memory."""

from __future__ import annotations

import http.client
import re
import socket
import time
from urllib.parse import urlsplit

import nicegui
import pytest
from raw_page import channel, get, handshake_head, masked, memory_bytes, raw_page
from stream_client import open_stream
from synthetic import SyntheticFleet
from synthetic_actions import SyntheticActions
from websockets.exceptions import ConnectionClosed

from quad_web import connections, page_limits
from quad_web import server as web_server
from quad_web.server import Server, WebOptions

TOKENS = ("--steer-token", "steer-abc", "--watch-token", "watch-def")
PATIENCE_S = 20.0
MB = 10**6


@pytest.fixture
def here(monkeypatch):
    """A server in this process, whose system drops nobody."""
    monkeypatch.setattr(web_server, "_SILENT_FOR_MS", 600_000)
    fleet = SyntheticFleet(2)
    actions = SyntheticActions(fleet)
    fleet.start()
    server = Server(fleet.state, actions, WebOptions())
    server.start()
    yield server
    server.stop()
    fleet.stop()


@pytest.fixture
def opened():
    """Open connections with a source address; all are closed with the test."""
    sockets = []

    def start(url, source="127.0.0.1"):
        parts = urlsplit(url)
        one = socket.create_connection(
            (parts.hostname, parts.port), PATIENCE_S, source_address=(source, 0)
        )
        sockets.append(one)
        return one

    yield start
    for one in sockets:
        one.close()


def is_open(client):
    """Return whether the server has not closed a connection, of which nothing is to be read."""
    client.setblocking(False)
    try:
        return client.recv(1) != b""
    except BlockingIOError:
        return True
    except OSError:
        return False


def until(condition):
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end_s
        time.sleep(0.01)


def test_a_head_without_an_end_is_refused(serve, opened):
    server = serve()
    get(server.url)
    before = memory_bytes(server.process.pid)
    client = opened(server.url)
    client.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n")
    with pytest.raises(ConnectionError):
        for number in range(1600):
            client.sendall(b"X-%d: %s\r\n" % (number, b"x" * 60_000))
    assert memory_bytes(server.process.pid) - before < 20 * MB


def status_of(here, path, **headers):
    parts = urlsplit(here.urls.steer)
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=PATIENCE_S)
    connection.request("GET", path, headers=headers)
    return connection.getresponse().status


def test_a_head_of_many_cookies_is_taken_and_socket_io_needs_a_web_socket(here):
    assert status_of(here, "/favicon.ico", Cookie=f"other={'x' * 30_000}") == 200
    assert status_of(here, "/_nicegui_ws/socket.io/?EIO=4&transport=polling") == 404


def test_connections_without_requests_keep_nobody_out(here, opened):
    url = here.urls.steer
    silent = [opened(url) for _ in range(connections.MAX_CONNECTIONS + 50)]
    with raw_page(url) as page, open_stream(url) as stream:
        page.shake_hands()
        assert page.is_answered()
        stream.receive()
    assert sum(map(is_open, silent)) <= connections.MAX_OF_ADDRESS


def test_many_addresses_keep_nobody_out(here, opened, monkeypatch):
    monkeypatch.setattr(connections, "MAX_OF_ADDRESS", 16)
    monkeypatch.setattr(connections, "MAX_CONNECTIONS", 32)
    url = here.urls.steer
    silent = [opened(url, f"127.0.0.{address}") for address in (2, 3, 4, 5) for _ in range(16)]
    with raw_page(url) as page:
        page.shake_hands()
        assert page.is_answered()
    assert sum(map(is_open, silent)) <= 32


def test_web_sockets_of_one_address_leave_room_for_others(here, opened, monkeypatch):
    monkeypatch.setattr(connections, "MAX_OF_ADDRESS", 8)
    url = here.urls.steer
    held = [opened(url, "127.0.0.2") for _ in range(8)]
    for client in held:
        client.sendall(handshake_head(url))
        assert client.recv(12) == b"HTTP/1.1 101"
    late = opened(url, "127.0.0.2")
    until(lambda: not is_open(late))
    with raw_page(url) as page:
        page.shake_hands()
        assert page.is_answered()


def test_a_slow_head_is_cut_off_after_a_request_too(here, opened, monkeypatch):
    monkeypatch.setattr(connections, "HEAD_WITHIN_S", 0.5)
    client = opened(here.urls.steer)
    host = urlsplit(here.urls.steer).netloc
    begin_s = time.monotonic()
    client.sendall(f"HEAD /favicon.ico HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
    assert client.recv(12) == b"HTTP/1.1 200"
    time.sleep(0.1)
    client.recv(10_000)
    with pytest.raises(ConnectionError):
        while time.monotonic() < begin_s + PATIENCE_S:
            client.sendall(b"G")
            time.sleep(0.05)
    assert time.monotonic() - begin_s >= 0.5


def test_a_page_outlives_the_time_for_a_head(here, monkeypatch):
    monkeypatch.setattr(connections, "HEAD_WITHIN_S", 0.2)
    with raw_page(here.urls.steer) as page:
        page.shake_hands()
        time.sleep(1.0)
        assert page.is_answered()


def test_a_client_that_reads_no_answers_is_dropped(here, opened, monkeypatch):
    monkeypatch.setattr(connections, "READS_WITHIN_S", 0.5)
    client = opened(here.urls.steer)
    host = urlsplit(here.urls.steer).netloc
    with pytest.raises(ConnectionError):
        while True:
            client.sendall(f"GET / HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
            time.sleep(0.01)


def test_a_client_that_pings_and_does_not_read_is_dropped(here, opened, monkeypatch):
    monkeypatch.setattr(connections, "MAX_UNREAD", 10**5)
    client = opened(here.urls.steer)
    client.sendall(handshake_head(here.urls.steer))
    assert client.recv(12) == b"HTTP/1.1 101"
    with pytest.raises(ConnectionError):
        for _ in range(10**4):
            client.sendall(masked(9, b"x" * 125) * 100)


def test_wrong_events_of_a_watching_page_print_a_line_each(serve):
    server = serve(*TOKENS)
    server.forgive()
    with raw_page(server.urls[1]) as page:
        page.shake_hands()
        for args in ([], ["null"], ["{}"], ["1"], ['"x"'], ["{"], 3):
            for element, listener in (*page.listeners, (0, "none"), (0, 7), (-1, ""), ("x", "")):
                name = {"id": element, "client_id": page.id, "listener_id": listener}
                page.emit("event", {**name, "args": args})
        for message in (None, 1, "x", [], {}, {"client_id": page.id}, {"client_id": {}}):
            for name in ("handshake", "event", "javascript_response", "ack", "unknown"):
                page.emit(name, message)
        page.emit("ack", {"client_id": page.id, "next_message_id": "x"})
        assert page.is_answered()
    with raw_page(server.urls[0]) as page:
        page.shake_hands()
        assert page.is_answered()
    assert server.calls() == []
    complaints = [line for line in server.lines if not line.startswith("mark")]
    assert 10 < len(complaints) < 30
    assert all(re.match(r"web: .*\w: .*\(\w+\.py:\d+\)$", line) for line in complaints)


def test_a_connected_page_is_not_forgotten_and_others_are(here, monkeypatch):
    monkeypatch.setattr(page_limits, "MAX_OPENING", 4)
    with raw_page(here.urls.steer) as page:
        page.shake_hands()
        assert page.is_answered()
        for _ in range(9):
            get(here.urls.steer)
        assert page.id in nicegui.Client.instances
        assert len(nicegui.Client.instances) <= 4 + 3  # NiceGUI has one of its own
        assert page.is_answered()


def test_a_page_has_one_name_that_is_not_long(here):
    with raw_page(here.urls.steer) as page:
        page.shake_hands(tab_id="x" * 100_000)
        assert page.is_answered()
        assert not nicegui.Client.instances[page.id].has_socket_connection
        for number in range(5):
            page.shake_hands(tab_id=f"tab {number}")
        assert page.is_answered()
    names = {name for name in nicegui.app.storage._tabs if name.startswith("tab ")}
    assert names == {"tab 0"}


def test_a_page_sends_no_binary_messages(here):
    with raw_page(here.urls.steer) as page:
        page.socket.send('459999-["event",{"a":{"_placeholder":true,"num":0}}]')
        page.socket.send(b"x" * 1000)
        with pytest.raises(ConnectionClosed):
            while True:
                assert page.socket.recv(PATIENCE_S) != "2"  # a ping, which would wait for an answer


def test_a_page_that_reads_too_slowly_is_disconnected_and_comes_back(here, monkeypatch):
    monkeypatch.setattr(page_limits, "MAX_WAITING", 3)
    monkeypatch.setattr(connections, "READS_WITHIN_S", 0.5)
    with raw_page(here.urls.steer) as page:
        page.shake_hands()
        assert page.is_answered()
        client = nicegui.Client.instances[page.id]
        text = "x" * 1_000_000

        def send():
            for _ in range(50):
                client.run_javascript(text)

        nicegui.core.loop.call_soon_threadsafe(send)
        until(lambda: not client.has_socket_connection)
        with channel(here.urls.steer, page.id) as page.socket:
            page.shake_hands(next_message_id=client.outbox.next_message_id)
            assert page.is_answered()
            nicegui.core.loop.call_soon_threadsafe(client.run_javascript, "again")
            while "again" not in page.socket.recv(PATIENCE_S):
                pass
