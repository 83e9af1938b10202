"""The state of each robot and node, from `/diagnostics` or else from the status of the action."""

from __future__ import annotations

import re
import time
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Tuple

import numpy as np
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray
from numpy.typing import NDArray

from quad_nav.errors import excerpt
from quad_nav.topics.health import Level
from quad_web.ros.intake import Newest, Topic
from quad_web.view.state import Item

LOST_AFTER_S = 3.0
"""Wall time without a message after which a robot or its navigator counts as lost. Diagnostics come
each second: at least two of them are missing then."""
MAX_STATUSES, MAX_VALUES, MAX_TEXT = 2000, 60, 500
_BUSY = (GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING, GoalStatus.RECALLING)
_FORGET_AFTER_S = 60.0
_NAVIGATOR = re.compile(r"move_base(\d{1,4}): control")


class Status(NamedTuple):
    """One status of `/diagnostics`, and the wall time, monotonic, at which it came."""

    name: str
    hardware: str
    level: str
    message: str
    values: Mapping[str, str]
    received_s: float


class Progress(NamedTuple):
    """Progress of a robot's mission: number of the goal from 1, of all goals, what it does."""

    goal: Optional[int] = None
    goals: Optional[int] = None
    is_done: bool = False
    is_stopped: bool = False


class FleetHealth:
    """Receives the statuses of all nodes."""

    def __init__(self, robots: int) -> None:
        """Start without statuses."""
        self._robots = robots
        self._statuses: Dict[str, Status] = {}
        self._actions: Dict[int, Newest] = {}
        self._is_busy: Dict[int, bool] = {}
        self._since_s = time.monotonic()

    def start(self) -> None:
        """Expect messages from now on: a client has come."""
        self._since_s = time.monotonic()
        self._statuses.clear()

    def topics(self) -> Dict[str, Topic]:
        """Return the topics to subscribe to at present."""
        silent = [i for i in range(self._robots) if self._silent_s(self._control(i)) > LOST_AFTER_S]
        self._actions = {
            i: self._actions.get(i) or Newest(f"/move_base{i}/status", GoalStatusArray)
            for i in silent
        }
        return {
            "/diagnostics": Topic(DiagnosticArray, self._on_diagnostics),
            **{f"/move_base{i}/status": newest.topic for i, newest in self._actions.items()},
        }

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        now_s = time.monotonic()
        for one in message.status[:MAX_STATUSES]:
            name = excerpt(one.name)
            if name in self._statuses or len(self._statuses) < MAX_STATUSES:
                self._statuses[name] = Status(
                    name,
                    excerpt(one.hardware_id),
                    Level(one.level).name if one.level in (0, 1, 2, 3) else "STALE",
                    excerpt(one.message, MAX_TEXT),
                    {
                        excerpt(pair.key): excerpt(pair.value, MAX_TEXT)
                        for pair in one.values[:MAX_VALUES]
                    },
                    now_s,
                )

    def _control(self, robot: int) -> Optional[Status]:
        return self._statuses.get(f"move_base{robot}: control")

    def _silent_s(self, status: Optional[Status]) -> float:
        since_s = self._since_s if status is None else max(status.received_s, self._since_s)
        return time.monotonic() - since_s

    def _values(self, name: str) -> Mapping[str, str]:
        status = self._statuses.get(name)
        return {} if status is None else status.values

    # -- navigators ----------------------------------------------------------------------

    def navigator(self, robot: int) -> Tuple[str, float, str]:
        """Return state and silence, in s of wall time, of a navigator, and why it is stopped.

        The state is one of `navigator.tick.State`, "" if unknown. A navigator without diagnostics,
        such as the C++ one, has the states "controlling" and "idle" from the status of its action.
        """
        control = self._control(robot)
        silent_s = self._silent_s(control)
        action = self._actions.get(robot)
        if action is not None and action.received_s is not None:
            action_s = time.monotonic() - action.received_s
            if action_s < silent_s:
                return self._action_state(robot, action), action_s, ""
        if control is None:
            return "", silent_s, ""
        reason = control.message if control.level == "ERROR" else ""
        return control.values.get("state", ""), silent_s, reason

    def _action_state(self, robot: int, action: Newest) -> str:
        try:
            message = action.take()
        except ValueError:
            message = None
        if message is not None:
            self._is_busy[robot] = any(one.status in _BUSY for one in message.status_list)
        return "controlling" if self._is_busy.get(robot) else "idle"

    def cycles_s(self) -> NDArray[np.float64]:
        """Return the time of each navigator's slowest control cycle of the last second."""
        return np.array(
            [
                _number(self._values(f"move_base{i}: control").get("cycle ms", "")) / 1e3
                for i in range(self._robots)
            ]
        )

    # -- missions ------------------------------------------------------------------------

    def progress(self, robot: int) -> Progress:
        """Return the progress of a robot's mission."""
        status = self._statuses.get(f"mission: quad{robot}")
        if status is None:
            return Progress()
        values, is_done = status.values, status.message == "done"
        return Progress(
            None if is_done else _count(values.get("goal", "")),
            _count(values.get("goals", "")),
            is_done,
            values.get("stopped") == "True",
        )

    @property
    def is_stopped(self) -> bool:
        """True if a person has stopped a mission."""
        return any(self.progress(i).is_stopped for i in range(self._robots))

    @property
    def are_all_stopped(self) -> bool:
        """True if a person has stopped all missions that are not done."""
        missions = [self.progress(i) for i in range(self._robots)]
        return self.is_stopped and all(one.is_stopped or one.is_done for one in missions)

    def localization(self, robot: int) -> Tuple[str, bool]:
        """Return what localizes a robot, "amcl", "slam" or "", and whether it says: lost."""
        parts = {"amcl": f"amcl{robot}: Standard deviation", "slam": f"quad{robot}: localization"}
        for name, part in parts.items():
            status = self._statuses.get(part)
            if status is not None:
                return name, status.level == "ERROR" or "lost" in status.message
        return "", False

    # -- the simulator -------------------------------------------------------------------

    @property
    def has_simulator(self) -> bool:
        """True if a simulator has reported."""
        return "simulator: clock" in self._statuses

    @property
    def is_paused(self) -> bool:
        """True if the simulator says so."""
        clock = self._statuses.get("simulator: clock")
        return clock is not None and clock.message == "paused"

    @property
    def rates(self) -> Tuple[Optional[float], Optional[float]]:
        """The simulated seconds per second that are achieved and wanted; None if unknown."""
        values = self._values("simulator: clock")
        achieved, wanted = (_number(values.get(k, "")) for k in ("real_time_factor", "rate"))
        return None if np.isnan(achieved) else achieved, None if np.isnan(wanted) else wanted

    def has_lidar(self, robot: int) -> bool:
        """Return False if a robot's LIDAR is switched off."""
        return self._values(f"simulator: quadcopter {robot}").get("lidar") != "False"

    # -- all nodes -----------------------------------------------------------------------

    def item(self) -> Item:
        """Return the item ``diagnostics``: the statuses of all nodes, with their ages."""
        now_s = time.monotonic()
        for name, status in list(self._statuses.items()):
            if now_s - status.received_s > _FORGET_AFTER_S:
                self._statuses.pop(name, None)
        rows: List[Dict[str, Any]] = []
        for one in sorted(list(self._statuses.values())):
            age_s = now_s - one.received_s
            is_old = age_s > LOST_AFTER_S
            rows.append(
                {
                    "name": one.name,
                    "hardware": one.hardware,
                    "level": "STALE" if is_old else one.level,
                    "message": f"silent for {age_s:.0f} s" if is_old else one.message,
                    "values": dict(one.values),
                    "age_s": round(age_s, 1),
                }
            )
        return Item("diagnostics", {"statuses": rows})


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _count(text: str) -> Optional[int]:
    return int(text) if text.isdecimal() and len(text) < 10 else None
