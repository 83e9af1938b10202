"""Run a node and restart it when a signal kills it.

    run_module quad_nav.mission.respawn [--end-roslaunch | --after-error] COMMAND [ARGUMENT...]

The launch files use this as the `launch-prefix` of nodes. roslaunch's own `respawn` also restarts
a node that has finished, and excludes `required`. Here, a node that exits ends this program with
the same status. A node that a signal kills is restarted with `--respawned` as its last argument, so
that it goes on where it was: the sequencer resumes its mission from the journal.

With `--end-roslaunch`, a node that exits ends the roslaunch that started this program, as Ctrl-C
does. A node that is `required` does the same, but roslaunch reports that in red, also after a
mission that has succeeded.

With `--after-error`, a node that ends with 1, Python's status after an exception, is restarted too.
"""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import List

from quad_nav.errors import printable

RESPAWNED = "--respawned"
END_ROSLAUNCH, AFTER_ERROR = "--end-roslaunch", "--after-error"
DELAY_S = 1.0
ENDS_WITHIN_S = 15.0
ROSLAUNCH = (b"roslaunch", b"quiet_roslaunch")
_PR_SET_PDEATHSIG = 1  # linux/prctl.h


def main() -> int:
    """Run the command of the command line and restart it when it is killed.

    Returns:
        The command's exit status, or 128 plus the number of the signal passed on to it.
    """
    command, ended = sys.argv[1:], threading.Event()
    option = command.pop(0) if command[0] in (END_ROSLAUNCH, AFTER_ERROR) else ""
    child = _start(command)

    def end(number: int, _frame: object) -> None:
        ended.set()
        child.send_signal(number)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)
    while True:
        status = child.wait()
        result = status if status >= 0 else 128 - status
        is_fault = status < 0 or (option == AFTER_ERROR and status == 1)
        if not is_fault or ended.is_set():
            if option == END_ROSLAUNCH and not ended.is_set() and _end_roslaunch():
                ended.wait(ENDS_WITHIN_S)  # roslaunch calls the end of a node in red
            return result
        what = "ended with an error" if status > 0 else f"killed by {signal.Signals(-status).name}"
        print(f"{printable(command[0])}: {what}, restarting", file=sys.stderr, flush=True)
        if ended.wait(DELAY_S):
            return result
        child = _start([*command, RESPAWNED])


def _start(command: List[str]) -> subprocess.Popen[bytes]:
    return subprocess.Popen(command, preexec_fn=_end_with_parent)


def _end_roslaunch() -> bool:
    """Interrupt the parent process if it is roslaunch, and return whether it is."""
    parent = os.getppid()
    try:
        words = Path(f"/proc/{parent}/cmdline").read_bytes().split(b"\0")
    except OSError:  # no such file system, or the parent has just ended
        return False
    if not any(os.path.basename(word) in ROSLAUNCH for word in words[:3]):
        return False
    os.kill(parent, signal.SIGINT)
    return True


def _end_with_parent() -> None:
    """Let the kernel end the node if this program is killed: nothing would supervise it."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


if __name__ == "__main__":
    sys.exit(main())
