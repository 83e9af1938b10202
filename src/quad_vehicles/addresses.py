"""Addresses of vehicles: what pymavlink and cflib open, and what two vehicles cannot share."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Dict, Sequence, Tuple

from quad_nav.files.document import Checker

_WITH_PORT = ("tcp", "tcpin", "udp", "udpin", "udpout", "udpbcast")


def read_address(check: Checker, fields: Dict[str, Any], place: str, kind: str) -> str:
    """Return the address of a vehicle; "" for a simulated one, which has none."""
    if kind == "simulated":
        return ""
    address = check.text(fields, "address", place, "")
    problem = address_problem(address) if kind == "mavlink" else ""
    if problem:
        check.fault(f"{place}.address", problem)
    return address


def check_addresses(check: Checker, addresses: Sequence[str]) -> None:
    """Find addresses that two vehicles cannot share; "" is none."""
    for k, one in enumerate(addresses):
        for j, other in enumerate(addresses[:k]):
            if one and one == other:
                what = f"two vehicles have the address {one}, expected one for each"
                check.fault(f"vehicles[{k}].address", what)
            elif one and other and share(one, other):
                what = f"{one} takes what vehicles[{j}] has, {other}; expected a port for each"
                check.fault(f"vehicles[{k}].address", what)


def address_problem(address: str) -> str:
    """Return what is wrong with an address of pymavlink, "" if nothing is."""
    scheme, _, place = address.partition(":")
    host, _, port = place.rpartition(":")
    if scheme in _WITH_PORT:
        if host and port.isdecimal() and 0 < int(port) < 65536:
            return ""
        return f"{address}, expected {scheme}:HOST:PORT with a port from 1 to 65535"
    if Path(address).is_file():  # pymavlink would replay it, or run it
        return f"{address} is a file, expected a serial line or a port"
    return ""


def share(address: str, other: str) -> bool:
    """Return whether two addresses take the same port, serial line or radio.

    ``udpin:0.0.0.0:14550`` takes the port of ``udpin:127.0.0.1:14550``: the system lets both open
    it, and gives each message to one of them.
    """
    kind, host, port = _taken(address)
    its_kind, its_host, its_port = _taken(other)
    return (kind, port) == (its_kind, its_port) and (host == its_host or "" in (host, its_host))


def _taken(address: str) -> Tuple[str, str, str]:
    """Return what an address takes: kind, host ("" is every one), and port, line or radio."""
    if address.startswith("radio://"):
        return "radio", "", address.split("/")[2]
    match = re.fullmatch(r"(?:(\w+):)?([^:/]*):(\d+)", address)
    if match is None:
        return "line", "", str(Path(address.split(",")[0]).resolve())
    kind, host, port = match.groups()
    hosts = {"0.0.0.0": "", "localhost": "127.0.0.1"}
    return "udpin" if kind in (None, "udp") else kind, hosts.get(host, host), port.lstrip("0")
