"""A made-up fleet, for tests, benches and work on the page.

Robots fly on circles around the obstacles of a round of pillars. Everything that a page can show
is there. Actions are recorded, and those that a page needs an answer of change what is shown::

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
from typing import Any, Dict, List, Optional

import numpy as np

from quad_nav.view.actions import Actions, Answer, GoalChange, GoalFileView, ParameterView
from quad_nav.view.state import FleetState, Item

PERIOD_S = 0.1
SPEED_MPS = 0.5
_COSTS_EVERY = 5  # periods
_STATES = ("flying", "flying", "flying", "hovering", "waiting", "making room", "recovering", "done")


class SyntheticFleet:
    """Robots on circles, put into a state with the times of a virtual clock."""

    def __init__(
        self, n_robots: int, state: Optional[FleetState] = None, obstacles: bool = False
    ) -> None:
        self.state = state or FleetState()
        self.has_obstacles = obstacles
        self.n = n_robots
        self.duration_s: Optional[float] = None  # of a recording
        side = math.ceil(math.sqrt(n_robots))
        self.spacing_m = 5.0
        self.size_m = (
            max(2, side) * self.spacing_m + 2.0,
            max(2, math.ceil(n_robots / side)) * 5.0 + 2.0,
        )
        k = np.arange(n_robots)
        self.centres = np.column_stack((k % side, k // side)) * 5.0 + 3.5
        self._set_start()
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def _set_start(self) -> None:
        self.time_s = 0.0
        self.rate = 1.0
        self.flight_state = "running"
        self.goals_sent: Dict[int, Any] = {}
        self.lidars = [True] * self.n
        self.contacts: List[Dict[str, Any]] = []
        self._steps = 0
        self._global: Optional[Item] = None  # the same for all robots and times
        self.cpu_s = 0.0  # that the source's thread has used

    def renew(self) -> None:
        """Begin another flight."""
        with self._lock:
            self._set_start()
            self.state.clear()
            self.put_static()
            self.step(0.0)

    def start(self) -> None:
        self.put_static()
        self.step(0.0)
        self._thread.start()

    def stop(self) -> None:
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        while True:
            if self._ended.wait(PERIOD_S):
                return
            with self._lock:
                self.step(PERIOD_S * self.rate if self.flight_state == "running" else 0.0)
            self.cpu_s = time.thread_time()

    # -- what does not change --------------------------------------------------------

    def put_static(self) -> None:
        colours = ["#2078dc", "#e66e14", "#28a03c", "#c832a0", "#00aaaa", "#d22832", "#968c00"]
        self.state.put_all(
            [
                Item("scene", self.scene()),
                Item(
                    "robots",
                    {
                        "names": [f"robot{i}" for i in range(self.n)],
                        "colours": [colours[i % len(colours)] for i in range(self.n)],
                        "radius_m": 0.3,
                        "footprint": None,
                    },
                ),
                Item("diagnostics", {"statuses": self.statuses()}),
            ]
        )
        self.put_goals()
        self.state.add_event(0.0, "mission started")

    def statuses(self) -> List[Dict[str, Any]]:
        """Return diagnostics: one warning, and the rest is well."""
        simulator = {"real_time_factor": "1.00", "rate": "1", "contacts": "0"}
        return [
            {
                "name": "simulator",
                "level": "OK",
                "message": "keeps its rate",
                "hardware": "pybullet",
                "values": simulator,
                "age_s": 0.4,
            },
            *(
                {
                    "name": f"move_base{i}",
                    "level": "WARN" if i == 1 else "OK",
                    "message": "control loop missed 3 cycles" if i == 1 else "in time",
                    "hardware": "",
                    "values": {"cycle_s": "0.012", "missed": "3" if i == 1 else "0"},
                    "age_s": 0.9,
                }
                for i in range(self.n)
            ),
        ]

    def scene(self) -> Dict[str, Any]:
        x_m, y_m = self.size_m

        def box(
            name: str,
            x: float,
            y: float,
            sx: float,
            sy: float,
            height: float,
            bottom: float = 0.0,
            yaw: float = 0.0,
        ) -> Dict[str, Any]:
            return {
                "kind": "box",
                "x": x,
                "y": y,
                "bottom": bottom,
                "height": height,
                "size": [sx, sy],
                "yaw": yaw,
                "name": name,
                "crosses": bottom <= 1.0 <= bottom + height,
            }

        pillars = [
            {
                "kind": "cylinder",
                "x": float(x),
                "y": float(y),
                "bottom": 0.0,
                "height": 1.6,
                "radius": 0.35,
                "yaw": 0.0,
                "name": f"pillar{i}",
                "crosses": True,
            }
            for i, (x, y) in enumerate(self.centres)
        ]
        return {
            "size_m": [x_m, y_m],
            "origin_m": [0.0, 0.0],
            "altitude_m": 1.0,
            "walls": [
                box("wall_west", -0.05, y_m / 2, 0.1, y_m, 2.0),
                box("wall_east", x_m + 0.05, y_m / 2, 0.1, y_m, 2.0),
                box("wall_south", x_m / 2, -0.05, x_m + 0.2, 0.1, 2.0),
                box("wall_north", x_m / 2, y_m + 0.05, x_m + 0.2, 0.1, 2.0),
            ],
            "moving": self.moving() if self.has_obstacles else [],
            "solids": [
                *pillars,
                box("table", 1.2, 1.0, 1.2, 0.8, 0.5),
                box("beam", x_m - 2.0, 1.0, 2.0, 0.2, 0.2, bottom=1.8, yaw=0.5),
                {
                    "kind": "sphere",
                    "x": 1.0,
                    "y": y_m - 1.0,
                    "bottom": 0.7,
                    "height": 0.6,
                    "radius": 0.3,
                    "yaw": 0.0,
                    "name": "ball",
                    "crosses": True,
                },
            ],
        }

    # -- what moves ------------------------------------------------------------------

    def moving(self) -> List[Dict[str, Any]]:
        """Return a cart and a person, wherever they are."""
        standing = {"x": 0.0, "y": 0.0, "bottom": 0.0, "yaw": 0.0, "crosses": True}
        return [
            {**standing, "kind": "box", "name": "cart", "size": [0.9, 0.5], "height": 1.2},
            {
                **standing,
                "kind": "cylinder",
                "name": "person_0",
                "radius": 0.25,
                "height": 1.75,
                "person": True,
            },
        ]

    def obstacles(self) -> Item:
        """Return where the cart (to and fro at 0.5 m/s) and the person (on a circle) are."""
        x_m, y_m = self.size_m
        way_m = x_m - 2.0
        at_m = 0.5 * self.time_s % (2.0 * way_m)
        is_back = at_m > way_m
        cart = (1.0 + (2.0 * way_m - at_m if is_back else at_m), y_m - 0.5, math.pi * is_back)
        angle = self.time_s / 2.0
        person = (
            x_m / 2 + math.cos(angle),
            y_m / 2 + math.sin(angle),
            (angle + math.pi / 2) % (2 * math.pi),
        )
        return Item("obstacles", None, {"poses": np.array([cart, person], np.float32)})

    def angles(self) -> Any:
        """Return each robot's place on its circle of 1.5 m, radians."""
        return self.time_s * SPEED_MPS / 1.5 + np.arange(self.n) * 0.7

    def poses(self) -> Any:
        """Return float32[n, 9] as in the item ``poses``."""
        a = self.angles()
        x, y = (self.centres + 1.5 * np.column_stack((np.cos(a), np.sin(a)))).T
        yaw = a + math.pi / 2
        zero = np.zeros(self.n)
        pose = np.column_stack(
            (
                x,
                y,
                zero + 1.0,
                zero + 0.05,
                zero + 0.08,
                yaw,
                SPEED_MPS * np.cos(yaw),
                SPEED_MPS * np.sin(yaw),
                zero + SPEED_MPS / 1.5,
            )
        )
        return pose.astype(np.float32)

    def step(self, seconds: float) -> None:
        self.time_s += seconds
        pose = self.poses()
        items = [
            Item("flight", self.flight()),
            Item("poses", {"stamp_s": self.time_s, "wall_s": time.time()}, {"pose": pose}),
            Item("samples", {"time_s": self.time_s}, {"values": self.samples()}),
        ]
        for i in range(self.n):
            items += self.lines(i, pose[i])
            if self._steps % _COSTS_EVERY == 0:
                items += self.costmaps(i, pose[i])
        if self._steps % _COSTS_EVERY == 0:
            items += [
                Item("status", {"rows": self.rows()}),
                Item("yields", {"yields": self.yields(pose)}),
            ]
        if self.has_obstacles:
            items.append(self.obstacles())
        if self._steps % 100 == 99:
            self.touch(pose)
        self.state.put_all(items)
        self._steps += 1

    def flight(self) -> Dict[str, Any]:
        return {
            "source": "replay" if self.duration_s else "offline",
            "title": f"synthetic, {self.n} robots",
            "state": self.flight_state,
            "time_s": self.time_s,
            "rate": self.rate,
            "wanted_rate": self.rate,
            "duration_s": self.duration_s,
            "reason": "",
        }

    def samples(self) -> Any:
        k = np.arange(self.n)
        wave = np.sin(self.time_s / 3 + k)
        return np.column_stack(
            (1.5 + wave, 0.8 + 0.3 * wave, 0.5 + 0.1 * wave, 0.012 + 0.004 * wave)
        ).astype(np.float32)

    def lines(self, i: int, pose: Any) -> List[Item]:
        """Return trail, plans, scan and cell of a robot that somebody wants to see."""
        a = float(self.angles()[i])
        c = self.centres[i]

        def arc(first: float, last: float, n: int) -> Any:
            t = np.linspace(a + first, a + last, n)
            return (c + 1.5 * np.column_stack((np.cos(t), np.sin(t)))).astype(np.float32)

        items = []
        for layer, points in (
            ("trail", arc(-min(self.time_s / 3, 5.0), 0.0, 60)),
            ("plan", arc(0.0, 2.5, 50)),
            ("local_plan", arc(0.0, 0.8, 12)),
        ):
            if self.state.is_wanted(layer, i):
                items.append(Item(f"{layer}/{i}", None, {"points": points}))
        if self.lidars[i] and self.state.is_wanted("scan", i):
            t = np.linspace(-math.pi, math.pi, 120, dtype=np.float32)
            points = np.column_stack(
                (c[0] + 0.35 * np.cos(t), c[1] + 0.35 * np.sin(t), np.full(120, 1.08))
            ).astype(np.float32)
            items.append(Item(f"scan/{i}", {"stamp_s": self.time_s}, {"points": points}))
        if self.state.is_wanted("cell", i):
            half = self.spacing_m / 2 - 0.1
            points = (c + half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])).astype(np.float32)
            items.append(Item(f"cell/{i}", None, {"points": points}))
        return items

    def costmaps(self, i: int, pose: Any) -> List[Item]:
        items = []
        if self.state.is_wanted("global_costmap", i):
            if self._global is None:
                self._global = self.costmap("global_costmap", i, 0.0, 0.0, self.size_m, 0.1)
            items.append(Item(f"global_costmap/{i}", self._global.data, self._global.arrays))
        if self.state.is_wanted("local_costmap", i):
            items.append(
                self.costmap(
                    "local_costmap", i, float(pose[0]) - 1.5, float(pose[1]) - 1.5, (3.0, 3.0), 0.05
                )
            )
        return items

    def costmap(self, kind: str, i: int, x: float, y: float, size: Any, resolution: float) -> Item:
        xs = x + (np.arange(round(size[0] / resolution)) + 0.5) * resolution
        ys = y + (np.arange(round(size[1] / resolution)) + 0.5) * resolution
        gx, gy = np.meshgrid(xs, ys)
        near = np.full(gx.shape, np.inf)
        middle = (x + size[0] / 2, y + size[1] / 2)
        is_near = np.abs(self.centres - middle).max(axis=1) < max(size)
        for cx, cy in self.centres[is_near]:
            near = np.minimum(near, np.hypot(gx - cx, gy - cy) - 0.35)
        costs = np.where(
            near <= 0, 100, np.where(near <= 0.3, 99, 98 * np.exp(-4 * np.maximum(near - 0.3, 0)))
        ).astype(np.int8)
        costs[:2] = -1  # unknown
        return Item(
            f"{kind}/{i}",
            {"x": x, "y": y, "yaw": 0.0, "resolution_m": resolution},
            {"costs": costs},
        )

    def rows(self) -> List[Dict[str, Any]]:
        return [
            {
                "robot": i,
                "state": _STATES[(i + self._steps // 50) % len(_STATES)] if i else "flying",
                "goal": 2,
                "goals": 3,
                "distance_m": 1.23 + i,
                "speed_mps": SPEED_MPS,
                "gap_m": 1.1 if self.n > 1 else None,
                "recoveries": [i % 3, 4],
                "age_s": 0.05,
                "lidar": self.lidars[i],
                "reason": "no path to the goal" if i % 7 == 5 else "",
            }
            for i in range(self.n)
        ]

    def yields(self, pose: Any) -> List[Dict[str, Any]]:
        kinds = ("waits", "makes room", "limited")
        return [
            {
                "robot": i,
                "peer": i + 1,
                "kind": kinds[i // 3 % 3],
                "hold": [float(self.centres[i, 0]) - 2.0, float(self.centres[i, 1]) - 2.0]
                if i // 3 % 3 == 1
                else None,
            }
            for i in range(0, self.n - 1, 3)
        ]

    def put_goals(self) -> None:
        states = ("reached", "active", "pending")
        goals = []
        for i, (x, y) in enumerate(self.centres.tolist()):
            for k, state in enumerate(states):
                t = 2.0 * k + i
                goals.append(
                    {
                        "robot": i,
                        "index": k,
                        "x": x + 2.0 * math.cos(t),
                        "y": y + 2.0 * math.sin(t),
                        "yaw": None if k == 2 else t,
                        "state": state,
                    }
                )
            if i in self.goals_sent:
                pose = self.goals_sent[i]
                goals[-2].update(x=pose.x_m, y=pose.y_m, yaw=pose.yaw_rad)
        self.state.put("goals", {"goals": goals})

    def touch(self, pose: Any) -> None:
        self.contacts.append(
            {"time_s": self.time_s, "robot": 0, "other": "table", "x": 1.5, "y": 1.3}
        )
        self.state.put("contacts", {"contacts": list(self.contacts)})
        self.state.add_event(self.time_s, "robot0: contact with table", "error", 0)


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
            print("call", repr(call), flush=True)
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


def obey_input(actions: SyntheticActions) -> None:
    """Begin another flight at a line "again", and print any other line."""
    for line in sys.stdin:
        if line.strip() == "again":
            actions.renew()
            print("renewed", flush=True)
        else:
            print(line.strip(), flush=True)


def main() -> None:
    from quad_nav.web.server import WebOptions, serve

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
    parser.add_argument(
        "--calls",
        action="store_true",
        help="print each action's call; a line 'again' begins another flight",
    )
    args = parser.parse_args()
    fleet = SyntheticFleet(args.robots, obstacles=args.obstacles)
    fleet.duration_s = args.replay
    fleet.start()
    options = WebOptions(
        address=args.address,
        port=args.port,
        steer_token=args.steer_token,
        watch_token=args.watch_token,
        on_ready=lambda urls: print(urls, flush=True),
    )
    actions = SyntheticActions(fleet)
    if args.calls:
        actions.prints_calls = True
        threading.Thread(target=obey_input, args=[actions], daemon=True).start()
    # A shell's background job begins with Ctrl-C ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with contextlib.suppress(KeyboardInterrupt):
        serve(fleet.state, actions, options)


if __name__ == "__main__":
    main()
