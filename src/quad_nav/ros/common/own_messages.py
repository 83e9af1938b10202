"""Build our own messages from the plain objects of ``topics``."""

from __future__ import annotations

from typing import Any, Callable, Mapping

from quad.msg import Contact, FlightInfo, RobotInfo
from std_msgs.msg import Header

from quad_nav.ros.common.conversions import time_message
from quad_nav.sim import contacts
from quad_nav.topics import flight_info
from quad_nav.topics.contacts import contact_fields


def stamped(
    kind: Callable[..., Any], fields: Mapping[str, Any], time_s: float, frame: str = "map"
) -> Any:
    """Build a message with a header from its other fields."""
    return kind(header=Header(0, time_message(time_s), frame), **fields)


def contact_message(contact: contacts.Contact, time_s: float) -> Contact:
    """Convert a contact that begins at a time on ``/clock``."""
    return stamped(Contact, contact_fields(contact), time_s)


def flight_info_message(info: flight_info.FlightInfo) -> FlightInfo:
    """Convert the facts about a flight."""
    fields = info.fields
    robots = [RobotInfo(**robot) for robot in fields["robots"]]
    return FlightInfo(**{**fields, "robots": robots})
