"""Base of the connections to vehicles."""

from __future__ import annotations

from abc import ABC, abstractmethod
from threading import Lock
from typing import Callable, Generic, List, Optional, Tuple

from quad_nav.geometry import Scan, Twist2D
from quad_vehicles.adapter import Sent, VehicleAdapter
from quad_vehicles.orders import Output
from quad_vehicles.states import VehicleMachine
from quad_vehicles.telemetry import Estimate
from quad_vehicles.vehicle_file import Vehicle


class VehicleLink(ABC, Generic[Sent]):
    """Connection to one vehicle of any kind.

    One thread calls `read`, another one `tick` and `follow`. Whoever uses the state machine or
    the other attributes holds the lock.

    Attributes:
        lock: Held while the adapter works.
    """

    def __init__(
        self, vehicle: Vehicle, adapter: VehicleAdapter[Sent], clock: Callable[[], float]
    ) -> None:
        """Start without a connection.

        Args:
            vehicle: The vehicle.
            adapter: Translates.
            clock: Returns the present time in s; it never goes back.
        """
        self.lock = Lock()
        self._vehicle, self._clock = vehicle, clock
        self._adapter = adapter

    @property
    def machine(self) -> VehicleMachine:
        """State machine of the vehicle."""
        return self._adapter.machine

    @property
    def estimate(self) -> Optional[Estimate]:
        """Last estimate, its stamp on our clock."""
        return self._adapter.estimate

    @property
    def scan(self) -> Optional[Scan]:
        """Last scan of the vehicle's own sensors, its stamp on our clock."""
        return self._adapter.scan

    def pop_texts(self) -> List[Tuple[int, str]]:
        """Return the vehicle's texts since the last call, each with its severity (0 worst)."""
        return self._adapter.pop_texts()

    def follow(self, twist: Twist2D) -> bool:
        """Take a velocity command, and send its set-point; return whether it is finite."""
        with self.lock:
            is_finite, messages = self._adapter.follow(twist, self._clock())
        self._send(messages)
        return is_finite

    def tick(self) -> Output:
        """Let the state machine work, and send what it wants."""
        with self.lock:
            output, messages = self._adapter.tick(self._clock())
        self._send(messages)
        return output

    @abstractmethod
    def read(self, timeout_s: float) -> None:
        """Wait for something to come, and pass what is there to the adapter."""

    @abstractmethod
    def _send(self, messages: List[Sent]) -> None:
        """Send messages, if there is a connection."""

    @abstractmethod
    def close(self) -> None:
        """Close the connection."""


def not_installed(vehicle: Vehicle, library: str, extra: str) -> str:
    """Return the fault of a vehicle whose library is missing."""
    return (
        f"{vehicle.name}: {library} is not installed; expected it from pip install"
        f" 'quad-nav[{extra}]', in a checkout from .venv/bin/pip install -r"
        f" requirements-{extra}.txt"
    )
