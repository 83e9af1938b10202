"""One node at a time controls a quadcopter."""

from quad_nav.topics.validation import CommandLease

NAVIGATOR, ROGUE = "/move_base0", "/rogue"


def test_the_first_node_holds_the_lease_while_its_commands_are_in_force():
    lease = CommandLease(0.6)
    assert lease.holder(0, NAVIGATOR, 1.0) == NAVIGATOR
    assert lease.holder(0, ROGUE, 1.5) == NAVIGATOR
    assert lease.holder(0, NAVIGATOR, 1.55) == NAVIGATOR
    assert lease.holder(0, ROGUE, 2.14) == NAVIGATOR
    assert lease.holder(0, ROGUE, 2.15) == ROGUE
    assert lease.holder(0, NAVIGATOR, 2.2) == ROGUE


def test_each_quadcopter_has_its_own_lease():
    lease = CommandLease(0.6)
    lease.holder(0, NAVIGATOR, 1.0)
    assert lease.holder(1, ROGUE, 1.0) == ROGUE


def test_clear_releases_all_leases():
    lease = CommandLease(0.6)
    lease.holder(0, NAVIGATOR, 1.0)
    lease.clear()
    assert lease.holder(0, ROGUE, 1.1) == ROGUE
