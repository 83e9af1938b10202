"""Actions of the made-up fleet: recorded; those that a page needs an answer of have an effect."""

from __future__ import annotations

import sys
from typing import Any, Dict, List, Optional

import numpy as np
from synthetic_fleet import SyntheticFleet

from quad_web.view.actions import Actions, Answer, GoalChange, GoalFileView, ParameterView


def say(line: object) -> None:
    """Print a line in one piece, whichever thread prints at the same time."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


class SyntheticActions(Actions):
    """Records each call in ``calls`` and answers it."""

    def __init__(self, fleet: SyntheticFleet) -> None:
        names = {name for name in vars(Actions) if not name.startswith("_")} - {"available"}
        of_recordings = {"start", "pause", "set_rate", "seek"}
        self.available = frozenset(of_recordings if fleet.duration_s else names - {"seek"})
        self.fleet = fleet
        self.prints_calls = False
        self._set_start()

    def _set_start(self) -> None:
        self.calls: List[tuple] = []
        self.saved: Dict[int, List[GoalChange]] = {}
        self.values: Dict[tuple, Any] = {}

    def renew(self) -> None:
        """Forget what was done, and begin another flight."""
        self._set_start()
        self.fleet.renew()

    def _did(self, text: str, *call: Any, ok: bool = True) -> Answer:
        self.calls.append(call)
        if self.prints_calls:
            say(f"call {call!r}")
        return Answer(ok, text)

    def start(self) -> Answer:
        self.fleet.flight_state = "running"
        return self._did("running", "start")

    def pause(self) -> Answer:
        self.fleet.flight_state = "paused"
        return self._did("paused", "pause")

    def reset(self) -> Answer:
        self.fleet.time_s = 0.0
        return self._did("reset to the start poses", "reset")

    def set_rate(self, rate: float) -> Answer:
        self.fleet.rate = rate or 10.0
        return self._did(f"rate {rate:g}", "set_rate", rate)

    def seek(self, time_s: float) -> Answer:
        self.fleet.time_s = time_s
        return self._did(f"at {time_s:.1f} s", "seek", time_s)

    def send_goal(self, robot: Optional[int], pose: Any) -> Answer:
        if robot is None:
            distances = np.hypot(*(self.fleet.poses()[:, :2] - (pose.x_m, pose.y_m)).T)
            robot = int(np.argmin(distances))
        width_m, height_m = self.fleet.size_m
        if not (0 < pose.x_m < width_m and 0 < pose.y_m < height_m):
            return self._did(
                f"robot{robot}: goal outside of the arena", "send_goal", robot, pose, ok=False
            )
        self.fleet.goals_sent[robot] = pose
        self.fleet.put_goals()
        return self._did(
            f"robot{robot}: goal sent ({pose.x_m:.2f}, {pose.y_m:.2f})", "send_goal", robot, pose
        )

    def cancel(self, robot: int) -> Answer:
        return self._did(f"robot{robot}: goal cancelled; hovering", "cancel", robot)

    def stop_all(self) -> Answer:
        return self._did("all goals cancelled; every robot hovers", "stop_all")

    def clear_costmaps(self, robot: int) -> Answer:
        return self._did(f"robot{robot}: costmaps cleared", "clear_costmaps", robot)

    def enable_lidar(self, robot: int, is_on: bool) -> Answer:
        self.fleet.lidars[robot] = is_on
        if not is_on:
            self.fleet.state.remove(f"scan/{robot}")
        return self._did(
            f"robot{robot}: LIDAR {'on' if is_on else 'off'}", "enable_lidar", robot, is_on
        )

    def parameters(self, robot: int) -> List[ParameterView]:
        views = [
            ParameterView(
                "",
                "planner_frequency",
                "double",
                0.0,
                0.0,
                0.0,
                100.0,
                (),
                "Rate of global planning, Hz",
            ),
            ParameterView(
                "", "recovery_behavior_enabled", "bool", True, True, doc="Run recovery behaviours"
            ),
            ParameterView(
                "DWAPlannerROS",
                "max_vel_x",
                "double",
                0.55,
                0.55,
                0.0,
                5.0,
                (),
                "Highest speed ahead, m/s",
            ),
            ParameterView(
                "DWAPlannerROS", "vx_samples", "int", 10, 10, 1, 100, (), "Number of sampled speeds"
            ),
            ParameterView(
                "local_costmap/obstacle_layer",
                "combination_method",
                "int",
                1,
                1,
                0,
                2,
                (("Overwrite", 0), ("Maximum", 1), ("Nothing", 99)),
                "How the layer joins the others",
            ),
            ParameterView(
                "global_planner",
                "base_global_planner",
                "str",
                "navfn/NavfnROS",
                "navfn/NavfnROS",
                doc="Name of the planner",
            ),
        ]
        return [
            ParameterView(
                **{**vars(v), "value": self.values.get((robot, v.namespace, v.name), v.value)}
            )
            for v in views
        ]

    def set_parameters(self, robot: int, namespace: str, values: Any) -> Answer:
        for name, value in values.items():
            self.values[robot, namespace, name] = value
        return self._did(
            f"robot{robot}: {namespace} {dict(values)}",
            "set_parameters",
            robot,
            namespace,
            dict(values),
        )

    def goal_files(self) -> List[GoalFileView]:
        goals = [(1.0, 2.0, None), (4.0, 3.0, 1.5), (6.0, 6.0, 0.0)]
        return [
            GoalFileView(
                i,
                f"/tmp/goals{i}.json",
                f"v{len(self.saved.get(i, ()))}",
                [(c.x_m, c.y_m, c.yaw_rad) for c in self.saved[i]] if i in self.saved else goals,
            )
            for i in range(self.fleet.n)
        ]

    def check_goals(self, robot: int, version: str, goals: Any) -> List[str]:
        width_m, height_m = self.fleet.size_m
        return [
            "" if 0 < g.x_m < width_m and 0 < g.y_m < height_m else "outside of the arena"
            for g in goals
        ]

    def save_goals(self, robot: int, version: str, goals: Any) -> Answer:
        if any(self.check_goals(robot, version, goals)):
            return self._did(
                f"goals{robot}.json: not saved: a goal is outside of the arena",
                "save_goals",
                robot,
                ok=False,
            )
        self.saved[robot] = list(goals)
        return self._did(
            f"goals{robot}.json: {len(goals)} goals saved", "save_goals", robot, list(goals)
        )
