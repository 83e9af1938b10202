"""Put what clients want to see of a flight of ROS nodes into the state of their pages."""

from __future__ import annotations

import math
import threading
import time
from typing import Any, Dict, FrozenSet, List, Mapping, Optional, Sequence, Set, Tuple

import numpy as np
import rospy
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D
from quad_nav.scenario.rules import START_S
from quad_nav.sim.simulation_params import FASTEST_RATE
from quad_nav.topics.robot_topics import goal_distance_m
from quad_web.ros.frames import Frames
from quad_web.ros.health import LOST_AFTER_S, FleetHealth
from quad_web.ros.intake import Subscriptions
from quad_web.ros.layers import Layers
from quad_web.ros.localizations import Localizations
from quad_web.ros.obstacles import Obstacles
from quad_web.ros.parameters import NavigatorTrees
from quad_web.ros.poses import Bodies
from quad_web.ros.reports import FlightReports
from quad_web.view import rows
from quad_web.view.cells import cell_items
from quad_web.view.items import Trails, poses_item, robots_item, scene_item
from quad_web.view.localization import LOST
from quad_web.view.state import FleetState, Item, Wanted, robots_by_layer

PERIOD_S = 0.05  # wall time, as the others; the stream sends half as often
RESTING_S = 0.2  # without clients
_LAYERS_EVERY, _ROWS_EVERY, _TOPICS_EVERY, _HEALTH_EVERY = 2, 5, 10, 20  # periods
_OUTDATED_S = 1.5  # after an action the diagnostics may still be those from before it
_EXPECTED_S = 5.0  # longest time until they tell of a pause, a stop or a start
_SETTLES_S = 2.0  # time until a navigator tells of a goal that was sent
_JUMP_S = 0.5

Floats = NDArray[np.float64]
Shown = Mapping[str, FrozenSet[int]]


class FlightSource:
    """Shows a flight of ROS nodes.

    Attributes:
        bodies: Poses of the robots.
        health: States of the nodes.
        reports: What the nodes say.
        trees: Parameters of the navigators.
    """

    def __init__(self, state: FleetState, robots: int, title: str) -> None:
        """Subscribe to what is rare, and to the rest when there are clients."""
        self._state, self._title = state, title
        self._names = [f"quad{i}" for i in range(robots)]
        self._frames = Frames(robots)
        self.bodies = Bodies(robots, self._frames)
        self.health = FleetHealth(robots)
        self.reports = FlightReports(robots, state)
        self.trees = NavigatorTrees(self.reports.trees)
        self._layers = Layers(self.bodies, self._frames, self.trees.tree)
        self._obstacles = Obstacles()
        self._localizations = Localizations(robots, self.health)
        self._subscriptions = Subscriptions()
        self._trails = Trails()
        self._seen: Dict[str, Any] = {}  # data of items that seldom change, by key
        self._passing: FrozenSet[str] = frozenset()  # keys of items that disappear
        self._sent: Dict[int, Tuple[float, Pose2D]] = {}  # goals that people have sent
        self._expected: Dict[str, Tuple[float, bool]] = {}  # since when, whether it is so
        self._wanted: Sequence[Wanted] = ()
        self._count, self._resets, self._stamp_s, self._version = 0, 0, 0.0, -1

    def start(self) -> None:
        """Show the flight, in a thread."""
        threading.Thread(target=self._run, name="source", daemon=True).start()

    def expect(self, **states: bool) -> None:
        """Show that the flight is ``paused`` or ``stopped``, or not, before the nodes tell so."""
        now_s = time.monotonic()
        self._expected.update({name: (now_s, is_so) for name, is_so in states.items()})

    def _is(self, name: str, told: bool) -> bool:
        """Return whether the flight is in a state; ``told`` is what the nodes say."""
        since_s, is_so = self._expected.get(name, (-math.inf, told))
        patience_s = _OUTDATED_S if told is is_so else _EXPECTED_S
        if time.monotonic() - since_s > patience_s:
            self._expected.pop(name, None)
            return told
        return is_so

    def show_goal(self, robot: int, goal: Optional[Pose2D]) -> None:
        """Show a goal that a person has sent; None removes it."""
        if goal is None:
            self._sent.pop(robot, None)
        else:
            self._sent[robot] = time.monotonic() + _SETTLES_S, goal

    def _run(self) -> None:
        while not rospy.is_shutdown():
            start_s = time.monotonic()
            wanted = self._state.wanted()
            try:
                self._step(wanted)
            except Exception:  # the pages show what still works
                if not rospy.core.is_shutdown_requested():
                    rospy.logerr_throttle(10.0, "web: internal error", exc_info=True)
            period_s = PERIOD_S if wanted else RESTING_S
            time.sleep(max(0.0, period_s - (time.monotonic() - start_s)))

    def _step(self, wanted: Sequence[Wanted]) -> None:
        if bool(wanted) != bool(self._wanted):
            self._begin() if wanted else self._rest()
        shown = robots_by_layer(wanted, range(len(self._names)))
        if wanted != self._wanted or self._count % _TOPICS_EVERY == 0:
            self._subscribe(wanted, shown)
        self._wanted = wanted
        if wanted:
            self._show(shown)
        self._count += 1

    def _begin(self) -> None:
        self._count = 0
        self.bodies.start()
        self.health.start()
        self._obstacles.start()
        self._trails.clear()

    def _rest(self) -> None:
        """Remove what would be old when another client comes."""
        gone = {f"trail/{i}" for i in range(len(self._names))} | self._passing
        gone |= {"poses", "obstacles", "status", "yields", "samples", "diagnostics"}
        self._state.put_all([], tuple(gone))
        self._passing = frozenset()
        self._seen.pop("yields", None)

    def _subscribe(self, wanted: Sequence[Wanted], shown: Shown) -> None:
        topics = self.reports.topics(bool(wanted))
        if wanted:
            topics.update(self.bodies.topics())
            topics.update(self.health.topics())
            topics.update(self._layers.topics(shown))
            topics.update(self._obstacles.topics(self.reports.scene))
            topics.update(self._localizations.topics(shown["localization"]))
        self._subscriptions.want(topics)

    # -- items ---------------------------------------------------------------------------

    def _show(self, shown: Shown) -> None:
        items: List[Item] = []
        removed: Set[str] = set()
        if self.bodies.refresh():
            removed |= self._track()
            bodies = self.bodies
            items.append(poses_item(bodies.stamp_s, bodies.wall_s, bodies.rows))
        if self._count % _LAYERS_EVERY == 0:
            items += self._layers.items() + self._trails.items(sorted(shown["trail"]))
            items += self._cells(sorted(shown["cell"]))
            items += self._obstacles.items(self.reports.scene)
            items += self._localizations.items(shown["localization"])
            removed |= self._gone(shown)
        if self._count % _ROWS_EVERY == 0:
            items += self._tables()
        if self._count % _HEALTH_EVERY == _HEALTH_EVERY // 2:
            items.append(self.health.item())
        if self.reports.result is None:
            removed.add("result")
            self._seen.pop("result", None)
        items = [item for item in items if item.key not in removed]
        if items or removed:
            self._state.put_all(items, tuple(removed))

    def _track(self) -> Set[str]:
        """Add the poses to the trails; return the keys of those that begin anew."""
        bodies, removed = self.bodies, set()
        if bodies.stamp_s < self._stamp_s - _JUMP_S or self.reports.resets != self._resets:
            self._trails.clear()
            removed = {f"trail/{i}" for i in range(len(self._names))}
        self._stamp_s, self._resets = bodies.stamp_s, self.reports.resets
        for robot, (x_m, y_m) in enumerate(bodies.positions.tolist()):
            self._trails.add(robot, x_m, y_m)
        return removed

    def _cells(self, robots: Sequence[int]) -> List[Item]:
        scene = self.reports.scene
        if scene is None:
            return []
        radii_m = {i: self.trees.safety_radius_m(i) for i in robots}
        return cell_items(scene, self.bodies.positions, radii_m)

    def _gone(self, shown: Shown) -> Set[str]:
        """Return the keys of layers that no page shows, or that a robot no longer has."""
        keys = set(self._layers.keys) | {f"cell/{i}" for i in shown["cell"]}
        keys |= self._localizations.keys
        for i in range(len(self._names)):
            if not self.health.has_lidar(i):
                keys.discard(f"scan/{i}")
            state, silent_s, _ = self.health.navigator(i)
            if state == "idle":
                keys -= {f"plan/{i}", f"local_plan/{i}"}
            if silent_s > LOST_AFTER_S:
                keys.discard(f"track/{i}")
        before, self._passing = self._passing, frozenset(keys)
        return {key for key in before | self._layers.keys if key not in keys}

    def _tables(self) -> List[Item]:
        reports = self.reports
        samples = rows.sample_items(
            self.bodies.samples(), reports.radius_m, self._distances_m, self.health.cycles_s()
        )
        goals = self._goal_rows()
        active = {row["robot"]: row for row in goals if row["state"] == "active"}
        now = {i: self._robot_now(i, active.get(i)) for i in range(len(self._names))}
        status, yields = rows.fleet_items(now, self._names, samples[-1])
        seldom = [
            yields,
            rows.goals_item(goals),
            rows.contacts_item(reports.contacts, self._names),
        ]
        if self._version != reports.version:
            self._version = reports.version
            seldom.append(robots_item(self._names, reports.radius_m))
            seldom += [scene_item(reports.scene)] if reports.scene is not None else []
        if reports.result is not None:
            seldom.append(reports.result)
        changed = [item for item in seldom if self._seen.get(item.key) != item.data]
        self._seen.update({item.key: item.data for item in changed})
        return [self._flight_item(), status, *samples, *changed]

    def _distances_m(self, positions: Floats, times_s: Floats) -> Floats:
        scene = self.reports.scene
        if scene is None:
            return np.full(len(positions), np.nan)
        return self._obstacles.distances_m(scene, positions, times_s)

    def _goal_rows(self) -> List[Dict[str, Any]]:
        """Return the goals of the mission, and after them those that people have sent."""
        goals = self.reports.goal_rows()
        for robot, (settled_s, pose) in list(self._sent.items()):
            has_settled = time.monotonic() > settled_s
            is_over = has_settled and self.health.navigator(robot)[0] == "idle"
            if is_over or self.reports.sent_s.get(robot, 0.0) > settled_s - _SETTLES_S:
                self.show_goal(robot, None)
                continue
            index = sum(row["robot"] == robot for row in goals)
            place = {"x": pose.x_m, "y": pose.y_m, "yaw": pose.yaw_rad}
            goals.append({"robot": robot, "index": index, **place, "state": "active"})
        return goals

    def _robot_now(self, robot: int, goal: Optional[Mapping[str, Any]]) -> rows.RobotNow:
        """Return what is known of a robot; ``goal`` is the row of its active goal."""
        navigator, silent_s, reason = self.health.navigator(robot)
        pose_age_s = float(self.bodies.ages_s()[robot])
        progress = self.health.progress(robot)
        is_stopped, lost = bool(reason) or progress.is_stopped, ""
        located = self._localizations.located(robot)
        if silent_s > LOST_AFTER_S:
            lost = f"no message of its navigator for {silent_s:.0f} s"
        elif pose_age_s > LOST_AFTER_S and math.isfinite(pose_age_s):
            lost = f"no pose for {pose_age_s:.0f} s"
        if lost:
            self.reports.forget_navigator(robot)
        elif progress.is_stopped and not reason:
            reason = "stopped by a person; Resume continues its mission"
        if located is not None and located.is_lost:
            lost = lost or LOST
        right = self.reports.right_of_way(robot)
        return rows.RobotNow(
            navigator or "idle",
            right.decision,
            right.limited_by,
            is_done=progress.is_done,
            is_stopped=is_stopped,
            is_lost=bool(lost),
            goal=progress.goal,
            goals=progress.goals,
            said={"goal_distance": self._distance_m(robot, goal), **self.reports.columns(robot)},
            recoveries=self.reports.recoveries.get(robot, (0, self.trees.recoveries(robot))),
            age_s=silent_s if silent_s > LOST_AFTER_S else pose_age_s,
            lidar=self.health.has_lidar(robot),
            reason=lost or reason,
            localization=None if located is None else located.row(),
        )

    def _distance_m(self, robot: int, goal: Optional[Mapping[str, Any]]) -> float:
        """Return the distance to a goal; C++ move_base does not tell it."""
        if goal is None:
            return math.nan
        x_m, y_m = self.bodies.positions[robot].tolist()
        return goal_distance_m(Pose2D(goal["x"], goal["y"]), Pose2D(x_m, y_m))

    @property
    def is_stopped(self) -> bool:
        """True if a person has stopped a mission, here or elsewhere."""
        return self._is("stopped", self.health.is_stopped)

    @property
    def flight_state(self) -> str:
        """The state of the flight, as of ``rows.flight_item``."""
        if float(self.bodies.ages_s().min(initial=math.inf)) > LOST_AFTER_S:
            return "waiting"
        if self._is("stopped", self.health.are_all_stopped):
            return "stopped"
        if self._is("paused", self.health.is_paused):
            return "ready" if self.bodies.stamp_s <= START_S + _JUMP_S else "paused"
        return "running" if self.reports.result is None else "ended"

    def _flight_item(self) -> Item:
        rate, wanted_rate = self.health.rates
        state = self.flight_state
        if wanted_rate is not None and wanted_rate >= FASTEST_RATE:
            wanted_rate = 0.0
        return rows.flight_item(
            "ros",
            self._title,
            state,
            self.bodies.stamp_s,
            rate=0.0 if self._is("paused", self.health.is_paused) else rate,
            wanted_rate=wanted_rate,
            reason="no poses of any quadcopter" if state == "waiting" else "",
        )
