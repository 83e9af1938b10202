"""Links between robots that are cut at random."""

from __future__ import annotations

import pytest

from quad_nav.peers.links import LinkOutages, PeerLinks
from quad_nav.peers.peer import Peer

HALF = LinkOutages(0.5, 4.0)


def peer(stamp_s: float) -> Peer:
    return Peer("quad1", stamp_s, 0.0, 1.0, 0.0, stamp_s)


def cut_times(links: PeerLinks, listener: int, speaker: int, seconds: int) -> list:
    return [k / 10 for k in range(10 * seconds) if links.is_cut(listener, speaker, k / 10)]


def test_links_are_whole_by_default() -> None:
    links = PeerLinks(LinkOutages(), 0)
    assert not any(links.is_cut(0, 1, k / 10) for k in range(10_000))
    assert links.hear(0, {1: peer(3.0)}, 3.0) == [peer(3.0)]


def test_a_quarter_of_the_time_is_cut_in_outages_of_two_seconds() -> None:
    links = PeerLinks(LinkOutages(0.25, 2.0), 0)
    cut = [links.is_cut(0, 1, k / 100) for k in range(4_000_000)]
    outages = sum(after and not before for before, after in zip(cut, cut[1:]))
    # 40,000 s at a share of 0.25 are 10,000 s in 5,000 outages of 2 s. The standard error of
    # their number is about 56, of the share 0.003.
    assert sum(cut) / len(cut) == pytest.approx(0.25, abs=0.01)
    assert outages == pytest.approx(5000, abs=220)


def test_outages_depend_on_seed_and_pair_and_not_on_who_asks_when() -> None:
    links = PeerLinks(HALF, 7)
    times = cut_times(links, 0, 1, 100)
    assert times == cut_times(PeerLinks(HALF, 7), 0, 1, 100)
    late_first = PeerLinks(HALF, 7)
    late_first.is_cut(0, 1, 99.9)
    late_first.is_cut(1, 0, 50.0)
    assert times == cut_times(late_first, 0, 1, 100)
    assert times != cut_times(links, 1, 0, 100)
    assert times != cut_times(PeerLinks(HALF, 8), 0, 1, 100)


def test_the_last_word_stays_while_a_link_is_cut() -> None:
    links = PeerLinks(HALF, 3)
    last = None
    for k in range(600):
        now_s = k / 10
        heard = links.hear(0, {1: peer(now_s)}, now_s)
        if not links.is_cut(0, 1, now_s):
            last = peer(now_s)
        assert heard == ([] if last is None else [last])


@pytest.mark.parametrize("share, outage_s", [(-0.1, 5.0), (1.0, 5.0), (0.5, 0.0)])
def test_impossible_outages_are_refused(share: float, outage_s: float) -> None:
    with pytest.raises(ValueError, match="expected"):
        LinkOutages(share, outage_s)
