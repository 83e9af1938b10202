"""Content of the map of paths: one flight, or several over one scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, List, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from quad_nav.recording.trace import FlightTrace, GoalTrace, RobotTrace
from quad_nav.report.compared_flight import ComparedFlight
from quad_nav.report.encounters import Encounter
from quad_nav.report.flight_metrics import FlightMetrics
from quad_nav.report.marks import Hover, Marks, contact_hover, encounter_marks
from quad_nav.report.measures import Tracks, goal_end_s
from quad_nav.report.scene_drawing import Extent, extent, scene_extent
from quad_nav.sim.contacts import Contact
from quad_nav.sim.scene import Scene

MOST_OVERLAID = 40
"""Number of flights whose paths are shown."""


@dataclass(frozen=True)
class FlownPath:
    """The path of a robot.

    Attributes:
        number: Number of its colour and line pattern.
        robot: The robot, with at least one sample.
        label: Name in the legend; empty if it is not listed there.
        hover: Name while the path is hovered.
        group: Name of the parts that are shown and hidden together.
    """

    number: int
    robot: RobotTrace
    label: str
    hover: str
    group: str


@dataclass(frozen=True)
class PathsMap:
    """Paths over the scene.

    Attributes:
        alt: Description.
        scene: The scene, if known.
        region: Visible part of ``map``.
        parts: Paths and marks, the uppermost last.
        robots: Number of robots, for the size of the symbols.
        flight: The flight and its tracks, if it is one: hulls and moving obstacles are drawn, too.
    """

    alt: str
    scene: Optional[Scene]
    region: Extent
    parts: Sequence[Union[FlownPath, Marks]]
    robots: int = 1
    flight: Optional[Tuple[FlightTrace, Tracks]] = None

    @property
    def paths(self) -> List[FlownPath]:
        """The paths."""
        return [part for part in self.parts if isinstance(part, FlownPath)]

    @property
    def marks(self) -> List[Marks]:
        """The marks."""
        return [part for part in self.parts if isinstance(part, Marks)]

    def height(self, tallest: float) -> float:
        """Return the height of the region in parts of its width, 0.3 to ``tallest``."""
        x0, x1, y0, y1 = self.region
        return min(max((y1 - y0) / (x1 - x0), 0.3), tallest)


def flown_paths(trace: FlightTrace, tracks: Tracks, marked: Sequence[Encounter]) -> PathsMap:
    """Return the map of a flight; the encounters ``marked`` get the letters A, B, ..."""
    parts: List[Union[FlownPath, Marks]] = []
    for k, robot in enumerate(trace.robots):
        parts += _robot_parts(k, robot)
    parts += _contacts(trace.contacts, "contact", "")
    parts += encounter_marks(marked, [one.x_m for one in marked], [one.y_m for one in marked])
    return PathsMap(
        "Paths over the scene",
        trace.scene,
        extent(trace.scene, tracks),
        parts,
        max(len(trace.robots), 1),
        (trace, tracks),
    )


def overlaid_paths(flights: Sequence[ComparedFlight], metrics: Sequence[FlightMetrics]) -> PathsMap:
    """Return the paths of several flights, with their metrics, over the scene of the first one."""
    parts: List[Union[FlownPath, Marks]] = []
    has_contacts = False
    for number, (flight, flown) in enumerate(zip(flights, metrics)):
        label, group = f"{number + 1}: {flown.title}", f"flight{number}"
        robots = [(k, robot) for k, robot in enumerate(flight.robots) if len(robot.times_s)]
        for _, robot in robots:
            shown = label if robot is robots[0][1] else ""
            parts.append(FlownPath(number, robot, shown, f"{label}, {robot.name}", group))
        parts += [_start(number, robot, str(k), group) for k, robot in robots]
        parts += _contacts(flight.contacts, "" if has_contacts else "contact", group)
        has_contacts = has_contacts or bool(flight.contacts)
    parts += _common_goals(flights)
    return PathsMap(
        "Paths of all flights over the scene", flights[0].scene, _region(flights), parts
    )


def _region(flights: Sequence[ComparedFlight]) -> Extent:
    places: List[NDArray[np.float64]] = [
        robot.positions_m[:, :2] for flight in flights for robot in flight.robots
    ]
    return scene_extent(flights[0].scene, np.concatenate(places or [np.empty((0, 2))]))


def _robot_parts(number: int, robot: RobotTrace) -> List[Union[FlownPath, Marks]]:
    """Return path, start and goals of a robot; goals at one place once, as they ended last."""
    group = f"robot{number}"
    places = {(goal.index, goal.pose.x_m, goal.pose.y_m): goal for goal in robot.goals}
    goals = list(places.values())
    parts: List[Union[FlownPath, Marks]] = []
    if len(robot.times_s):
        parts.append(FlownPath(number, robot, robot.name, robot.name, group))
        parts.append(_start(number, robot, str(number), group))
    if goals:
        texts = [f"{number}.{goal.index + 1}" for goal in goals]
        parts.append(
            Marks(
                "goal",
                [goal.pose.x_m for goal in goals],
                [goal.pose.y_m for goal in goals],
                [_goal_hover(goal, robot, text) for goal, text in zip(goals, texts)],
                texts,
                number,
                [goal.reached for goal in goals],
                group=group,
            )
        )
    return parts


def _start(number: int, robot: RobotTrace, text: str, group: str) -> Marks:
    (x_m, y_m) = robot.positions_m[0, :2].tolist()
    return Marks("start", [x_m], [y_m], [(robot.name, "start")], [text], number, group=group)


def _goal_hover(goal: GoalTrace, robot: RobotTrace, text: str) -> Hover:
    spent = f"{goal_end_s(goal, robot) - goal.sent_s:.1f} s"
    result = f"{goal.reason or 'not ended'} after {spent}"
    if goal.reached:
        error = goal.yaw_error_rad
        result = f"reached in {spent}" + (
            f", yaw error {error:.2f} rad" if error is not None else ""
        )
    return f"{robot.name}, goal {text}", _place(goal.pose.x_m, goal.pose.y_m), result


def _contacts(contacts: Sequence[Contact], label: str, group: str) -> List[Marks]:
    if not contacts:
        return []
    return [
        Marks(
            "contact",
            [contact.x_m for contact in contacts],
            [contact.y_m for contact in contacts],
            [(*contact_hover(contact), _place(contact.x_m, contact.y_m)) for contact in contacts],
            label=label,
            group=group,
        )
    ]


def _common_goals(flights: Sequence[ComparedFlight]) -> List[Marks]:
    """Return the goals of all flights, each place once."""
    places: Dict[Tuple[str, float, float], None] = {
        (f"{k}.{goal.index + 1}", goal.pose.x_m, goal.pose.y_m): None
        for flight in flights
        for k, robot in enumerate(flight.robots)
        for goal in robot.goals
    }
    if not places:
        return []
    texts, x_m, y_m = zip(*places)
    hovers = [(f"goal {text}", _place(x, y)) for text, x, y in places]
    return [Marks("goal", x_m, y_m, hovers, texts, filled=[False] * len(texts), label="goal")]


def _place(x_m: float, y_m: float) -> str:
    return f"({x_m:.2f}, {y_m:.2f}) m"
