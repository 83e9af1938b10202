"""A server of the page in a child process."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import List
from urllib.parse import urlsplit

ROOT = Path(__file__).resolve().parents[2]
SYNTHETIC = [sys.executable, str(Path(__file__).parent / "synthetic.py")]


class Served:
    """A running server.

    Attributes:
        url: Address of the page, with the token if there is one.
        urls: All addresses that it printed.
        process: The child process.
        lines: What it has printed since.
    """

    def __init__(self, *options: str, command=SYNTHETIC) -> None:
        self.process = subprocess.Popen(
            [*command, *options],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            bufsize=1,
            env={**os.environ, "PYTHONPATH": str(ROOT / "src"), "PYTHONUNBUFFERED": "1"},
        )
        self.urls = self._read_urls()
        self.url = self.urls[0]
        self.lines: List[str] = []
        self._is_forgiven = False
        self._mark = 0
        threading.Thread(target=self._read_lines, daemon=True).start()

    def _read_urls(self):
        """Read the child's output until it has printed its addresses."""
        lines = []
        for line in self.process.stdout:
            lines.append(line)
            found = re.findall(r"http://[^\s'\"]+", line)
            if found:
                return found
        raise AssertionError(f"the server ended with {self.process.wait()}:\n{''.join(lines)}")

    def _read_lines(self) -> None:
        for line in self.process.stdout:
            self.lines.append(line.rstrip())

    def renew(self) -> None:
        """Have the synthetic fleet begin another flight; what it has printed is dropped."""
        self.lines.clear()
        self._ask("again")

    def end(self) -> None:
        """Have the synthetic fleet end its flight."""
        self._ask("end")

    def _ask(self, line: str) -> None:
        """Write a line to the child, and wait until it has printed it."""
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()
        end_s = time.monotonic() + 10.0
        while line not in self.lines:
            assert time.monotonic() < end_s, self.lines
            time.sleep(0.01)

    def forgive(self) -> None:
        """Take no offence at what it prints of exceptions."""
        self._is_forgiven = True

    def faults(self) -> List[str]:
        """Return what it has printed of exceptions and complaints."""
        if self._is_forgiven:
            return []
        return [line for line in self.lines if re.search(r"Traceback|Error\b|WARNING", line)]

    def calls(self) -> List[str]:
        """Return the actions that pages have called until now, such as ``('cancel', 0)``."""
        self._mark += 1
        self._ask(f"mark {self._mark}")
        return [line[len("call ") :] for line in self.lines if line.startswith("call ")]

    @property
    def port(self) -> str:
        """The port that it listens on."""
        return str(urlsplit(self.url).port)

    def pause(self) -> None:
        """Let the process hang."""
        self.process.send_signal(signal.SIGSTOP)

    def resume(self) -> None:
        """Let the process go on."""
        self.process.send_signal(signal.SIGCONT)

    def stop(self) -> None:
        """End the server, however it is."""
        self.process.kill()
        self.process.wait()
