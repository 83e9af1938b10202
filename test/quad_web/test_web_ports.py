"""Where the web server listens, and what it says when it cannot."""

from __future__ import annotations

from contextlib import closing
from urllib.parse import urlsplit

import pytest

from quad_nav.errors import InputError
from quad_web.access import Tokens
from quad_web.server import Urls, WebOptions, _bound, _urls


def test_a_port_is_taken_before_the_server_runs():
    with closing(_bound(WebOptions())) as first, closing(_bound(WebOptions())) as second:
        port = first.getsockname()[1]
        assert second.getsockname()[1] > port >= 8080
        with pytest.raises(InputError, match=f"web: cannot listen on 127.0.0.1:{port}: "):
            _bound(WebOptions(port=port))


@pytest.mark.parametrize(
    "options, problem",
    [
        ({"port": 65536}, "port 65536; expected 1 to 65535, or 0"),
        ({"port": -1}, "port -1; expected"),
        ({"address": "no such name"}, "no address for no such name "),
        ({"address": "192.0.2.1"}, "cannot listen on 192.0.2.1:8080 to 8179: "),  # no machine's
    ],
)
def test_places_that_cannot_be_had_are_named(options, problem):
    with pytest.raises(InputError) as refused:
        _bound(WebOptions(**options))
    assert str(refused.value).startswith(f"web: {problem}")


@pytest.mark.parametrize(
    "address, tokens, steer, watch",
    [
        ("127.0.0.1", None, "http://127.0.0.1:8080/", "http://127.0.0.1:8080/"),
        ("::1", None, "http://[::1]:8080/", "http://[::1]:8080/"),
        ("lab", Tokens("a", "b"), "http://lab:8080/?token=a", "http://lab:8080/?token=b"),
    ],
)
def test_addresses_of_the_page(address, tokens, steer, watch):
    assert _urls(address, 8080, tokens) == Urls(steer, watch)


def test_all_addresses_are_shown_as_one_that_others_reach():
    host = urlsplit(_urls("0.0.0.0", 8080, Tokens("a", "b")).steer).hostname
    assert host not in ("0.0.0.0", None)
