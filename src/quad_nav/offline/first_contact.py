"""A flight that is over when something touches."""

from __future__ import annotations

from quad_nav.offline.observer import FlightObserver
from quad_nav.sim.contacts import Contact


class FirstContact(FlightObserver):
    """Whether anything was touched."""

    def __init__(self) -> None:
        self._touched = False

    def touched(self, contact: Contact) -> None:
        self._touched = True

    def has_come(self) -> bool:
        return self._touched
