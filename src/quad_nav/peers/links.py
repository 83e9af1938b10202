"""Links between robots that are cut at random: who hears whom, and when.

Each robot hears each other one over a link of its own, so that of two robots one may hear the other
without being heard. A link is cut and restored in turn, each time for an exponentially distributed
time: the two-state Markov channel of E. N. Gilbert, "Capacity of a burst-noise channel", Bell
System Technical Journal 39, 1960. While it is cut, the last message that came through stays.
"""

from __future__ import annotations

from bisect import bisect
from dataclasses import dataclass
from typing import Dict, List, Tuple

import numpy as np

from quad_nav.peers.peer import Peer

_STREAM = 7
"""Stream of the links, beside those of starts, noise, missions, drift, phases and walkers."""


@dataclass(frozen=True)
class LinkOutages:
    """Random outages of the links between robots.

    Attributes:
        cut_share: Share of the time for which each link is cut, from 0 to below 1.
        mean_outage_s: Mean length of an outage.

    Raises:
        ValueError: A value is out of range.
    """

    cut_share: float = 0.0
    mean_outage_s: float = 5.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.cut_share < 1.0:
            raise ValueError(f"cut_share {self.cut_share:g}: expected 0 to below 1")
        if not self.mean_outage_s > 0.0:
            raise ValueError(f"mean_outage_s {self.mean_outage_s:g}: expected more than 0")


class PeerLinks:
    """The links over which the robots of one process hear all others."""

    def __init__(self, outages: LinkOutages, seed: int) -> None:
        """Links as at time 0; equal seeds give equal outages, in any process."""
        self.outages = outages
        self._seed = seed
        self._links: Dict[Tuple[int, int], _Link] = {}
        self._heard: Dict[Tuple[int, int], Peer] = {}

    def hear(self, listener: int, peers: Dict[int, Peer], now_s: float) -> List[Peer]:
        """Return the last state that a robot has heard of each peer.

        Args:
            listener: Number of the robot.
            peers: States of its peers now, by number.
            now_s: Present time, 0 or more.

        Returns:
            The states now of those that it hears, older ones of those that it has heard before.
        """
        if not self.outages.cut_share:
            return list(peers.values())
        heard = []
        for number, peer in peers.items():
            pair = (listener, number)
            if not self.is_cut(listener, number, now_s):
                self._heard[pair] = peer
            if pair in self._heard:
                heard.append(self._heard[pair])
        return heard

    def is_cut(self, listener: int, speaker: int, now_s: float) -> bool:
        """Return whether ``listener`` does not hear ``speaker`` at a time, 0 or more."""
        if not self.outages.cut_share:
            return False
        pair = (listener, speaker)
        if pair not in self._links:
            random = np.random.default_rng([self._seed, _STREAM, listener, speaker])
            self._links[pair] = _Link(self.outages, random)
        return self._links[pair].is_cut(now_s)


class _Link:
    """Times at which one link is cut and restored, drawn as far as they are asked for."""

    def __init__(self, outages: LinkOutages, random: np.random.Generator) -> None:
        cut_s = outages.mean_outage_s
        self._means_s = (cut_s * (1.0 / outages.cut_share - 1.0), cut_s)  # whole, cut
        self._random = random
        self._starts_cut = bool(random.random() < outages.cut_share)
        self._switches_s: List[float] = []

    def is_cut(self, now_s: float) -> bool:
        while not self._switches_s or self._switches_s[-1] <= now_s:
            last_s = self._switches_s[-1] if self._switches_s else 0.0
            mean_s = self._means_s[self._is_cut_after(len(self._switches_s))]
            self._switches_s.append(last_s + float(self._random.exponential(mean_s)))
        return self._is_cut_after(bisect(self._switches_s, now_s))

    def _is_cut_after(self, switches: int) -> bool:
        return self._starts_cut ^ bool(switches % 2)
