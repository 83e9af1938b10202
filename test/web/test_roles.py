"""A page that may only watch: its controls are off, and the server obeys nothing that it sends."""

from __future__ import annotations

from browser import until

TOKENS = ("--robots", "2", "--steer-token", "steer-abc", "--watch-token", "watch-def")

# Sends every event of every element, as if a person had enabled and used all of the controls.
# Returns how many there were, once the server has handled all of them. Before the page's handshake
# it would ignore them.
FORGE = """
async () => {
  while (!window.did_handshake) await new Promise(requestAnimationFrame);
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


def test_who_watches_steers_nothing_and_who_has_no_token_sees_nothing(open_page, serve):
    server = serve(*TOKENS)
    watching = open_page(server.urls[1])
    watching.get_by_text("Watching only").wait_for()
    assert "token" not in watching.url
    assert watching.evaluate("document.cookie") == ""
    assert watching.evaluate(FORGE) > 50
    watching.watch.forgive("status of 404")  # it was sent to other addresses
    steering = open_page(server.urls[0])
    steering.get_by_text("Steering").wait_for()
    steering.reload()  # the cookie has the token
    steering.get_by_text("Steering").wait_for()
    assert server.calls() == []
    steering.evaluate(FORGE)
    until(steering, lambda: any("stop_all" in call for call in server.calls()), patience_s=40.0)
    server.forgive()  # handlers raise for events that no element sends
    steering.watch.forgive("status of 404")  # it was sent to other addresses
    page = open_page(None)
    problems = (("", "token missing"), ("?token=wrong", "wrong token"))
    for count, (query, problem) in enumerate(problems, start=1):
        answer = page.goto(server.url.partition("?")[0] + query)
        assert answer.status == 403
        assert page.inner_text("body").startswith(f"403: {problem}; expected the address")
        until(page, lambda count=count: len(page.watch.faults) >= count)
    page.watch.forgive("status of 403")
