"""A page that may only watch: its controls are off, and the server obeys nothing that it sends."""

from __future__ import annotations

import pytest
from browser import until

TOKENS = ("--steer-token", "steer-abc", "--watch-token", "watch-def")

# Sends every event of every element, as if a person had enabled and used all of the controls.
# Returns how many there were, once the server has handled all of them.
FORGE = """
async () => {
  const handled = [];
  for (const [id, element] of Object.entries(mounted_app.elements)) {
    for (const event of element.events ?? []) {
      for (const args of [[], ["null"], ["{}"], ["1"], ['"x"']]) {
        const listener_id = event.listener_id;
        const message = { id: Number(id), client_id: window.clientId, listener_id, args };
        handled.push(new Promise((resolve) => window.socket.emit("event", message, resolve)));
      }
    }
  }
  await Promise.all(handled);
  return handled.length;
}
"""


@pytest.fixture
def server(serve):
    return serve("--robots", "2", *TOKENS)


def open_ready(open_page, url):
    page = open_page(url)
    page.get_by_text("synthetic, 2 robots").wait_for()
    return page


def test_the_page_says_which_it_is(open_page, server):
    steering, watching = (open_ready(open_page, url) for url in server.urls)
    steering.get_by_text("Steering").wait_for()
    watching.get_by_text("Watching only").wait_for()


def test_the_token_does_not_stay_in_the_address(open_page, server):
    page = open_ready(open_page, server.urls[0])
    assert "token" not in page.url
    assert "steer-abc" not in page.evaluate("document.cookie")
    page.reload()
    page.get_by_text("Steering").wait_for()


def test_what_a_watching_page_forges_is_not_done(open_page, server):
    watching = open_ready(open_page, server.urls[1])
    assert watching.evaluate(FORGE) > 50
    steering = open_ready(open_page, server.urls[0])
    assert server.calls() == []
    steering.evaluate(FORGE)
    until(steering, lambda: any("stop_all" in call for call in server.calls()), patience_s=40.0)
    server.forgive()  # handlers raise for events that no element sends


def test_a_wrong_token_gets_a_sentence_instead_of_the_page(open_page, server):
    page = open_page(None)
    problems = (("", "token missing"), ("?token=wrong", "wrong token"))
    for count, (query, problem) in enumerate(problems, start=1):
        answer = page.goto(server.url.partition("?")[0] + query)
        assert answer.status == 403
        assert page.inner_text("body").startswith(f"403: {problem}; expected the address")
        until(page, lambda count=count: len(page.watch.faults) >= count)
    page.watch.forgive("status of 403")
