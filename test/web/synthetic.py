"""A made-up fleet, for tests, benches and work on the page.

Robots fly on circles around the obstacles of a round of pillars. Everything that a page can show
is there. Actions are recorded, and those that a page needs an answer of change what is shown::

    python3 test/web/synthetic.py --robots 20 --port 8090
"""

from __future__ import annotations

import argparse
import contextlib
import signal
import sys
import threading

from synthetic_actions import SyntheticActions, say
from synthetic_fleet import SyntheticFleet


def obey_input(actions: SyntheticActions) -> None:
    """Begin another flight at a line "again", and print any other line."""
    for line in sys.stdin:
        if line.strip() == "again":
            actions.renew()
            say("renewed")
        else:
            say(line.strip())


def main() -> None:
    from quad_web.server import WebOptions, serve

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", type=int, default=20)
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--address", default="127.0.0.1")
    parser.add_argument("--steer-token", default="")
    parser.add_argument("--watch-token", default="")
    parser.add_argument("--replay", type=float, help="be a recording of so many seconds")
    parser.add_argument("--obstacles", action="store_true", help="have two that move")
    parser.add_argument(
        "--calls",
        action="store_true",
        help="print each action's call; a line 'again' begins another flight",
    )
    args = parser.parse_args()
    fleet = SyntheticFleet(args.robots, obstacles=args.obstacles)
    fleet.duration_s = args.replay
    fleet.start()
    options = WebOptions(
        address=args.address,
        port=args.port,
        steer_token=args.steer_token,
        watch_token=args.watch_token,
        on_ready=say,
    )
    actions = SyntheticActions(fleet)
    if args.calls:
        actions.prints_calls = True
        threading.Thread(target=obey_input, args=[actions], daemon=True).start()
    # A shell's background job begins with Ctrl-C ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with contextlib.suppress(KeyboardInterrupt):
        serve(fleet.state, actions, options)


if __name__ == "__main__":
    main()
