"""Several clients of one server: a slow or silent one costs the others nothing."""

from __future__ import annotations

import pytest
from stream_client import open_stream


def test_a_client_that_does_not_acknowledge_gets_one_message_and_others_go_on(server):
    with open_stream(server.url) as silent, open_stream(server.url) as reading:
        silent.want()
        reading.want()
        first = silent.receive(acknowledge=False)
        times_s = [reading.item("flight")["time_s"] for _ in range(10)]
        assert times_s == sorted(set(times_s))  # ten different moments
        with pytest.raises(TimeoutError):
            silent.receive(timeout_s=0.3)
        assert first["seq"] == 0
