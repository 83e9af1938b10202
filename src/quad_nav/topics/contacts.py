"""Contacts as the values of a ``diagnostic_msgs/DiagnosticStatus``."""

from __future__ import annotations

from typing import Dict, Mapping

from quad_nav.sim.contacts import Contact

NAME = "contact"


def text_values(**entries: object) -> Dict[str, str]:
    """Numbers with six digits."""
    return {
        key: f"{value:.6g}" if isinstance(value, float) else str(value)
        for key, value in entries.items()
    }


def contact_values(contact: Contact, clock_s: float) -> Dict[str, str]:
    """Return the values of a contact's message; ``clock_s`` is the time of ``/clock``."""
    return text_values(
        time_s=clock_s,
        robot=contact.robot,
        **{"with": contact.other},
        x_m=contact.x_m,
        y_m=contact.y_m,
    )


def contact_from_values(robot: str, values: Mapping[str, str]) -> Contact:
    """Return the contact of the robot of this name.

    Raises:
        ValueError: A value is missing or is not a number.
    """
    try:
        return Contact(
            float(values["time_s"]),
            robot,
            values["with"],
            float(values["x_m"]),
            float(values["y_m"]),
        )
    except (KeyError, ValueError) as error:
        raise ValueError(
            f"a contact without a readable {error}; expected the values time_s, with, x_m, y_m"
        ) from error
