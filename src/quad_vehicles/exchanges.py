"""Exchanges with a MAVLink autopilot that may lose a message: rates, parameters, clocks.

Requests are repeated until the answer is there. A rate that was acknowledged may be forgotten all
the same: what counts is what arrives.
"""

from __future__ import annotations

import math
import struct
from collections import deque
from types import MappingProxyType
from typing import Any, Deque, Dict, List, Mapping, Optional, Sequence, Tuple

from quad_vehicles.autopilots import SET_MESSAGE_INTERVAL, command_fields

Message = Tuple[str, Dict[str, Any]]
"""Name of a message to send and its fields, without the target."""

BEGIN_S = 1.5
"""Rates are asked for this long after the first heartbeat: earlier requests may be lost."""
RATE_WINDOW_S = 2.0
LOW_RATE = 0.7  # of the wanted rate
PARAMETER_RETRY_S = 0.6
MOST_TRIES = 6
SYNC_PERIOD_S, SYNC_FAST_PERIOD_S, SYNC_SAMPLES = 1.0, 0.1, 20
_REAL32 = 9  # MAV_PARAM_TYPE
_WHOLE = {1: "<B3x", 2: "<b3x", 3: "<H2x", 4: "<h2x", 5: "<I", 6: "<i"}


class MessageRates:
    """Asks for messages at rates, again whenever fewer arrive."""

    def __init__(self, rates_hz: Mapping[int, Tuple[str, float]]) -> None:
        """Start without messages.

        Args:
            rates_hz: Name and rate of each wanted message by its number.
        """
        self._wanted = dict(rates_hz)
        self._counts = {name: 0 for name, _ in rates_hz.values()}
        self._window_s: Optional[float] = None

    def count(self, name: str) -> None:
        """Count a message that has come."""
        if name in self._counts:
            self._counts[name] += 1

    def requests(self, now_s: float) -> List[Message]:
        """Return the requests that are due, at most one round in each window."""
        if self._window_s is not None and now_s - self._window_s < RATE_WINDOW_S:
            return []
        elapsed_s = math.inf if self._window_s is None else now_s - self._window_s
        least = {
            name: LOW_RATE * rate * min(elapsed_s, 4.0) for name, rate in self._wanted.values()
        }
        requests: List[Message] = [
            ("COMMAND_LONG", command_fields(SET_MESSAGE_INTERVAL, number, 1e6 / rate))
            for number, (name, rate) in self._wanted.items()
            if self._counts[name] < math.floor(least[name])
        ]
        self._counts = dict.fromkeys(self._counts, 0)
        self._window_s = now_s
        return requests


class Parameters:
    """Reads and writes parameters, each again until the autopilot answers.

    Attributes:
        values: Values by name; None for one without an answer after all tries.
        has_given_up: Whether a write had no effect after all tries.
    """

    def __init__(
        self,
        names: Sequence[str],
        sends_bits: bool,
        renamed: Mapping[str, Sequence[str]] = MappingProxyType({}),
    ) -> None:
        """Start with nothing read.

        Args:
            names: Parameters to read.
            sends_bits: Whether whole numbers travel as their bits.
            renamed: Parameters that an autopilot with a parameter does not have.
        """
        self.values: Dict[str, Optional[float]] = {}
        self._types: Dict[str, int] = {}
        self._names, self._sends_bits, self._renamed = tuple(names), sends_bits, renamed
        self._tries: Dict[str, int] = {}
        self._writes: Dict[str, float] = {}
        self._next_s = -math.inf
        self.has_given_up = False

    @property
    def is_read(self) -> bool:
        """True when every parameter has been answered or given up."""
        return all(name in self.values for name in self._names)

    @property
    def is_written(self) -> bool:
        """True when no write is waiting for its echo."""
        return not self._writes

    def forget(self) -> None:
        """Read everything again."""
        self.values, self._tries, self._writes = {}, {}, {}
        self.has_given_up = False

    def write(self, values: Mapping[str, float]) -> None:
        """Write values, until the autopilot echoes each."""
        self._writes = dict(values)
        self._tries, self._next_s = {}, -math.inf

    def take(self, name: str, value: float, kind: int) -> bool:
        """Take a PARAM_VALUE; return False for one of ours that is no finite number."""
        if name not in self._names:
            return True
        if self._sends_bits and kind in _WHOLE:
            value = struct.unpack(_WHOLE[kind], struct.pack("<f", value))[0]
        if not math.isfinite(value):
            return False
        self.values[name], self._types[name] = float(value), kind
        self.values.update(dict.fromkeys(self._renamed.get(name, ())))
        self._tries.pop(name, None)
        wanted = self._writes.get(name)
        if wanted is not None and abs(wanted - value) <= 1e-5 * max(1.0, abs(wanted)):
            del self._writes[name]
        return True

    def requests(self, now_s: float) -> List[Message]:
        """Return the requests that are due."""
        if now_s < self._next_s:
            return []
        self._next_s = now_s + PARAMETER_RETRY_S
        requests: List[Message] = []
        for name in self._names:
            if name not in self.values and self._may_try(name):
                requests.append(("PARAM_REQUEST_READ", {"param_id": name, "param_index": -1}))
        for name in list(self._writes):
            if self._may_try(name):
                requests.append(("PARAM_SET", self._write_fields(name)))
        return requests

    def _may_try(self, name: str) -> bool:
        self._tries[name] = self._tries.get(name, 0) + 1
        if self._tries[name] <= MOST_TRIES:
            return True
        self.values.setdefault(name, None)
        self.has_given_up = self.has_given_up or name in self._writes
        self._writes.pop(name, None)
        return False

    def _write_fields(self, name: str) -> Dict[str, Any]:
        value, kind = self._writes[name], self._types.get(name, _REAL32)
        if self._sends_bits and kind in _WHOLE:
            value = struct.unpack("<f", struct.pack(_WHOLE[kind], round(value)))[0]
        return {"param_id": name, "param_value": value, "param_type": kind}


class ClockSync:
    """Difference of two clocks, from the exchange of TIMESYNC with the shortest round trip."""

    def __init__(self) -> None:
        """Start without samples."""
        self._samples: Deque[Tuple[float, float]] = deque(maxlen=SYNC_SAMPLES)
        self._next_s, self._asked = -math.inf, 0
        self._best_s: Optional[float] = None

    def forget(self) -> None:
        """Forget the samples: the autopilot's clock has started again."""
        self._samples.clear()
        self._next_s, self._best_s, self._asked = -math.inf, None, 0

    def requests(self, now_s: float) -> List[Message]:
        """Return the request if it is due."""
        if now_s < self._next_s:
            return []
        self._asked += 1
        fast = self._asked <= SYNC_SAMPLES
        self._next_s = now_s + (SYNC_FAST_PERIOD_S if fast else SYNC_PERIOD_S)
        return [("TIMESYNC", {"tc1": 0, "ts1": round(now_s * 1e9)})]

    def take(self, theirs_ns: int, ours_ns: int, now_s: float) -> Optional[Message]:
        """Take a TIMESYNC; return our answer if it was a question.

        Args:
            theirs_ns: Field tc1: their time of an answer, 0 for a question.
            ours_ns: Field ts1: our time of the question.
            now_s: Time.
        """
        if theirs_ns == 0:
            return ("TIMESYNC", {"tc1": round(now_s * 1e9), "ts1": ours_ns})
        sent_s = ours_ns / 1e9
        trip_s = now_s - sent_s
        if 0.0 <= trip_s < 1.0:  # otherwise the answer to another station's question
            self._add(trip_s, theirs_ns / 1e9 - (sent_s + trip_s / 2.0))
        return None

    def _add(self, trip_s: float, offset_s: float) -> None:
        """Add a sample, and drop those before a step of their clock.

        An offset is wrong by half of its trip at most. When two samples differ by more than the
        halves of both trips, their clock has stepped in between.
        """
        agreeing = [
            (trip, offset)
            for trip, offset in self._samples
            if abs(offset - offset_s) <= (trip + trip_s) / 2.0
        ]
        self._samples = deque([*agreeing, (trip_s, offset_s)], maxlen=SYNC_SAMPLES)
        self._best_s = min(self._samples)[1]

    def ours_s(self, theirs_s: float, now_s: float) -> float:
        """Return the time on our clock, at most now, for one on theirs.

        Without a sample this is now.
        """
        return now_s if self._best_s is None else min(theirs_s - self._best_s, now_s)
