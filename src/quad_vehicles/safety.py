"""Dangers in flight, and what the bridge does about each, in order.

1. A pilot or another station changes the mode, or moves the sticks: stop sending (taken over).
2. The link is lost: stop sending, heartbeats included, so that the autopilot's own failsafe acts.
3. The estimate jumps, stays away or does not count, nobody localizes the vehicle for long, the
   battery is low, or a limit of height or distance is crossed: land.
4. The estimate is late or does not count, or the vehicle is not localized: hover.
5. No velocity command: hover after 0.5 s, land after 5 s.

``danger`` tests them in this order and returns the first.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, replace
from typing import Callable, Optional, Sequence, Tuple

from quad_vehicles.telemetry import Limits, Status, Vector

COMMAND_HOVER_S = 0.5
COMMAND_LAND_S = 5.0
ESTIMATE_HOVER_S = 0.5
ESTIMATE_LAND_S = 2.0
LOST_HOVER_S = 1.0
LOST_LAND_S = 10.0
"""A vehicle that is not localized drifts while it hovers: ArduPilot's velocity was recorded to be
wrong by up to 0.036 m/s."""
SILENT_S = 1.0
"""The link is lost when nothing has come from the vehicle for this long."""
HEARTBEAT_S = 3.5
"""The link is lost when no heartbeat has come for this long; they come once a second."""
ARMED_S = 2.5
"""Heartbeats have told by then that the motors are armed, unless somebody has disarmed them."""
BATTERY_S = 2.0
"""The charge must be low for this long, because the voltage sags under load."""
JUMP_M = 0.5
"""Smallest jump of the estimated position, beside what its velocity explains."""
STILL_S = 1.5
"""An estimate that does not change at all under a command to move is frozen after this time."""
STILL_MPS = 0.15
FENCE_GAIN_1PS = 0.4
"""Outward speed for each metre to the limit of distance: slow against the 0.65 s of the vehicle."""


class Reaction(enum.Enum):
    """What the bridge does about a danger."""

    TAKEN_OVER = "taken over"
    LINK_LOST = "link lost"
    LAND = "land"
    HOVER = "hover"


@dataclass(frozen=True)
class Danger:
    """A danger and the reaction.

    Attributes:
        reaction: What the bridge does.
        reason: Why, for people.
    """

    reaction: Reaction
    reason: str


@dataclass(frozen=True)
class FlightView:
    """Facts about a vehicle in flight at one time, ages in seconds.

    Attributes:
        status: Last heartbeat.
        may_land: Whether the mode for landing is ours too, because we have ordered it.
        moved_sticks: Sticks that the pilot has moved, "" for none.
        autopilot_text: Why the autopilot acts by itself, in its own words; "" if it does not.
        heard_age_s: Age of the last message from the vehicle.
        status_age_s: Age of the last heartbeat.
        estimate_age_s: Age of the last estimate that counts.
        estimate_problem: What is missing.
        jump_m: Jump of the estimate, 0 if there was none.
        lost_s: Age of the last transform of the localization; 0 without one.
        low_battery_s: How long the battery has been low.
        battery_problem: Why it counts as low.
        height_m: Height above the place of take-off.
        distance_m: Horizontal distance from the place of take-off, the larger one of those in the
            odometry frame and in ``map``.
        command_age_s: Age of the last velocity command.
        waiting_age_s: Age of the last command, or of the navigator's last word that it has no goal.
        is_grounded: Whether the vehicle stands on the ground although it should fly.
    """

    status: Status
    may_land: bool = False
    moved_sticks: str = ""
    autopilot_text: str = ""
    heard_age_s: float = 0.0
    status_age_s: float = 0.0
    estimate_age_s: float = 0.0
    estimate_problem: str = "no new estimate"
    jump_m: float = 0.0
    lost_s: float = 0.0
    low_battery_s: float = 0.0
    battery_problem: str = "battery low"
    height_m: float = 0.0
    distance_m: float = 0.0
    command_age_s: float = 0.0
    waiting_age_s: float = 0.0
    is_grounded: bool = False

    def on_desk(self) -> FlightView:
        """Return what counts in a dry run, on the desk or carried by hand."""
        return FlightView(
            replace(self.status, is_armed=True),
            moved_sticks=self.moved_sticks,
            autopilot_text=self.autopilot_text,
            heard_age_s=self.heard_age_s,
            status_age_s=self.status_age_s,
            command_age_s=self.command_age_s,
            waiting_age_s=self.waiting_age_s,
        )


Test = Callable[[FlightView, Limits], str]


def danger(view: FlightView, limits: Limits) -> Optional[Danger]:
    """Return the most important danger, None if there is none."""
    for reaction, test in _TESTS:
        reason = test(view, limits)
        if reason:
            return Danger(reaction, reason)
    return None


def _taken_over(view: FlightView, _: Limits) -> str:
    status, text = view.status, view.autopilot_text
    who = f"by the autopilot: {text}" if text else "from outside"
    if not status.is_armed:
        return f"the motors were disarmed {who}"
    is_ours = status.is_controlled or status.is_settling or (view.may_land and status.is_landing)
    if not is_ours:
        return f"the mode was changed to {status.mode} {who}"
    return f"the pilot moved the sticks ({view.moved_sticks})" if view.moved_sticks else ""


def _link_lost(view: FlightView, _: Limits) -> str:
    if view.heard_age_s > SILENT_S:
        return f"nothing heard from the vehicle for {SILENT_S:g} s"
    return f"no heartbeat for {HEARTBEAT_S:g} s" if view.status_age_s > HEARTBEAT_S else ""


def _must_land(view: FlightView, limits: Limits) -> str:
    if view.is_grounded:
        return "it stands on the ground"
    if view.jump_m > 0.0:
        return f"the estimated position jumped by {view.jump_m:.2f} m"
    if view.estimate_age_s > ESTIMATE_LAND_S:
        return f"{view.estimate_problem} for {ESTIMATE_LAND_S:g} s"
    if view.lost_s > LOST_LAND_S:
        return f"not localized for {LOST_LAND_S:g} s"
    if view.low_battery_s > BATTERY_S:
        return view.battery_problem
    if view.height_m > limits.height_m:
        return f"height {view.height_m:.2f} m, the limit is {limits.height_m:g} m"
    if view.distance_m > limits.radius_m:
        return f"{view.distance_m:.2f} m from take-off, the limit is {limits.radius_m:g} m"
    return ""


def _must_hover(view: FlightView, _: Limits) -> str:
    if view.estimate_age_s > ESTIMATE_HOVER_S:
        return f"{view.estimate_problem} for {ESTIMATE_HOVER_S:g} s"
    return f"not localized for {LOST_HOVER_S:g} s" if view.lost_s > LOST_HOVER_S else ""


def _never_commanded(view: FlightView, _: Limits) -> str:
    silent = view.waiting_age_s > COMMAND_LAND_S
    return f"no velocity command for {COMMAND_LAND_S:g} s" if silent else ""


def _not_commanded(view: FlightView, _: Limits) -> str:
    silent = view.command_age_s > COMMAND_HOVER_S
    return f"no velocity command for {COMMAND_HOVER_S:g} s" if silent else ""


_TESTS: Sequence[Tuple[Reaction, Test]] = (
    (Reaction.TAKEN_OVER, _taken_over),
    (Reaction.LINK_LOST, _link_lost),
    (Reaction.LAND, _must_land),
    (Reaction.LAND, _never_commanded),
    (Reaction.HOVER, _must_hover),
    (Reaction.HOVER, _not_commanded),
)


def arming_problem(status: Status, is_accepted: bool, age_s: float) -> str:
    """Return who has ended an arming before the take-off, "" if nobody has.

    Args:
        status: Last heartbeat.
        is_accepted: Whether the autopilot has accepted the order to arm.
        age_s: Age of the order.
    """
    if not (status.is_controlled or status.is_settling):
        return f"the mode was changed to {status.mode} from outside"
    ended = is_accepted and not status.is_armed and age_s > ARMED_S
    return "the motors were disarmed from outside" if ended else ""


def jump_m(before: Vector, velocity_mps: Vector, elapsed_s: float, after: Vector) -> float:
    """Return how far an estimated position jumped, 0 if its velocity explains the step.

    Args:
        before: Position before, m.
        velocity_mps: Velocity before, in the same frame.
        elapsed_s: Time between the two.
        after: Position after, m.
    """
    steps = (a - (b + v * elapsed_s) for a, b, v in zip(after, before, velocity_mps))
    error_m = math.sqrt(sum(step * step for step in steps))
    return error_m if error_m > JUMP_M + max(elapsed_s, 0.0) else 0.0


def inside_fence(
    velocity_mps: Tuple[float, float], offset_m: Tuple[float, float], radius_m: float
) -> Tuple[float, float]:
    """Slow the outward part of a horizontal velocity down before the limit of distance.

    Args:
        velocity_mps: Velocity (x, y).
        offset_m: Position (x, y) from the place of take-off, in the same axes.
        radius_m: Largest distance.

    Returns:
        The velocity (x, y), its outward part at most `FENCE_GAIN_1PS` of the way that is left.
    """
    distance_m = math.hypot(*offset_m)
    if distance_m == 0.0:
        return velocity_mps
    x, y = offset_m[0] / distance_m, offset_m[1] / distance_m
    outward_mps = velocity_mps[0] * x + velocity_mps[1] * y
    excess_mps = outward_mps - FENCE_GAIN_1PS * max(radius_m - distance_m, 0.0)
    if outward_mps <= 0.0 or excess_mps <= 0.0:
        return velocity_mps
    return velocity_mps[0] - excess_mps * x, velocity_mps[1] - excess_mps * y
