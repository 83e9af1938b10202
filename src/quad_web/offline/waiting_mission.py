"""The items of a page from a mission that has not begun, and the edits of its goals."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from typing import Any, Dict, List, Sequence

import numpy as np

from quad_nav.costmap.cost_grid import occupancy
from quad_nav.errors import InputError
from quad_nav.geometry import Twist2D
from quad_nav.loop.inspection import GLOBAL_COSTMAP, PLAN
from quad_nav.mission.goal_file import parse_goals
from quad_nav.scenario.flight_setup import FlightOptions
from quad_nav.scenario.goal_plans import NO_PLAN
from quad_nav.scenario.preview import MissionPreview, RobotPreview
from quad_nav.sim.movers import Movers
from quad_web.view import rows
from quad_web.view.actions import Answer, GoalChange, GoalFileView
from quad_web.view.goal_files import GoalEditing, GoalFiles
from quad_web.view.items import (
    UNKNOWN_BODY,
    ObstacleItems,
    body_row,
    costmap_item,
    line_item,
    poses_item,
    robots_item,
    scene_item,
)
from quad_web.view.state import FleetState, Item


class WaitingMission(GoalEditing):
    """Shows a mission as a flight that waits at its start; people edit its goal files.

    Goals are shown as the files have them, plans also as they are being edited.
    """

    available = frozenset({"goal_files", "check_goals", "save_goals"})
    refusal = "the flight has not begun; quad preview --edit edits goals only"

    def __init__(self, options: FlightOptions, title: str, state: FleetState) -> None:
        """Show a mission, with a title as the heading of the pages."""
        self._options, self._title, self._state = options, title, state
        self._lock = threading.RLock()
        self._files = GoalFiles({}, lambda robot: self._preview.check(robot))
        self._read()

    # -- actions, in the pages' threads --------------------------------------------------

    def goal_files(self) -> List[GoalFileView]:
        """Return the goal files as they are now; show them if they have changed."""
        with self._lock:
            files = self._files.goal_files()
            if files != self._shown_files:
                self._read()
            return files

    def check_goals(self, robot: int, version: str, goals: Sequence[GoalChange]) -> List[str]:
        """Return the fault of each goal, "" for a good one, and show the plans to the good ones."""
        with self._lock:
            faults = self._files.check_goals(robot, goals)
            try:
                content = self._files.edited(robot, version, goals, places=False)
                sequence = parse_goals(content, str(self._files.files[robot]))
            except InputError:
                return faults  # without goals or of another version; the page says so
            self._state.put_all([_plan_item(self._preview.robot(robot, sequence))])
            return faults

    def save_goals(self, robot: int, version: str, goals: Sequence[GoalChange]) -> Answer:
        """Check the goals of a robot, and write its file if they are good."""
        with self._lock:
            return self._files.save_goals(robot, version, goals)

    # -- what is shown -------------------------------------------------------------------

    def _read(self) -> None:
        """Read the mission and show it."""
        self._preview = preview = MissionPreview(self._options)
        self._files.files = dict(preview.files)
        self._shown_files = self._files.goal_files()
        robots = [preview.robot(number) for number in preview.numbers]
        self._state.clear()
        self._state.put_all([*self._static_items(), *self._robots_items(robots)])
        for line in preview.problems:
            self._state.add_event(0.0, line, "error")
        for line in preview.warnings:
            self._state.add_event(0.0, line, "warning")
        for robot in robots:
            for line in robot.warnings:
                self._state.add_event(0.0, line, "warning", robot.number)

    def _static_items(self) -> List[Item]:
        """Return the scene with its moving obstacles where they start, and the flight's item."""
        preview, scene = self._preview, self._preview.scene
        reason = "; ".join(preview.problems)
        items = [rows.flight_item("preview", self._title, "ready", 0.0, reason=reason)]
        if scene is not None:
            items.append(scene_item(scene))
        if scene is not None and preview.moving:
            poses = Movers(scene, self._options.seed).poses(0.0)
            items += ObstacleItems().items(scene, poses)
        return items

    def _robots_items(self, robots: Sequence[RobotPreview]) -> List[Item]:
        """Return the items of robots; one without a start or with a faulty file has no pose."""
        preview, scene = self._preview, self._preview.scene
        names = [f"quad{number}" for number in range(max((*preview.files, *preview.numbers)) + 1)]
        bodies = [UNKNOWN_BODY] * len(names)
        for robot in robots:
            if robot.start is not None and scene is not None:
                pose = replace(robot.start.to_3d(), z_m=scene.altitude_m)
                bodies[robot.number] = body_row(pose, Twist2D())
        poses = poses_item(0.0, time.time(), bodies)
        samples = rows.samples_item(
            0.0,
            poses.arrays["pose"],
            preview.robot_radius_m,
            scene,
            preview.moving,
        )
        now = {
            robot.number: rows.RobotNow(
                goal=1,
                goals=len(robot.sequence.goals),
                reason="; ".join((*filter(None, robot.faults), *robot.warnings)),
            )
            for robot in robots
        }
        return [
            robots_item(names, preview.robot_radius_m),
            poses,
            samples,
            rows.fleet_items(now, names, samples)[0],
            rows.goals_item([row for robot in robots for row in _goal_rows(robot)]),
            *map(_plan_item, robots),
            *self._costmap_items(),
        ]

    def _costmap_items(self) -> List[Item]:
        items = []
        for number in self._preview.numbers:
            costmap = self._preview.costmap(number)
            if costmap is not None:
                costs = occupancy(costmap.costs)
                items.append(costmap_item(GLOBAL_COSTMAP, number, costmap.spec, costs))
        return items


def _goal_rows(robot: RobotPreview) -> List[Dict[str, Any]]:
    """Return the rows of a robot's goals; those that ``quad fly`` refuses are shown as failed."""
    goal_rows = rows.goal_rows(robot.number, robot.sequence.goals, 0, False)
    for row, fault in zip(goal_rows, robot.faults):
        if fault:
            row["state"] = "failed"
    return goal_rows


def _plan_item(robot: RobotPreview) -> Item:
    """Return the plans from goal to goal as one line: each begins where the one before it ends."""
    return line_item(PLAN, robot.number, np.concatenate((NO_PLAN, *robot.plans)))
