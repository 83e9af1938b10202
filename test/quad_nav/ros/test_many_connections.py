"""Connections that wait at a node while it is busy."""

from __future__ import annotations

import contextlib
import socket
from types import SimpleNamespace

import pytest

pytest.importorskip("rospy")

from quad_nav.ros.common import rospy_repairs  # noqa: E402


def test_fifty_nodes_connect_while_one_accepts_none(monkeypatch):
    with contextlib.ExitStack() as opened:
        waiting = opened.enter_context(socket.socket())
        waiting.bind(("127.0.0.1", 0))
        waiting.listen(5)  # as rospy
        server = SimpleNamespace(
            start_server=lambda: None, tcp_ros_server=SimpleNamespace(server_sock=waiting)
        )
        monkeypatch.setattr(rospy_repairs, "init_tcpros_server", lambda: server)
        rospy_repairs.accept_many_connections()
        for _ in range(50):
            address = waiting.getsockname()
            opened.enter_context(socket.create_connection(address, timeout=0.9))
