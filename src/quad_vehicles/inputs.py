"""Telemetry and commands of one vehicle, with the times at which they came."""

from __future__ import annotations

import math
from typing import Dict, List, Optional, Sequence, Tuple

from quad_nav.geometry import Pose2D, Twist2D
from quad_vehicles.safety import (
    ESTIMATE_HOVER_S,
    HEARTBEAT_S,
    LOST_HOVER_S,
    SILENT_S,
    STILL_MPS,
    STILL_S,
    FlightView,
    jump_m,
)
from quad_vehicles.telemetry import Estimate, Landed, Limits, Status

TEXT_S = 35.0
"""How long a refusal counts as a reason; ArduPilot repeats its own every 31 s."""
REFUSAL_S = 5.0
EXPLAIN_S = 1.5
"""How long a text explains what the autopilot does; heartbeats tell that it disarms up to 1 s
later."""
MOST_TEXTS = 10
"""Reasons that count at the same time, the latest ones: each is part of the state's topic."""
MOST_ACTS = 4
"""Texts that one reason holds at most, whatever an autopilot says."""
_NEVER_S = -math.inf


class Inputs:
    """The last values, which adapters write and the state machine reads.

    Attributes:
        status: Last heartbeat of the vehicle.
        status_s: Time of that heartbeat.
        landed: Where the vehicle is.
        estimate: Last estimate with finite numbers.
        heartbeat_problem: Why the heartbeats that come are not the vehicle's, "" if there are none.
        battery: Charge from 0 to 1; None if it is unknown.
        command: Last velocity command.
        command_s: Time of that command.
        moved_sticks: Sticks that the pilot has moved in flight, "" for none.
        faults: Faults of the autopilot's parameters; None until they are checked.
        map_from_odom: The odometry frame in ``map``, as a localization told last.
    """

    def __init__(self, limits: Limits, localizer: str = "") -> None:
        """Start without any input.

        Args:
            limits: Limits of the vehicle.
            localizer: Name of what localizes it; "" if its odometry frame stands still.
        """
        self._limits, self._localizer = limits, localizer
        self.map_from_odom: Optional[Pose2D] = None
        self.status: Optional[Status] = None
        self.landed = Landed.UNKNOWN
        self.estimate: Optional[Estimate] = None
        self.heartbeat_problem = ""
        self.battery: Optional[float] = None
        self.command, self.command_s = Twist2D(), _NEVER_S
        self.moved_sticks = ""
        self.faults: Optional[Sequence[str]] = None
        self.status_s = self._heard_s = self._estimate_s = self._idle_s = self._frame_s = _NEVER_S
        self._texts: Dict[str, float] = {}  # reason -> until when it counts
        self._acts: Dict[str, float] = {}  # what the autopilot does by itself -> when it said so
        self._battery_problem, self._estimate_problem = "", ""
        self._low_since_s: Optional[float] = None
        self._still_since_s: Optional[float] = None
        self._jump_m = 0.0

    # What comes in.

    def hear(self, now_s: float) -> None:
        """Note that any message of the vehicle has come."""
        self._heard_s = now_s

    def take_status(self, status: Status, now_s: float) -> None:
        """Take a heartbeat of the vehicle."""
        self.status, self.status_s = status, now_s
        self.hear(now_s)

    def take_estimate(self, estimate: Estimate, now_s: float, problem: str = "") -> None:
        """Take an estimate; one with infinite numbers or NaN counts as none.

        Args:
            estimate: The estimate.
            now_s: Time.
            problem: Why it does not count although it goes on, "" if it counts.
        """
        if not estimate.is_finite:
            return
        before = self.estimate
        self.estimate, self._estimate_problem = estimate, problem
        if problem or (before is not None and self._is_frozen(before, estimate, now_s)):
            return
        elapsed_s = now_s - self._estimate_s
        if before is not None and elapsed_s < 1.0:
            self._jump_m = self._jump_m or jump_m(
                tuple(before.odom_from_base.translation.tolist()),
                before.odom_velocity_mps,
                max(estimate.stamp_s - before.stamp_s, elapsed_s),
                tuple(estimate.odom_from_base.translation.tolist()),
            )
        self._estimate_s = now_s

    def take_frame(self, map_from_odom: Pose2D, now_s: float) -> None:
        """Take the pose of the odometry frame; with infinite time it holds for good."""
        self.map_from_odom, self._frame_s = map_from_odom, now_s

    def _is_frozen(self, before: Estimate, after: Estimate, now_s: float) -> bool:
        """Return whether the estimate stands still although the command is to move."""
        same = before.odom_from_base == after.odom_from_base
        command = self.command
        moves = math.hypot(command.vx_mps, command.vy_mps) > STILL_MPS
        if not (same and moves and now_s - self.command_s < 1.0):
            self._still_since_s = None
            return False
        if self._still_since_s is None:
            self._still_since_s = now_s
        return now_s - self._still_since_s > STILL_S

    def take_battery(self, share: Optional[float], now_s: float, problem: str = "") -> None:
        """Take the state of the battery.

        Args:
            share: Charge, 0 to 1; None if it is unknown.
            now_s: Time.
            problem: Why the battery is low, whatever the charge says; "" if it is not.
        """
        self.battery, least = share, self._limits.battery
        if not problem and share is not None and share < least:
            problem = f"battery at {100.0 * share:.0f} %, expected {100.0 * least:.0f} % or more"
        self._battery_problem = problem
        if not problem:
            self._low_since_s = None
        elif self._low_since_s is None:
            self._low_since_s = now_s

    def take_command(self, twist: Twist2D, now_s: float) -> bool:
        """Take a velocity command; return False for one that is not finite, which is dropped."""
        if not twist.is_finite:
            return False
        self.command, self.command_s = twist, now_s
        return True

    def take_idle(self, now_s: float) -> None:
        """Note the navigator's word that it lives and has no goal."""
        self._idle_s = now_s

    def take_text(self, text: str, now_s: float) -> None:
        """Take a reason of the autopilot for not being ready."""
        self._count(text, now_s + TEXT_S)

    def take_act(self, text: str, now_s: float) -> None:
        """Take the autopilot's words about what it does by itself."""
        others = [(words, s) for words, s in self._acts.items() if words != text]
        self._acts = dict([*others[1 - MOST_ACTS :], (text, now_s)])

    def refuse(self, reason: str, now_s: float) -> None:
        """Count a refusal as a reason for a short time."""
        self._count(reason, now_s + REFUSAL_S)

    def _count(self, reason: str, until_s: float) -> None:
        others = [item for item in self._texts.items() if item[0] != reason]
        self._texts = dict([*others[1 - MOST_TEXTS :], (reason, until_s)])

    def clear_texts(self) -> None:
        """Forget the autopilot's reasons: it has said that it is ready."""
        self._texts.clear()

    def begin_flight(self, now_s: float) -> None:
        """Forget what belongs to the flight before; waiting for commands begins now."""
        self._jump_m, self.moved_sticks, self._still_since_s = 0.0, "", None
        self.command = Twist2D()
        self.command_s, self._idle_s = _NEVER_S, now_s

    def restore_link(self, now_s: float) -> None:
        """Count what is late as late only from now on: before, the link was lost."""
        self._estimate_s = max(self._estimate_s, now_s - ESTIMATE_HOVER_S)
        self._frame_s = max(self._frame_s, now_s - LOST_HOVER_S)
        self.command_s = min(self.command_s, now_s)

    # What the state machine asks.

    def link_problem(self, now_s: float) -> str:
        """Return why the link counts as lost, "" if it does not."""
        if self.status is None:
            return self.heartbeat_problem or "no heartbeat yet"
        if now_s - self._heard_s > SILENT_S and now_s - self.status_s > SILENT_S + 0.5:
            return f"nothing heard from the vehicle for {SILENT_S:g} s"
        if now_s - self.status_s > HEARTBEAT_S:
            return f"no heartbeat for {HEARTBEAT_S:g} s"
        return ""

    def is_estimate_late(self, now_s: float) -> bool:
        """Return whether there is no recent estimate."""
        return self.estimate is None or now_s - self._estimate_s > ESTIMATE_HOVER_S

    def lost_s(self, now_s: float) -> float:
        """Return the age of the localization's last word; 0 if none is needed."""
        return max(now_s - self._frame_s, 0.0) if self._localizer else 0.0

    def not_ready(self, now_s: float) -> List[str]:
        """Return the reasons why the vehicle cannot take off."""
        reasons = []
        if self.faults is None:
            reasons.append("the autopilot's parameters are not checked yet")
        else:
            reasons += self.faults
        if self.is_estimate_late(now_s):
            reasons.append(self._estimate_problem or "no position estimate")
        if self.lost_s(now_s) > LOST_HOVER_S:
            reasons.append(f"not localized: no transform map -> odom from {self._localizer}")
        if self._battery_problem:
            reasons.append(self._battery_problem)
        self._texts = {text: end_s for text, end_s in self._texts.items() if end_s > now_s}
        return reasons + list(self._texts)

    def height_m(self, ground_m: float) -> float:
        """Return the height above a ground; 0 without an estimate."""
        return 0.0 if self.estimate is None else self.estimate.odom_from_base.z_m - ground_m

    def map_from_base(self) -> Optional[Pose2D]:
        """Return the vehicle's pose in ``map`` as a localization tells it; None without one."""
        if self.estimate is None or self.map_from_odom is None:
            return None
        return self.map_from_odom.compose(self.estimate.odom_from_base.to_2d())

    def ways(
        self, odom_from_start: Optional[Pose2D], map_from_start: Optional[Pose2D]
    ) -> List[Tuple[float, float]]:
        """Return the ways (x, y) from the take-off in the body's axes, of all known frames.

        Odometry drifts, but the autopilot's own fence counts by it.
        """
        odom_from_base = None if self.estimate is None else self.estimate.odom_from_base.to_2d()
        found = []
        for start, base in (
            (odom_from_start, odom_from_base),
            (map_from_start, self.map_from_base()),
        ):
            if start is not None and base is not None:
                x_m, y_m = base.inverse_transform(start.x_m, start.y_m)
                found.append((-x_m, -y_m))
        return found

    def view(
        self, now_s: float, ways: Sequence[Tuple[float, float]], ground_m: float
    ) -> FlightView:
        """Return the facts about the vehicle in flight.

        Args:
            now_s: Time.
            ways: Those of ``ways``.
            ground_m: Height of the ground in the odometry frame.

        Raises:
            ValueError: If no heartbeat has come yet.
        """
        if self.status is None:
            raise ValueError("no heartbeat yet")
        low_s = self._low_since_s
        return FlightView(
            self.status,
            moved_sticks=self.moved_sticks,
            heard_age_s=now_s - self._heard_s,
            status_age_s=now_s - self.status_s,
            autopilot_text="; ".join(
                text for text, said_s in self._acts.items() if now_s - said_s < EXPLAIN_S
            ),
            estimate_age_s=now_s - self._estimate_s,
            estimate_problem=self._estimate_problem or "no new estimate",
            jump_m=self._jump_m,
            lost_s=self.lost_s(now_s),
            low_battery_s=0.0 if low_s is None else now_s - low_s,
            battery_problem=self._battery_problem,
            height_m=self.height_m(ground_m),
            distance_m=max((math.hypot(*way) for way in ways), default=0.0),
            command_age_s=now_s - self.command_s,
            waiting_age_s=now_s - max(self.command_s, self._idle_s),
        )
