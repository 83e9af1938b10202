"""What people know of vehicles, and what they have asked for."""

from __future__ import annotations

from typing import NamedTuple


class Known:
    """What a person knows of a vehicle.

    Attributes:
        may_take_off: Somebody, or the begin of the mission, has asked for a take-off.
        is_armed: At the last step.
        disarmed_s: When its motors have stopped last.
        taken_s: Since when its pilot has it, or it hovers since its bridge has died; else None.
        is_stopped: Its mission is stopped, or must be.
        changed_s: When its bridge, its link or the mission has changed last.
        poor_s: Since when its battery is low or its position lost; None if neither.
        stepped_s: When a clock has stepped last.
    """

    def __init__(self, now_s):
        self.may_take_off, self.is_armed, self.is_stopped = True, False, False
        self.taken_s = self.poor_s = None
        self.changed_s = self.stepped_s = self.disarmed_s = now_s


class Request(NamedTuple):
    """Somebody has called a service of the vehicles, and waits for its response.

    Attributes:
        service: Its name.
        asked_s: When it was called.
        before: Numbers of the vehicles that it asks, and whether each might take off before.
        responses: Takes the response; None if the node has died.
    """

    service: str
    asked_s: float
    before: dict
    responses: list

    @property
    def takes_off(self):
        return self.service.endswith("take_off")

    @property
    def takes_control(self):
        return not self.service.endswith("land")
