"""Contacts as the values of a ``diagnostic_msgs/DiagnosticStatus``."""

from __future__ import annotations

import re
from typing import Dict, Mapping

from quad_nav.mission import flight_log
from quad_nav.sim.contacts import Contact

NAME = "contact"


def text_values(**entries: object) -> Dict[str, str]:
    """Numbers with six digits."""
    return {
        key: f"{value:.6g}" if isinstance(value, float) else str(value)
        for key, value in entries.items()
    }


def contact_values(contact: Contact, clock_s: float) -> Dict[str, str]:
    """``clock_s`` is what ``/clock`` says at the contact."""
    x_m, y_m, _ = contact.position_m
    return text_values(
        time_s=clock_s, robot=contact.robot, **{"with": contact.other}, x_m=x_m, y_m=y_m
    )


def contact_from_values(robot: str, values: Mapping[str, str]) -> flight_log.Contact:
    """The contact of the quadcopter ``robot``. Raises ValueError for what cannot be read."""
    try:
        # The simulator writes "quadcopter 1"; robots[].robot in our summary is "quad1".
        other = re.sub(r"^quadcopter (\d+)$", r"quad\1", values["with"])
        return flight_log.Contact(
            float(values["time_s"]), robot, other, float(values["x_m"]), float(values["y_m"])
        )
    except (KeyError, ValueError) as error:
        raise ValueError(
            f"a contact without a readable {error}; expected the values time_s, with, x_m, y_m"
        ) from error
