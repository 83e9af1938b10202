"""Connection to one MAVLink vehicle, the only place with pymavlink.

It decodes what comes, encodes what the adapter wants to send, and connects again when the
connection is closed. It decides nothing.
"""

from __future__ import annotations

import os
from threading import Event
from typing import Any, Callable, Dict, List

os.environ["MAVLINK20"] = "1"  # pymavlink reads it at its import

from quad_nav.errors import InputError
from quad_nav.vehicle.autopilots import AUTOPILOT_COMPONENT
from quad_nav.vehicle.exchanges import Message
from quad_nav.vehicle.link import VehicleLink
from quad_nav.vehicle.mavlink_adapter import MavlinkAdapter
from quad_nav.vehicle.states import VehicleMachine
from quad_nav.vehicle.vehicle_file import Vehicle

try:
    from pymavlink import mavutil
except ImportError:  # an extra
    mavutil = None

OUR_COMPONENT = 191  # MAV_COMP_ID_ONBOARD_COMPUTER
_EMPTY_READS = 3
"""A connection that is readable but empty this often in a row was closed by the other side."""
_REOPEN_S = 1.0
_TARGETED = frozenset(
    ("COMMAND_LONG", "SET_POSITION_TARGET_LOCAL_NED", "PARAM_REQUEST_READ", "PARAM_SET")
)


class MavlinkLink(VehicleLink[Message]):
    """The bridge of one vehicle over a connection of pymavlink.

    Attributes:
        adapter: Translates.
    """

    def __init__(
        self, vehicle: Vehicle, machine: VehicleMachine, clock: Callable[[], float]
    ) -> None:
        """Open the connection.

        Args:
            vehicle: The vehicle.
            machine: Its state machine.
            clock: Returns the present time in s; it never goes back.

        Raises:
            InputError: If pymavlink is missing, or the address cannot be opened.
        """
        if mavutil is None:
            raise InputError(
                [f"{vehicle.name}: pymavlink is missing; install requirements-mavlink.txt"]
            )
        self.adapter = MavlinkAdapter(vehicle, machine)
        super().__init__(vehicle, self.adapter, clock)
        self._empty, self._reopen_s = 0, 0.0
        self._idle = Event()  # never set
        self._connection: Any = None
        try:
            self._connection = self._open()
        except (ConnectionError, TimeoutError):  # nothing listens there yet
            self._reopen_s = clock() + _REOPEN_S
        except (OSError, OverflowError, ValueError) as error:
            raise InputError(
                [f"{vehicle.name}: address {vehicle.address} cannot be opened: {error}"]
            ) from error

    def _open(self) -> Any:
        # Without its own reconnection: it sleeps and prints in the thread that reads.
        return mavutil.mavlink_connection(
            self._vehicle.address,
            source_system=self._vehicle.bridge_system,
            source_component=OUR_COMPONENT,
            dialect="ardupilotmega",
            autoreconnect=False,
            retries=1,
        )

    def read(self, timeout_s: float) -> None:
        """Wait for messages, and pass those that are there to the adapter."""
        if self._connection is None:
            self._try_again(timeout_s)
            return
        if not self._connection.select(timeout_s):
            self._empty = 0
            return
        before = self._connection.mav.total_bytes_received
        message = self._receive()
        while message is not None:
            self._pass(message)
            message = self._receive()
        is_empty = self._connection.mav.total_bytes_received == before
        self._empty = self._empty + 1 if is_empty else 0
        if self._empty > _EMPTY_READS:
            self.close()
            self._reopen_s = self._clock() + _REOPEN_S

    def _receive(self) -> Any:
        try:
            return self._connection.recv_msg()
        except OSError:  # such as a refused datagram, while nothing listens there
            return None

    def _pass(self, message: Any) -> None:
        name, system = message.get_type(), message.get_srcSystem()
        with self.lock:
            if system == self._vehicle.system and name != "BAD_DATA":
                self.adapter.receive(name, message.get_srcComponent(), message, self._clock())
            elif name == "HEARTBEAT":
                self.adapter.receive_other(system, message, self._clock())

    def _try_again(self, timeout_s: float) -> None:
        if self._clock() < self._reopen_s:
            self._idle.wait(timeout_s)
            return
        self._empty, self._reopen_s = 0, self._clock() + _REOPEN_S
        try:
            self._connection = self._open()
        except (OSError, OverflowError, ValueError):
            self._connection = None

    def _send(self, messages: List[Message]) -> None:
        connection = self._connection
        if connection is None:
            return
        for name, fields in messages:
            values: Dict[str, Any] = dict(fields)
            if name in _TARGETED:
                values["target_system"] = self._vehicle.system
                values["target_component"] = AUTOPILOT_COMPONENT
            if "param_id" in values:
                values["param_id"] = values["param_id"].encode()
            try:
                getattr(connection.mav, f"{name.lower()}_send")(**values)
            except OSError:  # the link is lost; the state machine notices the silence
                return

    def close(self) -> None:
        """Close the connection."""
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()
