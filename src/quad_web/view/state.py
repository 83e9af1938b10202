"""Items that a page shows, each with the version at which it changed last.

A source puts items, from any thread. Each client asks for what has changed since the version that
it has, so a slow client skips what it could not show in time, and nothing queues up.

Keys are the name of a kind, or kind and robot as in ``scan/3``:

========================  ==================================  =====================================
key                       data                                arrays
========================  ==================================  =====================================
``flight``                source, title, state, time_s, ...
``result``                how the flight has ended, see
                          ``view.result``
``scene``                 size, altitude, walls, solids,
                          moving: solids that move
``robots``                names, colours, radius_m
``poses``                 stamp_s, wall_s                     pose f4[n, 9]: x, y, z, roll, pitch,
                                                              yaw, vx, vy, yaw rate
``obstacles``                                                 poses f4[m, 3]: x, y, yaw of each
                                                              solid of ``moving``; a person's yaw
                                                              is where it walks to
``status``                rows: one dict for each robot
``goals``                 goals: robot, index, x, y, yaw,
                          state
``yields``                yields: robot, peer, kind, hold
``contacts``              contacts: time_s, robot, other,
                          x, y
``samples``               time_s                              values f4[n, 4]: gap, clearance,
                                                              speed, cycle; and the samples before
                                                              it that the client lacks: times f8[t]
                                                              and history f4[t, n, 4]
``trail/i``                                                   points f4[k, 2]
``plan/i``                                                    points f4[k, 2]
``local_plan/i``                                              points f4[k, 2]
``scan/i``                stamp_s                             points f4[k, 3]
``global_costmap/i``      x, y, yaw, resolution_m             costs i1[rows, columns]
``local_costmap/i``       the same                            costs i1[rows, columns]
``cell/i``                                                    points f4[k, 2]
``track/i``                                                   rows f4[k, 6]: x, y, vx, vy, radius,
                                                              kind: 0 seen, 1 hidden, 2 suspect
``localization/i``        is_lost                             pose f4[7]: x, y, yaw, then their
                                                              variances xx, xy, yy and of yaw;
                                                              points f4[k, 2] of particles
========================  ==================================  =====================================

Metres, radians and seconds, in ``map``. NaN in an array, and None in data, is unknown: a robot that
has not been heard of has a pose of NaN. ``docs/web.md`` explains what a person sees of them.
"""

from __future__ import annotations

import collections
import itertools
import threading
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Callable, Deque, Dict, FrozenSet, List, Mapping, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

LAYERS = (
    "trail",
    "plan",
    "local_plan",
    "scan",
    "global_costmap",
    "local_costmap",
    "cell",
    "track",
    "localization",
)
"""Kinds of items that a client can switch on and off. All others are always sent."""

OF_ONE_ROBOT = ("global_costmap", "local_costmap")
"""Layers that are shown of the selected robot only."""

COSTLY = ("scan", "local_plan", "track", "localization")
"""Layers of which a page of a large fleet shows the selected robot's only: new ones come at the
rates of LIDAR and controller, and a node that has listeners must publish them."""

MAX_EVENTS = 2000

MAX_SAMPLES = 600
"""Samples that a new client gets: a minute of ten per second."""


@dataclass(frozen=True, eq=False)
class Item:
    """One thing that a page shows: JSON data, and arrays by name. Neither may be changed.

    Items are compared by identity.
    """

    key: str
    data: Any = None
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    @cached_property
    def layer(self) -> Optional[str]:
        """The layer that the item belongs to, None for an item that is always shown."""
        kind = self.key.partition("/")[0]
        return kind if kind in LAYERS else None

    @cached_property
    def robot(self) -> Optional[int]:
        """Number of the robot in the key, None without one."""
        number = self.key.partition("/")[2]
        return int(number) if number else None


@dataclass(frozen=True)
class Event:
    """An entry of the log of events.

    Attributes:
        number: Position in the log, from 0.
        time_s: Time on the flight's clock.
        level: "info", "warning" or "error".
        robot: Number of the robot, None for the whole fleet.
        text: What happened.
    """

    number: int
    time_s: float
    level: str
    robot: Optional[int]
    text: str


@dataclass(frozen=True)
class Wanted:
    """What a client shows.

    Attributes:
        layers: The layers.
        robot: Number of the selected robot, None for no robot.
        every: False for ``COSTLY`` layers of the selected robot only.
    """

    layers: FrozenSet[str] = frozenset()
    robot: Optional[int] = None
    every: bool = True

    def includes(self, item: Item) -> bool:
        """Return whether the client shows an item."""
        layer = item.layer
        if layer is None:
            return True
        if layer not in self.layers:
            return False
        return not self._is_of_one(layer) or item.robot == self.robot

    def robots(self, layer: str, all_robots: FrozenSet[int]) -> FrozenSet[int]:
        """Return the robots of which the client shows a layer."""
        if layer not in self.layers:
            return frozenset()
        return all_robots & {self.robot} if self._is_of_one(layer) else all_robots

    def _is_of_one(self, layer: str) -> bool:
        return layer in OF_ONE_ROBOT or (layer in COSTLY and not self.every)


@dataclass(frozen=True)
class Changes:
    """What has changed for a client.

    Attributes:
        items: Items that are new, have changed, or are wanted for the first time.
        removed: Keys that the client has and that are gone or no longer wanted.
        versions: Version of each item that the client has with these changes, by key.
    """

    items: Tuple[Item, ...]
    removed: Tuple[str, ...]
    versions: Mapping[str, int]


class FleetState:
    """The items and events of a fleet; safe to use from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._version = 0
        self._items: Dict[str, Tuple[int, Item]] = {}
        self._wanted: Dict[int, Wanted] = {}
        self._clients = itertools.count()
        self._events: Deque[Event] = collections.deque(maxlen=MAX_EVENTS)
        self._event_count = 0
        self._samples: Deque[Tuple[int, Item]] = collections.deque(maxlen=MAX_SAMPLES)
        self._listeners: Tuple[Callable[[], None], ...] = ()

    # -- written by the source -------------------------------------------------------

    def put(
        self, key: str, data: Any = None, arrays: Optional[Mapping[str, NDArray[Any]]] = None
    ) -> None:
        """Set an item. The caller does not change data and arrays afterwards."""
        self.put_all([Item(key, data, arrays or {})])

    def put_all(self, items: List[Item], removed: Tuple[str, ...] = ()) -> None:
        """Set and remove items together, also such that are not there: no client sees a part."""
        with self._lock:
            self._version += 1
            for item in items:
                self._items[item.key] = (self._version, item)
                if item.key == "samples":
                    self._add_sample(item)
            for key in removed:
                self._items.pop(key, None)
        self._tell_listeners()

    def _add_sample(self, item: Item) -> None:
        """Keep it; a jump back in time or another number of robots drops what does not fit."""
        samples, shape = self._samples, item.arrays["values"].shape
        if samples and samples[-1][1].arrays["values"].shape != shape:
            samples.clear()
        while samples and samples[-1][1].data["time_s"] >= item.data["time_s"]:
            samples.pop()
        samples.append((self._version, item))

    def _tell_listeners(self) -> None:
        for listener in self._listeners:
            listener()

    def clear(self) -> None:
        """Remove all items and events, as for another flight."""
        with self._lock:
            self._items.clear()
            self._events.clear()
            self._samples.clear()
        self._tell_listeners()

    def add_event(
        self, time_s: float, text: str, level: str = "info", robot: Optional[int] = None
    ) -> None:
        """Append to the log of events; the oldest ones are dropped beyond ``MAX_EVENTS``."""
        with self._lock:
            self._events.append(Event(self._event_count, time_s, level, robot, text))
            self._event_count += 1

    def wanted(self) -> Tuple[Wanted, ...]:
        """Return what each client shows; empty without clients, when a source can rest."""
        with self._lock:
            return tuple(self._wanted.values())

    # -- read by clients -------------------------------------------------------------

    def add_listener(self, listener: Callable[[], None]) -> None:
        """Call a function after each change, in the thread that makes it; it must be quick."""
        with self._lock:
            self._listeners = (*self._listeners, listener)

    def remove_listener(self, listener: Callable[[], None]) -> None:
        """Call it no more."""
        with self._lock:
            self._listeners = tuple(one for one in self._listeners if one != listener)

    def add_client(self, wanted: Wanted) -> int:
        """Add a client and return its number."""
        with self._lock:
            number = next(self._clients)
            self._wanted[number] = wanted
            return number

    def set_wanted(self, client: int, wanted: Wanted) -> None:
        """Change what a client shows."""
        with self._lock:
            self._wanted[client] = wanted

    def remove_client(self, client: int) -> None:
        """Remove a client."""
        with self._lock:
            self._wanted.pop(client, None)

    def changes(self, wanted: Wanted, versions: Mapping[str, int]) -> Changes:
        """Return what a client lacks that shows ``wanted`` and has items of these versions."""
        with self._lock:
            here = {
                key: (version, item)
                for key, (version, item) in self._items.items()
                if wanted.includes(item)
            }
            seen = versions.get("samples", 0)
            newest_first = itertools.takewhile(lambda one: one[0] > seen, reversed(self._samples))
            samples = [sample for _, sample in newest_first][::-1]
        changed = [
            with_history(item, samples[:-1]) if key == "samples" and len(samples) > 1 else item
            for key, (version, item) in here.items()
            if versions.get(key) != version
        ]
        return Changes(
            tuple(changed),
            tuple(key for key in versions if key not in here),
            {key: version for key, (version, _) in here.items()},
        )

    def item(self, key: str) -> Optional[Item]:
        """Return an item, None if there is no such item."""
        with self._lock:
            entry = self._items.get(key)
        return entry[1] if entry else None

    def events(self) -> List[Event]:
        """Return the events that are still in the log."""
        with self._lock:
            return list(self._events)


def with_history(item: Item, before: Sequence[Item]) -> Item:
    """Return the item ``samples`` with those before it that a client lacks."""
    history: Dict[str, NDArray[Any]] = {
        "times": np.array([sample.data["time_s"] for sample in before], np.float64),
        "history": np.array([sample.arrays["values"] for sample in before], np.float32).reshape(
            -1, *item.arrays["values"].shape
        ),
    }
    return Item(item.key, item.data, {**item.arrays, **history})


def robots_by_layer(
    wanted: Optional[Sequence[Wanted]], robots: Sequence[int]
) -> Dict[str, FrozenSet[int]]:
    """Return the robots of which a layer is shown, by layer; ``wanted`` None is everything."""
    everybody: FrozenSet[int] = frozenset(robots)
    if wanted is None:
        return dict.fromkeys(LAYERS, everybody)
    none: FrozenSet[int] = frozenset()
    return {
        layer: none.union(*(one.robots(layer, everybody) for one in wanted)) for layer in LAYERS
    }
