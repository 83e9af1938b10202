#!/usr/bin/env python3
"""A flight by `make fly` is reachable from this machine only; `address:=` opens it."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

import rostest
from processes import descendants, read, words

FLY = Path(__file__).resolve().parents[2] / "scripts" / "fly"
PATIENCE_S = 90.0
NODES = {"rosmaster", "rosout", "simulator", "move_base", "sequencer", "web", "quiet_roslaunch"}
LOOPBACK = ("0100007F", "00000000000000000000000001000000")  # as in /proc/net: little endian
TCP_LISTENS, UDP_IS_BOUND = "0A", "07"


def servers(processes):
    """{(node, address)} of each socket on which one of the processes can be reached."""
    found = set()
    for pid in processes:
        node = node_of(pid)
        sockets = inodes(pid)
        for table, state in (
            ("tcp", TCP_LISTENS),
            ("tcp6", TCP_LISTENS),
            ("udp", UDP_IS_BOUND),
            ("udp6", UDP_IS_BOUND),
        ):
            for line in read(f"/proc/net/{table}").splitlines()[1:]:
                fields = line.split()
                if fields[3] == state and fields[9] in sockets:
                    found.add((node, fields[1].split(":")[0]))
    return found


def inodes(pid):
    """Of the sockets that a process has open."""
    links = []
    try:
        names = os.listdir(f"/proc/{pid}/fd")
    except (FileNotFoundError, ProcessLookupError):
        return set()  # the process has ended since
    for name in names:
        try:
            links.append(os.readlink(f"/proc/{pid}/fd/{name}"))
        except (FileNotFoundError, ProcessLookupError):
            continue  # closed since
    return {match.group(1) for match in map(re.compile(r"socket:\[(\d+)\]").match, links) if match}


def node_of(pid):
    """Name of the node that a process runs, or ""."""
    names = [Path(word).name for word in words(pid) if word]
    return next((name for name in names if name in NODES), "")


class Network(unittest.TestCase):
    def fly(self, *arguments, **environment):
        """A flight that is under way, and what scripts/fly has printed."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        printed = open(Path(folder.name) / "printed", "w+")
        self.addCleanup(printed.close)
        flight = subprocess.Popen(
            [
                str(FLY),
                "rviz:=false",
                "web:=true",
                f"result:={folder.name}/result.json",
                *arguments,
            ],
            env={**os.environ, **environment},
            stdout=printed,
            stderr=subprocess.STDOUT,
        )
        self.addCleanup(self.end, flight)
        return flight, Path(printed.name)

    def end(self, flight):
        flight.send_signal(signal.SIGINT)
        flight.wait(PATIENCE_S)

    def all_servers(self, flight):
        """Once every node is there; each has at least one server."""
        end = time.monotonic() + PATIENCE_S
        found = set()
        while time.monotonic() < end and flight.poll() is None:
            found = servers([flight.pid, *descendants(flight.pid)])
            if NODES <= {node for node, _ in found}:
                return found
            time.sleep(0.2)
        self.fail(f"no servers of {NODES - {node for node, _ in found}}")

    def test_1_nothing_listens_beyond_this_machine_whatever_the_environment_says(self):
        flight, _ = self.fly(ROS_IP="192.0.2.1", ROS_HOSTNAME=socket.gethostname())
        elsewhere = {
            (node, address) for node, address in self.all_servers(flight) if address not in LOOPBACK
        }
        self.assertEqual(elsewhere, set())

    def test_2_an_address_opens_the_flight_and_says_what_that_means(self):
        flight, printed = self.fly("address:=127.0.1.1")
        found = self.all_servers(flight)
        # C++ nodes listen everywhere again; this is what the test above would see.
        self.assertIn(("rosout", "00000000"), found)
        self.assertRegex(
            printed.read_text(),
            r"open to the network at http://127\.0\.1\.1:\d+ .*everyone who reaches",
        )
        end = time.monotonic() + PATIENCE_S
        while "quad: the page is at http://127.0.1.1:" not in printed.read_text():
            self.assertLess(time.monotonic(), end, printed.read_text())
            time.sleep(0.2)


if __name__ == "__main__":
    rostest.rosrun("quad", "network", Network)
