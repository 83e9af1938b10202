"""``python3 -m quad_nav.ros.common.respawn COMMAND [ARGUMENT...]``: runs a node, and again when killed.

roslaunch's ``respawn`` takes a node that has finished for one that has died, and forbids
``required`` beside it. As a ``launch-prefix`` this knows the difference: a node that ends
by itself has ended, and its exit status is ours. One that a signal killed is started again,
with ``--again`` behind its arguments.
"""

from __future__ import annotations

import ctypes
import signal
import subprocess
import sys
import threading
from typing import List

AGAIN = "--again"
DELAY_S = 1.0
_PR_SET_PDEATHSIG = 1  # linux/prctl.h


def main() -> int:
    """The command's exit status; 128 and the signal's number when we ended it by one."""
    command, ended = sys.argv[1:], threading.Event()
    child = _start(command)

    def end(number: int, _frame: object) -> None:
        ended.set()
        child.send_signal(number)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)
    while True:
        status = child.wait()
        if status >= 0 or ended.is_set():
            return status if status >= 0 else 128 - status
        print(
            f"{command[0]}: killed by {signal.Signals(-status).name}, started again",
            file=sys.stderr,
            flush=True,
        )
        if ended.wait(DELAY_S):
            return 128 - status
        child = _start([*command, AGAIN])


def _start(command: List[str]) -> subprocess.Popen:
    return subprocess.Popen(command, preexec_fn=_end_with_parent)


def _end_with_parent() -> None:
    """Nobody would see to a node whose parent was killed."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


if __name__ == "__main__":
    sys.exit(main())
