"""Actions of the made-up fleet."""

from __future__ import annotations

import sys
from typing import Any, Dict, List

import numpy as np

from quad_web.view.actions import (
    FLIGHT_ACTIONS,
    READS,
    Actions,
    Answer,
    GoalFileView,
    ParameterView,
)

GOALS = ((1.0, 2.0, None), (4.0, 3.0, 1.5), (6.0, 6.0, 0.0))  # of each file
PARAMETERS = (
    ParameterView("", "planner_frequency", "double", 0.0, 0.0, 0.0, 100.0, doc="Hz"),
    ParameterView("DWAPlannerROS", "max_vel_x", "double", 0.55, 0.55, 0.0, 5.0, doc="Speed ahead"),
    ParameterView("DWAPlannerROS", "vx_samples", "int", 10, 10, 1, 100),
    ParameterView("DWAPlannerROS", "stop", "bool", True, True),
    ParameterView("costmap", "method", "int", 1, 1, 0, 2, (("Overwrite", 0), ("Maximum", 1))),
)


def say(line: object) -> None:
    """Print a line in one piece, whichever thread prints at the same time."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


class SyntheticActions(Actions):
    """Prints each call, and answers it; those that a page needs an answer of have an effect."""

    def __init__(self, fleet: Any) -> None:
        self._fleet = fleet
        of_recordings = frozenset({"start", "pause", "set_rate", "seek"})
        self.available = of_recordings if fleet.duration_s else FLIGHT_ACTIONS
        self.renew()

    def renew(self) -> None:
        """Forget what was done, and begin another flight."""
        self._saved: Dict[int, Any] = {}
        self._values: Dict[Any, Any] = {}
        self._fleet.renew()

    def call(self, name: str, *arguments: Any) -> Any:
        if name not in READS:
            say(f"call {(name, *arguments)!r}")
        return super().call(name, *arguments)

    def start(self) -> Answer:
        self._fleet.flight_state = "running"
        return Answer(True, "running")

    def pause(self) -> Answer:
        self._fleet.flight_state = "paused"
        return Answer(True, "paused")

    def reset(self) -> Answer:
        self._fleet.time_s = 0.0
        return Answer(True, "reset to the start poses")

    def set_rate(self, rate: float) -> Answer:
        self._fleet.rate = rate or 10.0
        return Answer(True, f"rate {rate:g}")

    def seek(self, time_s: float) -> Answer:
        self._fleet.time_s = time_s
        return Answer(True, f"at {time_s:.1f} s")

    def _is_inside(self, goal: Any) -> bool:
        width_m, depth_m = self._fleet.size_m
        return 0 < goal.x_m < width_m and 0 < goal.y_m < depth_m

    def send_goal(self, robot: Any, pose: Any) -> Answer:
        if robot is None:
            offsets_m = self._fleet.positions() - (pose.x_m, pose.y_m)
            robot = int(np.argmin(np.hypot(*offsets_m.T)))
        if not self._is_inside(pose):
            return Answer(False, f"robot{robot}: goal outside of the arena")
        self._fleet.sent[robot] = pose
        self._fleet.put_goals()
        return Answer(True, f"robot{robot}: goal sent ({pose.x_m:.2f}, {pose.y_m:.2f})")

    def cancel(self, robot: int) -> Answer:
        return Answer(True, f"robot{robot}: goal cancelled; hovering")

    def stop_all(self) -> Answer:
        self._fleet.flight_state = "stopped"
        return Answer(True, "all goals cancelled; every robot hovers")

    def clear_costmaps(self, robot: int) -> Answer:
        return Answer(True, f"robot{robot}: costmaps cleared")

    def enable_lidar(self, robot: int, is_on: bool) -> Answer:
        self._fleet.lidars[robot] = is_on
        self._fleet.state.put_all([], (f"scan/{robot}",))
        return Answer(True, f"robot{robot}: LIDAR {'on' if is_on else 'off'}")

    def parameters(self, robot: int) -> List[ParameterView]:
        values = [self._values.get((robot, one.namespace, one.name)) for one in PARAMETERS]
        return [
            one if value is None else ParameterView(**{**vars(one), "value": value})
            for one, value in zip(PARAMETERS, values)
        ]

    def set_parameters(self, robot: int, namespace: str, values: Any) -> Answer:
        self._values.update({(robot, namespace, name): value for name, value in values.items()})
        return Answer(True, f"robot{robot}: {namespace} {values}")

    def goal_files(self) -> List[GoalFileView]:
        goals = {i: list(self._saved.get(i, GOALS)) for i in self._fleet.robots}
        return [
            GoalFileView(i, f"/tmp/goals{i}.json", f"v{i in self._saved}", goals[i]) for i in goals
        ]

    def check_goals(self, robot: int, version: str, goals: Any) -> List[str]:
        return ["" if self._is_inside(goal) else "outside of the arena" for goal in goals]

    def save_goals(self, robot: int, version: str, goals: Any) -> Answer:
        if any(self.check_goals(robot, version, goals)):
            return Answer(False, f"goals{robot}.json: not saved: a goal is outside of the arena")
        self._saved[robot] = [(goal.x_m, goal.y_m, goal.yaw_rad) for goal in goals]
        return Answer(True, f"goals{robot}.json: {len(goals)} goals saved")
