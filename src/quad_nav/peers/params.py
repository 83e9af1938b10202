"""Parameters of the avoidance of peers."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PeerParams:
    """Parameters of the avoidance of peers, see ``docs/peers.md``.

    Attributes:
        avoid_peers: Avoid the peers whose poses are known; False restores upstream behaviour.
        margin_m: Distance that each of two robots keeps its footprint from the bisector
            between them; hulls stay twice as far apart.
        timeout_s: Age from which the state of a peer is ignored.
        yield_when_idle: A robot without a goal leaves the path of a peer, and comes back.
    """

    avoid_peers: bool = True
    margin_m: float = 0.05
    timeout_s: float = 0.5
    yield_when_idle: bool = True
