"""A made-up fleet: robots that fly on circles around pillars, with all that a page can show."""

from __future__ import annotations

import math
import threading
import time
from typing import Any, Dict, List, Optional

import numpy as np
from synthetic_scene import obstacles, scene, statuses, tracks

from quad_web.view.state import FleetState, Item

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
                Item("scene", scene(self.size_m, self.centres, self.has_obstacles)),
                Item(
                    "robots",
                    {
                        "names": [f"robot{i}" for i in range(self.n)],
                        "colours": [colours[i % len(colours)] for i in range(self.n)],
                        "radius_m": 0.3,
                        "footprint": None,
                    },
                ),
                Item("diagnostics", {"statuses": statuses(self.n)}),
            ]
        )
        self.put_goals()
        self.state.add_event(0.0, "mission started")

    # -- what moves ------------------------------------------------------------------

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
            places = obstacles(self.size_m, self.time_s)
            wanted = [i for i in range(self.n) if self.state.is_wanted("track", i)]
            items += [places, *(tracks(i, places) for i in wanted)]
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
                "goal_distance": 1.23 + i,
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
