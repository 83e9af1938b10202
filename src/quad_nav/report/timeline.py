"""Content of the chart of goals over time, with recoveries, spins and contacts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, List, Optional, Sequence, Tuple

from quad_nav.navigator.tick import State
from quad_nav.recording.trace import FlightTrace, GoalTrace, RobotTrace
from quad_nav.report.marks import Hover, Marks, contact_hover
from quad_nav.report.measures import goal_end_s, spins, trace_span_s
from quad_nav.report.plot import INK

_BAR, _STRIP = 0.52, 0.14  # heights of a goal's bar and of a strip beside it in a row of height 1
_STATES = ((State.PLANNING, "planning", "#9ec4ee"), (State.CLEARING, "recovering", "#e8a33d"))


@dataclass(frozen=True)
class Bar:
    """A period.

    Attributes:
        y: Middle of the bar; row k is from k - 0.5 to k + 0.5.
        begin_s: Its begin.
        end_s: Its end.
        hover: Its text.
        text: Text in the bar.
        number: Number of the robot whose colour it has; None for the colour of the series.
        is_pale: The colour is pale: of every second goal, and below hatching.
    """

    y: float
    begin_s: float
    end_s: float
    hover: Hover
    text: str = ""
    number: Optional[int] = None
    is_pale: bool = False


@dataclass(frozen=True)
class Bars:
    """Periods of one kind.

    Attributes:
        label: Name in the legend.
        height: Height of a bar.
        bars: The bars.
        colour: Their colour, as ``#20262c``; empty if each has that of its robot.
        is_hatched: Whether they are hatched.
        is_failure: Whether they have a red edge.
    """

    label: str
    height: float
    bars: Sequence[Bar]
    colour: str = ""
    is_hatched: bool = False
    is_failure: bool = False


@dataclass(frozen=True)
class Timeline:
    """One row for each robot, the first at the top.

    Attributes:
        names: Names of the rows.
        span_s: First and last time.
        series: Bars by kind; every series has one.
        marks: Starts of recoveries, and contacts.
    """

    names: Sequence[str]
    span_s: Tuple[float, float]
    series: Sequence[Bars]
    marks: Sequence[Marks]


def timeline(trace: FlightTrace) -> Timeline:
    """Return the chart of a flight."""
    span_s = trace_span_s(trace)
    series = [
        Bars("goal reached", _BAR, _goals(trace, lambda goal: goal.reached)),
        Bars("not reached", _BAR, _goals(trace, _has_failed), is_hatched=True, is_failure=True),
        Bars("not ended", _BAR, _goals(trace, lambda goal: goal.ended_s is None), is_hatched=True),
        *_states(trace, span_s[1]),
        Bars("turns in place", _STRIP, _turns(trace), INK),
    ]
    return Timeline(
        [robot.name for robot in trace.robots],
        span_s,
        [one for one in series if one.bars],
        [one for one in (_recoveries(trace), _contacts(trace)) if one.x],
    )


def _has_failed(goal: GoalTrace) -> bool:
    return goal.ended_s is not None and not goal.reached


def _goals(trace: FlightTrace, is_shown: Callable[[GoalTrace], bool]) -> List[Bar]:
    return [
        Bar(
            row,
            goal.sent_s,
            goal_end_s(goal, robot),
            _goal_hover(goal, row, robot),
            str(goal.index + 1),
            row,
            k % 2 == 1 or not goal.reached,
        )
        for row, robot in enumerate(trace.robots)
        for k, goal in enumerate(robot.goals)
        if is_shown(goal)
    ]


def _goal_hover(goal: GoalTrace, row: int, robot: RobotTrace) -> Hover:
    end_s = goal_end_s(goal, robot)
    lap = f", lap {goal.lap}" if goal.lap > 1 else ""
    return (
        f"{robot.name}, goal {row}.{goal.index + 1}{lap}",
        f"{goal.sent_s:.1f} to {end_s:.1f} s ({end_s - goal.sent_s:.1f} s)",
        "reached" if goal.reached else goal.reason or "not ended",
    )


def _states(trace: FlightTrace, last_s: float) -> List[Bars]:
    """Return strips above the goals while navigators plan without moving, or recover."""
    return [
        Bars(
            label,
            _STRIP,
            [
                _strip(row - (_BAR + _STRIP) / 2, robot, label, begin_s, end_s)
                for row, robot in enumerate(trace.robots)
                for begin_s, state, end_s in _periods(robot, last_s)
                if state is shown
            ],
            colour,
        )
        for shown, label, colour in _STATES
    ]


def _turns(trace: FlightTrace) -> List[Bar]:
    """Return strips below the goals while robots turn in place."""
    return [
        _strip(row + (_BAR + _STRIP) / 2, robot, "turns in place", begin_s, end_s)
        for row, robot in enumerate(trace.robots)
        for begin_s, end_s in spins(robot)
    ]


def _strip(y: float, robot: RobotTrace, what: str, begin_s: float, end_s: float) -> Bar:
    return Bar(y, begin_s, end_s, (f"{robot.name} {what}", f"{begin_s:.1f} to {end_s:.1f} s"))


def _periods(robot: RobotTrace, last_s: float) -> List[Tuple[float, State, float]]:
    """Return (begin, state, end) of each period between two changes of state."""
    ends = [*(time_s for time_s, _ in robot.states[1:]), last_s]
    return [(time_s, state, end) for (time_s, state), end in zip(robot.states, ends)]


def _recoveries(trace: FlightTrace) -> Marks:
    found = [
        (row, time_s, (f"{robot.name}: {what}", f"{time_s:.1f} s"))
        for row, robot in enumerate(trace.robots)
        for time_s, what in robot.recoveries
    ]
    return Marks(
        "recovery",
        [time_s for _, time_s, _ in found],
        [row - _BAR / 2 - _STRIP for row, _, _ in found],
        [hover for _, _, hover in found],
        label="recovery starts",
    )


def _contacts(trace: FlightTrace) -> Marks:
    """Return the contacts in the rows of all robots that they are of."""
    found = [
        (row, contact)
        for row, robot in enumerate(trace.robots)
        for contact in trace.contacts
        if robot.name in (contact.robot, contact.other)
    ]
    return Marks(
        "contact",
        [contact.time_s for _, contact in found],
        [row for row, _ in found],
        [contact_hover(contact) for _, contact in found],
        label="contact",
    )
