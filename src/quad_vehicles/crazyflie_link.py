"""Connection to one Crazyflie, the only place with cflib.

cflib calls back in threads of its own. They put what comes into a queue, from which `read` takes
it. The link decides nothing.
"""

from __future__ import annotations

import os
import queue
from typing import Any, Callable, Dict, List, Mapping

from quad_nav.errors import InputError
from quad_vehicles.crazyflie_adapter import (
    BLOCKS,
    MULTIRANGER,
    POSITIONING,
    RANGES,
    Call,
    CrazyflieAdapter,
)
from quad_vehicles.link import VehicleLink, not_installed
from quad_vehicles.states import VehicleMachine
from quad_vehicles.vehicle_file import Vehicle

try:
    import cflib.crtp
    from cflib.crazyflie import Crazyflie
    from cflib.crazyflie.log import LogConfig
except ImportError:  # an extra, not for Python before 3.10
    cflib = None

CACHE = os.path.join("~", ".cache", "quad", "crazyflie")
"""Folder of the tables of contents, which take seconds to read over the radio."""
_REOPEN_S = 1.0
_SILENT_S, _CONNECT_S = 3.0, 60.0
"""A connection without data, and one that does not come about, are given up after these times."""
_WANTED = (*POSITIONING, MULTIRANGER)


class CrazyflieLink(VehicleLink[Call]):
    """The bridge of one Crazyflie over a connection of cflib.

    Attributes:
        adapter: Translates.
    """

    def __init__(
        self, vehicle: Vehicle, machine: VehicleMachine, clock: Callable[[], float]
    ) -> None:
        """Begin to connect.

        Raises:
            InputError: If cflib is missing.
        """
        if cflib is None:
            raise InputError(
                [not_installed(vehicle, "cflib, for Python 3.10 or later,", "crazyflie")]
            )
        if not cflib.crtp.CLASSES:
            cflib.crtp.init_drivers()
        self.adapter = CrazyflieAdapter(vehicle, machine)
        super().__init__(vehicle, self.adapter, clock)
        self._events: queue.Queue[Callable[[], None]] = queue.Queue()
        self._crazyflie = self._make()
        self._is_open = self._is_ready = False  # ready: parameters and log blocks are there
        self._reopen_s = self._give_up_s = 0.0

    def read(self, timeout_s: float) -> None:
        """Wait for something to come, and pass what is there to the adapter."""
        self._watch()
        try:
            event = self._events.get(timeout=timeout_s)
            while True:
                self._run(event)
                event = self._events.get_nowait()
        except queue.Empty:
            return

    def _run(self, event: Callable[[], None]) -> None:
        try:
            event()
        except Exception as error:  # cflib raises what its drivers raise
            self._fail("an event of the radio", error)

    def _fail(self, what: str, error: Exception) -> None:
        with self.lock:
            self.adapter.fail(what, error, self._clock())

    def _watch(self) -> None:
        """Open the connection if it is closed, and give one up on which nothing comes."""
        now_s = self._clock()
        if self._is_open and now_s > self._give_up_s:
            self._lost(f"nothing came for {_SILENT_S if self._is_ready else _CONNECT_S:g} s")
        if not self._is_open and now_s >= self._reopen_s:
            self._is_open, self._give_up_s = True, now_s + _CONNECT_S
            self._crazyflie.open_link(self._vehicle.address)

    def _make(self) -> Any:
        crazyflie, put = Crazyflie(rw_cache=os.path.expanduser(CACHE)), self._events.put
        crazyflie.fully_connected.add_callback(lambda _: put(self._begin))
        for ended in (crazyflie.connection_failed, crazyflie.connection_lost):
            ended.add_callback(lambda _, reason: put(lambda: self._ended(crazyflie, reason)))
        crazyflie.console.receivedChar.add_callback(lambda text: put(lambda: self._take_text(text)))
        return crazyflie

    def _begin(self) -> None:
        """Pass the parameters on and start the log blocks."""
        self._crazyflie.link_statistics.stop()  # its pings would take a share of the radio
        parameters: Dict[str, float] = {}
        table = self._crazyflie.param
        for name in _WANTED:
            if table.toc.get_element(*name.split(".")) is not None:
                parameters[name] = float(table.get_value(name))
        with self.lock:
            self.adapter.connected(parameters)
        for name, (period_ms, variables) in BLOCKS.items():
            if name != RANGES or (self.adapter.has_ranges and parameters.get(MULTIRANGER)):
                self._start(name, period_ms, variables)
        self._is_ready, self._give_up_s = True, self._clock() + _SILENT_S

    def _start(self, name: str, period_ms: int, variables: Mapping[str, str]) -> None:
        block = LogConfig(name, period_ms)
        for variable, kind in variables.items():
            block.add_variable(variable, kind)
        block.data_received_cb.add_callback(
            lambda stamp_ms, values, _: self._events.put(
                lambda: self._receive(name, stamp_ms, values)
            )
        )
        try:
            self._crazyflie.log.add_config(block)
        except (KeyError, AttributeError) as error:  # an old firmware, or too many blocks
            self._take_text(f"log block {name}: {error}")
            return
        block.start()

    def _receive(self, name: str, stamp_ms: int, values: Dict[str, float]) -> None:
        self._give_up_s = self._clock() + _SILENT_S
        with self.lock:
            self.adapter.receive(name, stamp_ms, values, self._clock())

    def _take_text(self, text: str) -> None:
        with self.lock:
            self.adapter.take_text(text.rstrip("\n"))

    def _ended(self, crazyflie: Any, reason: str) -> None:
        if crazyflie is self._crazyflie:
            self._lost(reason)

    def _lost(self, reason: str) -> None:
        """Close the connection; the next one is made from the ground up.

        cflib keeps a lock when its driver cannot send.
        """
        self._is_open = self._is_ready = False
        self._reopen_s = self._clock() + _REOPEN_S
        self._take_text(f"no connection: {(reason.strip().splitlines() or ['no reason'])[0]}")
        old, self._crazyflie = self._crazyflie, self._make()
        if old.link is not None:
            old.link.close()

    def _send(self, calls: List[Call]) -> None:
        if not self._is_ready:
            return
        crazyflie = self._crazyflie
        try:
            for name, values in calls:
                if name == "hover":
                    crazyflie.commander.send_hover_setpoint(*values)
                elif name == "stop":
                    crazyflie.commander.send_stop_setpoint()
                else:
                    # The supervisor is in cflib from 0.1.31 on.
                    arming = getattr(crazyflie, "supervisor", crazyflie.platform)
                    arming.send_arming_request(bool(values[0]))
        except Exception as error:  # whatever the driver raises: the link is made anew
            self._is_ready = False
            reason = f"cannot send: {error}"
            self._events.put(lambda: self._lost(reason))

    def close(self) -> None:
        """Close the connection."""
        self._is_ready = False
        if self._crazyflie.link is not None:
            self._crazyflie.link.close()
