"""Connection to one MAVLink vehicle, the only place with pymavlink.

It decodes what comes, encodes what the adapter wants to send, and connects again when the
connection is closed.

Anybody can send a datagram to a UDP port. So the link sends to one address alone: the one from
which the heartbeats of the vehicle's autopilot come. While they come, messages of the same system
from another address are dropped. pymavlink's own UDP connection sends everything to everybody who
has ever sent it a byte, and mixes the bytes of all of them.
"""

from __future__ import annotations

import os
import select
import socket
from threading import Event
from typing import Any, Callable, Dict, Iterator, List, Optional, Tuple

os.environ["MAVLINK20"] = "1"  # pymavlink reads it at its import

from quad_nav.errors import InputError
from quad_vehicles.autopilots import AUTOPILOT_COMPONENT
from quad_vehicles.exchanges import Message
from quad_vehicles.link import VehicleLink, not_installed
from quad_vehicles.mavlink_adapter import MavlinkAdapter
from quad_vehicles.states import VehicleMachine
from quad_vehicles.vehicle_file import Vehicle

try:
    from pymavlink import mavutil
    from pymavlink.dialects.v20 import ardupilotmega
except ImportError:  # an extra
    mavutil = None

Address = Tuple[str, int]
"""Host and port."""
OUR_COMPONENT = 191  # MAV_COMP_ID_ONBOARD_COMPUTER
_EMPTY_READS = 3
"""A connection that is readable but empty this often in a row was closed by the other side."""
_REOPEN_S = 1.0
_MOST_BYTES = 4096
"""Of a datagram; autopilots fill 1500 bytes at most."""
_INFO = 6  # severity of a text
_TARGETED = frozenset(
    ("COMMAND_LONG", "SET_POSITION_TARGET_LOCAL_NED", "PARAM_REQUEST_READ", "PARAM_SET")
)


class UdpSocket:
    """UDP with one address at the other end; to the link like a connection of pymavlink.

    Attributes:
        default: Where to send to while there is no vehicle; None to stay silent.
        peer: Address of the vehicle; None before its first heartbeat.
        source: Sender of the last datagram.
    """

    def __init__(self, kind: str, address: str) -> None:
        """Open the socket.

        Args:
            kind: ``udpin`` or ``udp``: listen at the address; ``udpout``: send to it;
                ``udpbcast``: send to it until a vehicle has answered.
            address: Host and port.

        Raises:
            ValueError: It is no address.
            OSError: It cannot be opened.
        """
        host, text = address.split(":")
        port = int(text)
        if not 0 <= port < 65536:
            raise ValueError(f"port {port}, expected 0 to 65535")
        place = socket.gethostbyname(host), port
        listens = kind in ("udpin", "udp")
        self.default: Optional[Address] = None if listens else place
        self.peer: Optional[Address] = place if kind == "udpout" else None
        self.is_fixed = kind == "udpout"
        self.source: Optional[Address] = None
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, kind == "udpbcast")
        self._poll = select.poll()
        self._poll.register(self._socket, select.POLLIN)
        try:
            if listens:
                self._socket.bind(place)
        except OSError:
            self._socket.close()
            raise

    def select(self, timeout_s: float) -> bool:
        """Wait for a datagram; return whether one is there."""
        return bool(self._poll.poll(timeout_s * 1e3))

    def recv(self, most: int) -> bytes:
        """Return the next datagram."""
        data, self.source = self._socket.recvfrom(most)
        return data

    def send(self, data: bytes, is_alive: bool) -> None:
        """Send to the vehicle if it is alive, otherwise to the default."""
        to = self.peer if is_alive or self.is_fixed else self.default
        if to is not None:
            self._socket.sendto(data, to)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class MavlinkLink(VehicleLink[Message]):
    """The bridge of one vehicle over a connection of pymavlink.

    Attributes:
        adapter: Translates.
    """

    def __init__(
        self, vehicle: Vehicle, machine: VehicleMachine, clock: Callable[[], float]
    ) -> None:
        """Open the connection.

        Raises:
            InputError: If pymavlink is missing, or the address cannot be opened.
        """
        if mavutil is None:
            raise InputError([not_installed(vehicle, "pymavlink", "mavlink")])
        self.adapter = MavlinkAdapter(vehicle, machine)
        super().__init__(vehicle, self.adapter, clock)
        self._empty, self._reopen_s = 0, 0.0
        self._idle = Event()  # never set
        self._connection: Any = None
        self._encoder = ardupilotmega.MAVLink(None, vehicle.bridge_system, OUR_COMPONENT)
        try:
            self._connection = self._open()
        except (ConnectionError, TimeoutError):  # nothing listens there yet
            self._reopen_s = clock() + _REOPEN_S
        except (OSError, OverflowError, ValueError) as error:
            what = f"address {vehicle.address} cannot be opened: {error}"
            raise InputError([f"{vehicle.name}: {what}"]) from error

    def _open(self) -> Any:
        self._parser = _new_parser()
        kind, _, address = self._vehicle.address.partition(":")
        if kind in ("udpin", "udp", "udpout", "udpbcast"):
            return UdpSocket(kind, address)
        # Without its own reconnection: it sleeps and prints in the thread that reads.
        connection = mavutil.mavlink_connection(
            self._vehicle.address, autoreconnect=False, retries=1
        )
        if isinstance(connection, mavutil.mavudp):  # HOST:PORT
            connection.close()
            return UdpSocket("udpin", self._vehicle.address)
        return connection

    def read(self, timeout_s: float) -> None:
        """Wait for messages, and pass those that are there to the adapter."""
        connection = self._connection
        if connection is None:
            self._try_again(timeout_s)
            return
        if not connection.select(timeout_s):
            self._empty = 0
            return
        try:
            data = connection.recv(_MOST_BYTES)
        except OSError:  # such as a refused datagram, while nothing listens there
            data = b""
        if isinstance(connection, UdpSocket):  # an empty datagram closes nothing
            self._take(data, connection.source)
            return
        self._take(data, None)
        self._empty = 0 if data else self._empty + 1
        if self._empty > _EMPTY_READS:
            self.close()
            self._reopen_s = self._clock() + _REOPEN_S

    @property
    def _peer(self) -> Optional[Address]:
        return self._connection.peer if isinstance(self._connection, UdpSocket) else None

    def _take(self, data: bytes, source: Optional[Address]) -> None:
        """Pass the messages of a datagram, or of a piece of a stream (without a source)."""
        # What others send stays out of the vehicle's bytes.
        parser = self._parser if source == self._peer else _new_parser()
        for message in _messages(parser, data):
            name, system = message.get_type(), message.get_srcSystem()
            if name == "BAD_DATA":
                continue
            with self.lock:
                if system != self._vehicle.system:
                    if name == "HEARTBEAT":
                        self.adapter.receive_other(system, message, self._clock())
                elif source is None or source == self._peer:
                    component = message.get_srcComponent()
                    self.adapter.receive(name, component, message, self._clock())
                else:
                    self._meet(message, source, parser)

    def _meet(self, message: Any, source: Address, parser: Any) -> None:
        """Take a message from another address than the vehicle's: it may have moved there."""
        name, component, now_s = message.get_type(), message.get_srcComponent(), self._clock()
        connection, inputs = self._connection, self.machine.inputs
        if connection.is_fixed or not inputs.link_problem(now_s):
            line = f"messages of system {self._vehicle.system} come from {_text(source)} too"
            line += f", expected {_text(connection.peer)} alone"
            self.adapter.drop("messages from another address", line, now_s)
        elif name == "HEARTBEAT" and component == AUTOPILOT_COMPONENT:
            self.adapter.receive(name, component, message, now_s)
            if not inputs.link_problem(now_s):  # so it is a heartbeat of the right autopilot
                connection.peer, self._parser = source, parser
                self.adapter.take_text(f"heard from {_text(source)}", _INFO)

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
        with self.lock:
            connection, now_s = self._connection, self._clock()
            if connection is None:
                return
            is_alive = not self.machine.inputs.link_problem(now_s)
            for name, fields in messages:
                try:
                    data = self._encoded(name, fields)
                    if isinstance(connection, UdpSocket):
                        connection.send(data, is_alive)
                    else:
                        connection.write(data)
                except Exception as error:  # the state machine notices the silence
                    self.adapter.fail(f"{name} cannot be sent", error, now_s)

    def _encoded(self, name: str, fields: Dict[str, Any]) -> bytes:
        values = dict(fields)
        if name in _TARGETED:
            values["target_system"] = self._vehicle.system
            values["target_component"] = AUTOPILOT_COMPONENT
        if "param_id" in values:
            values["param_id"] = values["param_id"].encode()
        encoder = self._encoder
        message = getattr(encoder, f"{name.lower()}_encode")(**values)
        encoder.seq = (encoder.seq + 1) % 256
        return bytes(message.pack(encoder))

    def close(self) -> None:
        """Close the connection."""
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()


def _new_parser() -> Any:
    parser = ardupilotmega.MAVLink(None)
    parser.robust_parsing = True
    return parser


def _messages(parser: Any, data: bytes) -> Iterator[Any]:
    """Parse bytes in such pieces that nothing stays in the parser's buffer but an open message."""
    begin = 0
    while begin < len(data):
        end = begin + parser.bytes_needed()
        message = parser.parse_char(data[begin:end])
        if message is not None:
            yield message
        begin = end


def _text(address: Address) -> str:
    return "{}:{}".format(*address)
