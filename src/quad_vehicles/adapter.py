"""Base of the adapters: between what a vehicle says and its state machine, without a connection."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Callable, Dict, Generic, List, Mapping, Optional, Tuple, TypeVar

from quad_nav.geometry import Scan, Twist2D
from quad_nav.topics.vehicle_states import State
from quad_vehicles.orders import Output
from quad_vehicles.ranges import Range, fault
from quad_vehicles.setpoints import SetpointClock
from quad_vehicles.states import VehicleMachine
from quad_vehicles.telemetry import Estimate, Velocity
from quad_vehicles.vehicle_file import Vehicle

Sent = TypeVar("Sent")
"""What a kind of vehicle is sent."""
WARNING = 4
"""Severity of a text, as in MAVLink: 0 is the worst, 6 is information."""
_MOST_TEXTS = 100
_TOLD_S = 5.0
"""That a kind of message is dropped is told once in this time."""


class VehicleAdapter(ABC, Generic[Sent]):
    """The bridge of one vehicle.

    Attributes:
        machine: Its state machine.
        estimate: Last estimate, for odometry; None before the first.
        scan: Last scan of the vehicle's own sensors in the body frame; None before the first.
    """

    def __init__(self, vehicle: Vehicle, machine: VehicleMachine) -> None:
        """Start without a link."""
        self.machine = machine
        self.estimate: Optional[Estimate] = None
        self.scan: Optional[Scan] = None
        self._vehicle = vehicle
        self._setpoints = SetpointClock()
        self._texts: List[Tuple[int, str]] = []
        self._told_s: Dict[str, float] = {}  # kind of dropped message -> when it was told

    def take_text(self, text: str, severity: int = WARNING) -> None:
        """Take a line that the vehicle says to people."""
        self._texts = [*self._texts[1 - _MOST_TEXTS :], (severity, text)]

    def pop_texts(self) -> List[Tuple[int, str]]:
        """Return the vehicle's texts since the last call, each with its severity."""
        texts, self._texts = self._texts, []
        return texts

    def drop(self, kind: str, line: str, now_s: float) -> None:
        """Tell people that something is dropped, each kind once in a while.

        Args:
            kind: One of few, for example the names of a message and of its field.
            line: What was dropped and what was expected.
            now_s: Time.
        """
        if now_s - self._told_s.get(kind, -math.inf) >= _TOLD_S:
            self._told_s[kind] = now_s
            self.take_text(f"{line}; dropped")

    def fail(self, what: str, error: Exception, now_s: float) -> None:
        """Tell people of an error that something from outside has caused: the flight goes on."""
        self.drop(what, f"{what}: {type(error).__name__}: {error}", now_s)

    def _handle(
        self,
        name: str,
        read: Callable[[str], float],
        ranges: Mapping[str, Range],
        handler: Callable[[], None],
        now_s: float,
    ) -> None:
        """Check the numbers of a message and handle it; no message raises.

        Args:
            name: Name of the message.
            read: Returns the value of a field.
            ranges: Ranges of its fields.
            handler: Handles it.
            now_s: Time.
        """
        try:
            found = fault(read, ranges)
            if found is None:
                handler()
            else:
                self.drop(f"{name} {found[0]}", f"{name}: {found[0]} {found[1]}", now_s)
        except Exception as error:  # whatever the message has that nobody has thought of
            self.fail(name, error, now_s)

    def follow(self, twist: Twist2D, now_s: float) -> Tuple[bool, List[Sent]]:
        """Take a velocity command.

        Returns:
            Whether the command is finite, and the set-point to send at once, if any.
        """
        if not self.machine.inputs.take_command(twist, now_s):
            return False, []
        is_flying = self.machine.state is State.FLYING
        if not is_flying or not self._setpoints.may_follow_command(now_s):
            return True, []
        return True, self._setpoint(self.machine.commanded_velocity(now_s), now_s, by_command=True)

    @abstractmethod
    def tick(self, now_s: float) -> Tuple[Output, List[Sent]]:
        """Return what the state machine says, and what to send now."""

    @abstractmethod
    def _setpoint(self, wanted: Optional[Velocity], now_s: float, by_command: bool) -> List[Sent]:
        """Return the set-point for a velocity; nothing for None, or if none may leave."""
