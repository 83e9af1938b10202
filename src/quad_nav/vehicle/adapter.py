"""Base of the adapters: between what a vehicle says and its state machine, without a connection."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Generic, List, Optional, Tuple, TypeVar

from quad_nav.geometry import Scan, Twist2D
from quad_nav.vehicle.orders import Output, State
from quad_nav.vehicle.setpoints import SetpointClock
from quad_nav.vehicle.states import VehicleMachine
from quad_nav.vehicle.telemetry import Estimate, Velocity
from quad_nav.vehicle.vehicle_file import Vehicle

Sent = TypeVar("Sent")
"""What a kind of vehicle is sent."""
WARNING = 4
"""Severity of a text, as in MAVLink: 0 is the worst, 6 is information."""
_MOST_TEXTS = 100


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

    def take_text(self, text: str, severity: int = WARNING) -> None:
        """Take a line that the vehicle says to people."""
        self._texts = [*self._texts[1 - _MOST_TEXTS :], (severity, text)]

    def pop_texts(self) -> List[Tuple[int, str]]:
        """Return the vehicle's texts since the last call, each with its severity."""
        texts, self._texts = self._texts, []
        return texts

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
