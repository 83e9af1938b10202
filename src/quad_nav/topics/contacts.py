"""Contacts, as ``/simulation/contacts`` tells them with ``quad/Contact``."""

from __future__ import annotations

from typing import Any, Dict

from quad_nav.sim.contacts import Contact
from quad_nav.topics.validation import contact_problem

CONTACTS_TOPIC = "/simulation/contacts"


def contact_fields(contact: Contact) -> Dict[str, Any]:
    """Return the fields of a ``quad/Contact``, apart from its header."""
    return {"robot": contact.robot, "other": contact.other, "x": contact.x_m, "y": contact.y_m}


def contact_from_message(message: Any, time_s: float) -> Contact:
    """Read a ``quad/Contact`` with this stamp, of rospy or of a recording.

    Raises:
        ValueError: A field is out of its range.
    """
    contact = Contact(time_s, message.robot, message.other, float(message.x), float(message.y))
    problem = contact_problem(contact)
    if problem:
        raise ValueError(f"contact with {problem}")
    return contact
