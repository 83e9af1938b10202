"""Recovery behaviours on two costmaps, and what they set in the local planner."""

from __future__ import annotations

from dataclasses import make_dataclass, replace
from pathlib import Path
from typing import Any, Dict, List, Tuple

import numpy as np
from upstream import UPSTREAM

from families.case import Case, InvalidValue, load_case
from families.comparison import Comparison, Difference
from families.player import Player
from quad_nav.config import load
from quad_nav.costmap.cost_grid import NO_CELLS, Window
from quad_nav.geometry import Pose2D
from quad_nav.navigator.parameter_limiter import ParameterLimiter
from quad_nav.recovery import MoveSlowAndClearParams, RecoveryContext
from quad_nav.scenario.assembly import build_recovery

_NAME = "recovery"  # of the behaviour's namespace
_COSTMAPS = ("global", "local")
_CLOCK_STEP_S = 0.05


def check(path: Path) -> List[Difference]:
    replay = Replay(load_case(path))
    replay.run()
    return replay.comparison.differences


class RecordedPlanner:
    """The recorded planner: what its server of dynamic_reconfigure was asked to set."""

    def __init__(self, values: Dict[str, float]):
        self.params = make_dataclass("Params", list(values), frozen=True)(**values)
        self.names = list(values)
        self.requests: List[Tuple[str, float]] = []

    def set_params(self, params: Any) -> None:
        """Take parameters; the original sets each by a call of its own."""
        self.params = params
        self.requests += [(name, getattr(params, name)) for name in self.names]


class Replay:
    """Two costmaps and a behaviour, driven by recorded events."""

    def __init__(self, case: Case):
        self.recorded, self.meta = case.arrays, case.meta
        self.comparison = Comparison()
        params = self.meta["params"]
        configuration = load(
            {
                "global_costmap": params["global_costmap"],
                "local_costmap": params["local_costmap"],
                "recovery_behaviors": [{"name": _NAME, "type": self.meta["recovery"]}],
                _NAME: params["recovery"],
                **UPSTREAM,
            }
        )
        self.players = {
            name: Player(case, self.comparison, configuration, f"{name}_costmap", f"{name}_")
            for name in _COSTMAPS
        }
        self.windows: Dict[str, Window] = {}
        for name, player in self.players.items():
            self._watch_updates(name, player)
        ((_, behaviour),) = configuration.recoveries
        self.planner = RecordedPlanner(self._speeds())
        if isinstance(behaviour, MoveSlowAndClearParams):
            behaviour = self._naming_speeds(behaviour)
        self.behaviour = build_recovery(behaviour)
        self.limiter = ParameterLimiter(self.planner)
        self.now_s = self.meta["start_time"]

    # -- set-up ----------------------------------------------------------------------------

    def _speed_names(self) -> Tuple[str, str, str]:
        """The planner's namespace and its two speeds, by the behaviour's parameters."""
        params = self.meta["params"]["recovery"]
        return (
            params.get("planner_namespace", "DWAPlannerROS"),
            params.get("max_trans_param_name", "max_trans_vel"),
            params.get("max_rot_param_name", "max_rot_vel"),
        )

    def _speeds(self) -> Dict[str, float]:
        """The two speeds that the recorded planner had on the parameter server."""
        planner, *names = self._speed_names()
        values = self.meta["planner_params"].get(planner, {})
        return {name: values[name] for name in names if name in values}

    def _naming_speeds(self, params: MoveSlowAndClearParams) -> MoveSlowAndClearParams:
        """The behaviour with the recorded planner's names; it is none of our planners."""
        _, translation, rotation = self._speed_names()
        known = self._speeds()
        return replace(
            params,
            named_translation_field=translation if translation in known else "",
            named_rotation_field=rotation if rotation in known else "",
        )

    def _watch_updates(self, name: str, player: Player) -> None:
        update = player.costmap.update

        def watched(now_s: float, robot: Pose2D) -> Window:
            self.windows[name] = update(now_s, robot)
            return self.windows[name]

        player.costmap.update = watched  # type: ignore[method-assign]

    # -- events ----------------------------------------------------------------------------

    def run(self) -> None:
        events = self.meta["events"]
        if not any(event["type"] == "recovery" for event in events):
            raise InvalidValue("there is no 'recovery' among the events")
        for name, player in self.players.items():
            player.take_first_maps([one for one in events if one.get("costmap", name) == name])
            player.check_parameters(self.meta["effective"][name])
        for event in events:
            if event["type"] == "recovery":
                self.recover(event)
            elif event["type"] == "advance":
                self.advance(event)
            else:
                self.play(event)
        if self.recorded.unread:
            raise InvalidValue(f"nothing compares {', '.join(self.recorded.unread)}")

    def play(self, event: Any) -> None:
        """Play an event of one costmap; a map or a transform is for both."""
        self.now_s = event.get("now", self.now_s)
        if event["type"] == "update" and event["costmap"] == "global":
            robot = self.recorded["global_robot_pose"][event["index"]]
            self.limiter.check(self.now_s, Pose2D(*robot.tolist()))
        names = [event["costmap"]] if "costmap" in event else _COSTMAPS
        for name in names:
            self.players[name].play(event)

    def recover(self, event: Any) -> None:
        k, self.now_s = event["index"], event["now"]
        poses = [
            Pose2D(*self.recorded[f"{name}_recovery_robot_pose"][k].tolist()) for name in _COSTMAPS
        ]
        costmaps = [self.players[name].costmap for name in _COSTMAPS]
        self.windows, self.planner.requests = {}, []
        context = RecoveryContext(self.now_s, costmaps[0], costmaps[1], poses[0], poses[1])
        self.behaviour.start(context)
        step = self.behaviour.step(context)
        if step.limit is not None:
            self.limiter.impose(step.limit, poses[0], self.now_s)
        self.check_requests(event)
        for name, player in self.players.items():
            window = self.windows.get(name, NO_CELLS)
            player.check_bounds("recovery_", k, [window.x0, window.xn, window.y0, window.yn])
            player.check_grids("recovery_", k)
            player.check_current("recovery_", k, self.now_s)

    def advance(self, event: Any) -> None:
        robot, self.planner.requests = Pose2D(*event["robot"]), []
        steps = int(np.ceil((event["to"] - self.now_s) / _CLOCK_STEP_S - 1e-9))
        for k in range(1, steps + 1):
            self.limiter.check(min(self.now_s + k * _CLOCK_STEP_S, event["to"]), robot)
        self.now_s = event["to"]
        self.check_requests(event)

    def check_requests(self, event: Any) -> None:
        found = [[name, value] for name, value in self.planner.requests]
        self.comparison.exact(
            f"requests of {event['type']} {event['index']}",
            [" ".join(map(str, one)) for one in found],
            [" ".join(map(str, one)) for one in event["requests"]],
        )
