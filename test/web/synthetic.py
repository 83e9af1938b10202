"""A made-up fleet, for tests and work on the page: all that a page can show, and recorded actions.

Robots fly on circles around pillars::

    python3 test/web/synthetic.py --robots 20 --port 8090
"""

from __future__ import annotations

import argparse
import contextlib
import math
import signal
import sys
import threading
import time
from typing import Any, Dict, List

import numpy as np
from synthetic_actions import SyntheticActions, say

from quad_nav.geometry import Pose2D, Pose3D, Twist2D, quaternion_from_euler
from quad_nav.grid import GridSpec
from quad_nav.mission.flight_log import Leg
from quad_nav.mission.goal import Goal
from quad_nav.mission.summary import MissionSummary, RobotSummary, to_json
from quad_nav.peers.right_of_way import Yield, YieldDecision
from quad_nav.sim.contacts import Contact
from quad_nav.sim.motion import Motion, Walkers
from quad_nav.sim.obstacles import Box, Cylinder, Sphere
from quad_nav.sim.scene import MovingObstacle, Scene, Walls
from quad_web.server import Server, WebOptions
from quad_web.view import items as views
from quad_web.view import rows
from quad_web.view.cells import cell_items
from quad_web.view.result import result_item
from quad_web.view.state import FleetState, Item, robots_by_layer

PERIOD_S = 0.1
SPEED_MPS, CIRCLE_M, SPACING_M = 0.5, 1.5, 5.0
_TABLES_EVERY = 5  # periods
_DOING = (
    rows.RobotNow("controlling"),
    rows.RobotNow("controlling", YieldDecision("robot0", Yield.WAIT)),
    rows.RobotNow("controlling", YieldDecision("robot0", Yield.MAKE_ROOM, Pose2D(1.0, 2.0))),
    rows.RobotNow("clearing", limited_by="robot1"),
    rows.RobotNow("planning", is_stopped=True, reason="no scan for 3 s"),
)


class SyntheticFleet:
    """Robots on circles, put into a state with the times of a virtual clock."""

    def __init__(self, robots: int, has_obstacles: bool = False, duration_s: Any = None) -> None:
        self.state, self.duration_s = FleetState(), duration_s
        self.robots, self._has_obstacles = range(robots), has_obstacles
        side = max(2, math.ceil(math.sqrt(robots)))
        k = np.arange(robots)
        self._centres = np.column_stack((k % side, k // side)) * SPACING_M + 3.5
        self.size_m = tuple(np.maximum(self._centres.max(axis=0) + 3.5, 12.0).tolist())
        self._names = [f"robot{i}" for i in self.robots]
        self.scene = self._scene()
        self._lock, self._ended = threading.Lock(), threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self.renew()

    def _scene(self) -> Scene:
        width_m, depth_m = self.size_m
        places = enumerate(self._centres.tolist())
        solids = (
            *(Cylinder(f"pillar{i}", x_m, y_m, 0.35, 1.6) for i, (x_m, y_m) in places),
            Box("table", 1.2, 1.0, 1.2, 0.8, 0.5),
            Box("beam", width_m - 2.0, 1.0, 2.0, 0.2, 0.2, bottom_m=1.8, yaw_rad=0.5),
            Sphere("ball", 1.0, depth_m - 1.0, 1.0, 0.3),
        )
        stands = Motion((0.0,), ((0.0, 0.0, 0.0),))
        cart = MovingObstacle(Box("cart", 0.0, 0.0, 0.9, 0.5, 1.2), stands)
        moving = {"moving": (cart,), "walkers": Walkers(1)} if self._has_obstacles else {}
        return Scene("hall", width_m, depth_m, 1.0, Walls(2.0, 0.1), solids, (), **moving)

    def renew(self) -> None:
        """Begin another flight."""
        with self._lock:
            self.time_s, self.rate, self.flight_state, self._steps = 0.0, 1.0, "running", 0
            self.sent: Dict[int, Pose2D] = {}
            self.lidars = [True] * len(self.robots)
            self._contacts: List[Contact] = []
            self._trails = views.Trails()
            statuses = [
                {
                    "name": f"move_base{i}",
                    "level": "WARN" if i == 1 else "OK",
                    "message": "control loop missed 3 cycles" if i == 1 else "in time",
                    "hardware": "",
                    "values": {"cycle_s": "0.012"},
                    "age_s": 0.9,
                }
                for i in self.robots
            ]
            self.state.clear()
            self.state.put_all(
                [
                    views.scene_item(self.scene),
                    views.robots_item(self._names, 0.3),
                    Item("diagnostics", {"statuses": statuses}),
                ]
            )
            self.put_goals()
            self.state.add_event(0.0, "mission started")
            self._step(0.0)

    def start(self) -> None:
        self._thread.start()

    def end(self) -> None:
        """End the flight: robot 0 has reached its goal in 70 s of 5 s."""
        legs = [Leg(0, 1, Goal(1.0, 2.0), True, "", 1, 70.0)]
        robot = RobotSummary("robot0", tuple(legs), 9.0, 0.41, 1.54)
        summary = MissionSummary((robot,), sim_time_s=70.0, wall_time_s=5.0)
        self.flight_state = "ended"
        self.state.put_all([result_item(to_json(summary), "quad report")])

    def stop(self) -> None:
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(PERIOD_S):
            with self._lock:
                self._step(PERIOD_S * self.rate if self.flight_state == "running" else 0.0)

    def put_goals(self) -> None:
        """Show three goals of each robot; one that was sent is the active one."""
        shown = []
        for i, (x_m, y_m) in enumerate(self._centres.tolist()):
            turns = (i, 2.0 + i, 4.0 + i)
            goals = [Goal(x_m + 2.0 * math.cos(t), y_m + 2.0 * math.sin(t), t) for t in turns]
            if i in self.sent:
                goals[1] = Goal(self.sent[i].x_m, self.sent[i].y_m, self.sent[i].yaw_rad)
            shown += rows.goal_rows(i, goals, 1, True)
        self.state.put_all([rows.goals_item(shown)])

    def _arc(self, robot: int, first: float, last: float) -> Any:
        """Return points of a robot's circle, float64[40, 2], between angles from the robot on."""
        here = self.time_s * SPEED_MPS / CIRCLE_M + 0.7 * robot
        t = np.linspace(here + first, here + last, 40)
        return self._centres[robot] + CIRCLE_M * np.column_stack((np.cos(t), np.sin(t)))

    def positions(self) -> Any:
        """Return float64[n, 2]."""
        return np.array([self._arc(i, 0.0, 0.0)[0] for i in self.robots])

    def _step(self, seconds: float) -> None:
        self.time_s += seconds
        positions = self.positions()
        bodies = []
        for (x_m, y_m), (dx_m, dy_m) in zip(positions, positions - self._centres):
            yaw_rad = math.atan2(dy_m, dx_m) + math.pi / 2
            pose = Pose3D(x_m, y_m, 1.0, quaternion_from_euler(0.05, 0.08, yaw_rad))
            bodies.append(views.body_row(pose, Twist2D(SPEED_MPS, 0.0, SPEED_MPS / CIRCLE_M)))
        poses = views.poses_item(self.time_s, time.time(), bodies)
        shown = robots_by_layer(self.state.wanted(), self.robots)
        items = [self._flight_item(), poses]
        for i in self.robots:
            self._trails.add(i, *positions[i].tolist())
        items += self._trails.items(sorted(shown["trail"]))
        for layer, last in (("plan", 2.5), ("local_plan", 0.8)):
            items += [views.line_item(layer, i, self._arc(i, 0.0, last)) for i in shown[layer]]
        items += [self._scan_item(i) for i in shown["scan"] if self.lidars[i]]
        items += cell_items(self.scene, positions, dict.fromkeys(shown["cell"], 0.4))
        if self._has_obstacles:
            items += self._obstacle_items(shown["track"])
        if self._steps % _TABLES_EVERY == 0:
            items += self._tables(poses)
            for i in shown["global_costmap"]:
                items.append(self._costmap_item("global_costmap", i, (0.0, 0.0), 0.1))
            for i in shown["local_costmap"]:
                items.append(self._costmap_item("local_costmap", i, positions[i] - 1.5, 0.05))
        if self._steps % 100 == 99:
            self._contacts.append(Contact(self.time_s, "robot0", "table", 1.5, 1.3))
            items.append(rows.contacts_item(self._contacts, self._names))
        self.state.put_all(items)
        self._steps += 1

    def _flight_item(self) -> Item:
        return rows.flight_item(
            "replay" if self.duration_s else "offline",
            f"synthetic, {len(self.robots)} robots",
            self.flight_state,
            self.time_s,
            rate=self.rate,
            wanted_rate=self.rate,
            duration_s=self.duration_s,
        )

    def _tables(self, poses: Item) -> List[Item]:
        now = {}
        for i in self.robots:
            doing = vars(_DOING[i if i < len(_DOING) else 0])
            said = {"goal_distance": 1.23 + i}
            facts = {"goal": 2, "goals": 3, "said": said, "recoveries": (i % 3, 4)}
            now[i] = rows.RobotNow(**{**doing, **facts, "lidar": self.lidars[i]})
        cycles_s = 0.012 + 0.004 * np.sin(self.time_s / 3 + np.arange(len(self.robots)))
        cycles_s = None if self.duration_s else cycles_s  # recordings have none
        pose = poses.arrays["pose"]
        samples = rows.samples_item(self.time_s, pose, 0.3, self.scene, (), cycles_s)
        return [samples, *rows.fleet_items(now, self._names, samples)]

    def _scan_item(self, robot: int) -> Item:
        t = np.linspace(-math.pi, math.pi, 120)
        ring = self._centres[robot] + 0.35 * np.column_stack((np.cos(t), np.sin(t)))
        points = np.column_stack((ring, np.full(120, 1.08))).astype(np.float32)
        return Item(f"scan/{robot}", {"stamp_s": self.time_s}, {"points": points})

    def _costmap_item(self, layer: str, robot: int, corner: Any, cell_m: float) -> Item:
        columns = round((self.size_m[0] if layer == "global_costmap" else 3.0) / cell_m)
        spec = GridSpec(columns, columns, cell_m, *map(float, corner))
        x_m, y_m = [low + (np.arange(columns) + 0.5) * cell_m for low in corner]
        centre_x_m, centre_y_m = self._centres[robot]
        offsets_m = np.hypot(x_m[None] - centre_x_m, y_m[:, None] - centre_y_m)
        near_m = np.maximum(offsets_m - 0.65, 0.0)
        costs = np.where(near_m > 0.0, 98 * np.exp(-4 * near_m), 99)
        costs[offsets_m < 0.35] = 100
        costs[:2] = -1  # unknown
        return views.costmap_item(layer, robot, spec, costs.astype(np.int8))

    def _obstacle_items(self, tracking: Any) -> List[Item]:
        """Return a cart (to and fro at 0.5 m/s), a person (on a circle), and tracks of both.

        The person is hidden and tracked 0.1 m to the east; there is a suspect at (6, 1).
        """
        way_m = self.size_m[0] - 2.0
        at_m = 0.5 * self.time_s % (2.0 * way_m)
        is_back = at_m > way_m
        cart_x_m = 1.0 + (2.0 * way_m - at_m if is_back else at_m)
        angle = self.time_s / 2.0
        x_m, y_m = (side_m / 2 for side_m in self.size_m)
        walks_rad = (angle + math.pi / 2) % (2 * math.pi)
        places = [
            (cart_x_m, self.size_m[1] - 0.5, math.pi * is_back),
            (x_m + math.cos(angle), y_m + math.sin(angle), walks_rad),
        ]
        found = []
        for (x_m, y_m, yaw_rad), radius_m, kind in zip(places, (0.5, 0.3), (0, 1)):
            velocity = 0.5 * math.cos(yaw_rad), 0.5 * math.sin(yaw_rad)
            found.append((x_m + 0.1 * kind, y_m, *velocity, radius_m, kind))
        found.append((6.0, 1.0, 0.0, 0.0, 0.4, 2))
        obstacles = Item("obstacles", None, {"poses": np.array(places, np.float32)})
        return [obstacles, *(views.track_item(i, found) for i in tracking)]


def obey_input(fleet: SyntheticFleet, actions: SyntheticActions) -> None:
    """Begin another flight at a line "again", end it at a line "end", and print each line."""
    for line in map(str.strip, sys.stdin):
        if line == "again":
            actions.renew()
        elif line == "end":
            fleet.end()
        say(line)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", type=int, default=20)
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--address", default="127.0.0.1")
    parser.add_argument("--steer-token", default="")
    parser.add_argument("--watch-token", default="")
    parser.add_argument("--replay", type=float, help="be a recording of so many seconds")
    parser.add_argument("--obstacles", action="store_true", help="have two that move")
    args = vars(parser.parse_args())
    fleet = SyntheticFleet(args.pop("robots"), args.pop("obstacles"), args.pop("replay"))
    actions = SyntheticActions(fleet)
    fleet.start()
    threading.Thread(target=obey_input, args=[fleet, actions], daemon=True).start()
    server = Server(fleet.state, actions, WebOptions(on_ready=say, **args))
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job ignores it
    with contextlib.suppress(KeyboardInterrupt):
        server.start()
        server.wait()
    server.stop()


if __name__ == "__main__":
    main()
