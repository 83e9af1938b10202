"""A second host on this machine: a network namespace behind a cable that can be cut.

Needs root and the command ``ip`` of iproute2.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from typing import Tuple

SPACE, HERE, THERE = "quad_there", "quad_here0", "quad_there0"
HERE_IP, THERE_IP = "10.213.77.1", "10.213.77.2"


def ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True)


def why_no_links() -> str:
    """Reason why this machine cannot have such a link, "" if it can."""
    if os.geteuid() != 0:
        return "network namespaces need root"
    if shutil.which("ip") is None:
        return "the command ip is missing; expected iproute2"
    made = subprocess.run(
        ["ip", "netns", "add", SPACE + "_try"], stderr=subprocess.PIPE, check=False
    )
    if made.returncode:
        return f"cannot make a network namespace: {made.stderr.decode().strip()}"
    ip("netns", "delete", SPACE + "_try")
    return ""


class Link:
    """The link; a command after the words ``there`` runs on the other host."""

    there: Tuple[str, ...] = ("ip", "netns", "exec", SPACE)

    def __enter__(self) -> Link:
        ip("netns", "add", SPACE)
        ip("link", "add", HERE, "type", "veth", "peer", "name", THERE, "netns", SPACE)
        ip("address", "add", f"{HERE_IP}/24", "dev", HERE)
        ip("link", "set", HERE, "up")
        ip("-n", SPACE, "address", "add", f"{THERE_IP}/24", "dev", THERE)
        ip("-n", SPACE, "link", "set", THERE, "up")
        ip("-n", SPACE, "link", "set", "lo", "up")
        return self

    def __exit__(self, *_: object) -> None:
        ip("netns", "delete", SPACE)  # and the cable with it

    @staticmethod
    def cut(seconds: float) -> None:
        """Cut the link for this wall time."""
        ip("link", "set", HERE, "down")
        time.sleep(seconds)
        ip("link", "set", HERE, "up")
