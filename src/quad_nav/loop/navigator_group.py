"""A navigator group: the LIDARs and navigators of the robots that share a process.

The robots of a flight are one group, or several in as many processes. A navigator knows of
its peers what they publish, and nothing that they publish in the same instant, so that the
division into groups does not change the flight.

A shell that has more around its navigators, as topics and actions, makes a subclass and passes it
to the loop as its ``GroupFactory``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Callable, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from quad_nav.config import Configuration
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.scan_intake import SensorPose, Sink, sinks_of
from quad_nav.geometry import Pose2D, Pose3D, Scan
from quad_nav.loop import LoopSetup
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.peers.peer import Intention, Peer, idle_priority
from quad_nav.plan.global_planner import SearchPlanner
from quad_nav.plan.navfn import Navfn
from quad_nav.plan.wavefront import Wavefront
from quad_nav.scenario.navigator_host import NavigatorHost
from quad_nav.scenario.scene_map import SceneMaps
from quad_nav.sim.casters import Lidars
from quad_nav.sim.lidar import base_from_lidar
from quad_nav.sim.localization import Localization, believed_states
from quad_nav.sim.odometry import FIXED_FRAMES, pose_in
from quad_nav.sim.robot_state import RobotState, RobotStates
from quad_nav.timing import is_due

LocatedScan = Tuple[Scan, Pose3D]
"""A scan and ``map_from_lidar``, the LIDAR's pose at its stamp."""
_IDENTITY = Pose2D(0.0, 0.0)


@dataclass(frozen=True)
class NavigatorResult:
    """The result of one navigator's tick.

    Attributes:
        robot: Number of the robot.
        tick: What the navigator did.
        located: The poses that it was given; unknown if only ``WorkerProcess`` knows them.
        wall_s: Wall time of the tick.
        goal_waits: The navigator has not taken the last goal that was sent.
        intention: Intention in ``map``; None if the tick has not changed it.
    """

    robot: int
    tick: Tick
    located: RobotPoses
    wall_s: float
    goal_waits: bool
    intention: Optional[Intention]


class LoopRobot(NavigatorHost):
    """One robot's navigator in the loop: scans, poses and goals in ``map`` in, ticks out.

    Attributes:
        waiting_goal: The last goal that was sent, in ``map``, until the navigator takes it.
        due_s: Time before which no tick is due, unless a goal waits. Who changes the navigator
            between ticks sets it to -inf.
        frames: The odometry frames of all robots now.
        is_lost: The robot does not know where it is.
    """

    def __init__(self, configuration: Configuration, number: int) -> None:
        """Build the navigator of robot ``number``."""
        super().__init__(configuration, number)
        self.waiting_goal: Optional[Pose2D] = None
        self.due_s = -math.inf
        self._number, self.frames, self.is_lost = number, FIXED_FRAMES, False
        self._lidar = self.new_intake(self.lidar_sinks())

    def lidar_sinks(self) -> List[Sink]:
        """List the sources of layers that are the simulated LIDAR."""
        return sinks_of(self.costmaps)

    def reconfigure(self, configuration: Configuration) -> None:
        """Change every parameter that may change in flight."""
        super().reconfigure(configuration)
        self.due_s = -math.inf

    def add_scan(self, scan: Scan, map_from_lidar: Pose3D, now_s: float) -> str:
        """Hand a scan that arrives now to the costmaps; return why not, "" if they have it."""
        sinks = self._lidar.sinks
        if self.frames.rows is None:
            poses = [SensorPose(map_from_lidar, map_from_lidar)] * len(sinks)
        else:
            in_costmaps = self._in_costmaps(map_from_lidar)
            at = {frame: SensorPose(pose, pose) for frame, pose in in_costmaps.items()}
            poses = [at[sink.costmap.params.global_frame] for sink in sinks]
        return self._lidar.add_scan(scan, poses, scan.stamp_s, now_s)

    def is_due(self, now_s: float) -> bool:
        """Set the waiting goal if the navigator accepts it; return True if a tick is due."""
        if self.waiting_goal is not None and self.navigator.accepts_goal(now_s):
            goal, map_from_global = self.waiting_goal, self.map_from_global
            if map_from_global != _IDENTITY:
                goal = goal.relative_to(map_from_global)
            self.navigator.set_goal(goal, now_s)
            self.waiting_goal = None
        self._note_due()
        return is_due(self.due_s, now_s)

    def _note_due(self) -> None:
        self.due_s = -math.inf if self.navigator.has_work else self.navigator.next_due_s

    def navigate(
        self, now_s: float, state: RobotState, peers: Sequence[Peer]
    ) -> Tuple[Tick, RobotPoses]:
        """Tick the navigator among peers in ``map``; also return the poses that it was given."""
        for costmap in self.costmaps:
            if costmap.map_frames:
                costmap.set_map_poses(self._map_poses(costmap, now_s))
        located = self._located(state.map_from_base)
        map_from_global = self.map_from_global
        if map_from_global != _IDENTITY:
            peers = [peer.relative_to(map_from_global) for peer in peers]
        tick = self.tick(now_s, located, state.twist, peers)
        self._note_due()
        return tick, located

    def intention(self) -> Intention:
        """Return the navigator's intention in ``map``."""
        intention, map_from_global = self.navigator.peers.intention, self.map_from_global
        if map_from_global == _IDENTITY:
            return intention
        return intention.transformed(map_from_global)

    def reset(self, now_s: float, jumped_back: bool) -> None:
        """Continue after a reset; see ``NavigatorGroup.reset``."""
        self.due_s = -math.inf
        if jumped_back:
            self.restart(now_s)

    @property
    def map_from_global(self) -> Pose2D:
        """Pose of the global costmap's frame in ``map``."""
        return self.map_from(self.navigator.global_costmap.params.global_frame)

    def map_from(self, frame: str) -> Pose2D:
        """Return the pose of a costmap's frame in ``map``."""
        return self.frames.map_from_frame(frame, self._number)

    def _map_poses(self, costmap: LayeredCostmap, now_s: float) -> Dict[str, Optional[Pose3D]]:
        """Return the pose of a costmap's frame in the frames of its maps, which are ``map``."""
        frame = costmap.params.global_frame
        pose = self.map_from(frame).to_3d()
        return dict.fromkeys(costmap.map_frames, pose)

    def _located(self, map_from_base: Pose3D) -> RobotPoses:
        """Express the robot's pose in the frames of the costmaps."""
        if self.is_lost:
            return RobotPoses(None, None)
        if self.frames.rows is None:
            pose = map_from_base.to_2d()
            return RobotPoses(pose, pose)
        at = self._in_costmaps(map_from_base)
        in_global, in_local = (at[one.params.global_frame].to_2d() for one in self.costmaps)
        return RobotPoses(in_global, in_local)

    def _in_costmaps(self, map_from_pose: Pose3D) -> Dict[str, Pose3D]:
        """Express a pose in ``map`` in the frames of the costmaps, by their names."""
        return {
            frame: pose_in(self.map_from(frame), map_from_pose)
            for frame in dict.fromkeys(costmap.params.global_frame for costmap in self.costmaps)
        }


class NavigatorGroup:
    """The LIDARs and navigators of some of a set-up's robots.

    A subclass of a shell may extend ``new_robot``, ``set_maps``, ``scan``, ``due_s``,
    ``before_ticks``, ``tick``, ``reset`` and ``close``. All of them are called in the group's
    process, by one thread.

    Attributes:
        setup: The loop's set-up.
        robots: The group's robots, by number.
        intentions: Intentions in ``map`` of all robots of the set-up.
        lidar_enabled: bool[n], LIDARs that are on, of all robots of the set-up.
        last_scans: The last scans, by the robots' numbers.
        localization: Finds the robots' places; None if they know them.
    """

    def __init__(self, setup: LoopSetup, robots: Sequence[int], lidars: Lidars) -> None:
        """Build the navigators of ``robots``; ``lidars`` are those of all robots."""
        self.setup = setup
        self._lidars = lidars
        self.lidar_enabled = np.ones(len(setup.names), dtype=bool)
        self.intentions = [Intention(idle_priority(n)) for n in range(len(setup.names))]
        self.last_scans: Dict[int, LocatedScan] = {}
        self._wave = Wavefront()
        self.localization = self._new_localization()
        self.robots = {number: self.new_robot(number) for number in robots}
        self.set_maps()

    def _new_localization(self) -> Optional[Localization]:
        setup = self.setup
        return setup.localization and setup.localization(setup.scene, len(setup.names))

    def set_maps(self) -> None:
        """Give static layers the scene's map."""
        maps = SceneMaps(self.setup.scene)
        for robot in self.robots.values():
            for costmap in robot.costmaps:
                maps.set_map_of(costmap)

    def new_robot(self, number: int) -> LoopRobot:
        """Build a robot's navigator; the planners of the group share their working memory."""
        robot = LoopRobot(self.setup.configurations[number], number)
        planner = robot.navigator.planner
        if isinstance(planner, (Navfn, SearchPlanner)):
            planner.wave = self._wave
        return robot

    def scan(self, now_s: float, states: RobotStates) -> Dict[int, LocatedScan]:
        """Take a scan with each LIDAR that is on and pass it to the robot's navigator.

        Returns:
            The scans, by the robots' numbers.
        """
        scans = {}
        numbers = [number for number in self.robots if self.lidar_enabled[number]]
        for number, scan in zip(numbers, self._lidars.scan(states.bodies, numbers, now_s)):
            scans[number] = (scan, states[number].map_from_base.compose(base_from_lidar))
            if self.localization is not None:
                map_from_odom = states.frames.map_from_odom(number)
                lidar, base = scans[number][1], states[number].map_from_base
                self.localization.add_scan(
                    number,
                    scan,
                    pose_in(map_from_odom, base),
                    pose_in(map_from_odom, lidar),
                )
        self._hand_over(scans, now_s, states)
        self.last_scans = scans
        return scans

    def _hand_over(
        self, scans: Mapping[int, LocatedScan], now_s: float, states: RobotStates
    ) -> None:
        """Hand scans to the navigators, from where the robots believe that their LIDARs are."""
        believed = self._believed(states)
        for number, (scan, map_from_lidar) in scans.items():
            robot = self.robots[number]
            if self.localization is not None:
                map_from_lidar = believed[number].map_from_base.compose(base_from_lidar)
            if not robot.is_lost:
                robot.add_scan(scan, map_from_lidar, now_s)

    def _believed(self, states: RobotStates) -> RobotStates:
        """Return the states as the robots believe them, and tell these where they are."""
        believed = believed_states(states, self.localization)
        for number, robot in self.robots.items():
            robot.frames = believed.frames
            robot.is_lost = self.localization is not None and self.localization.is_lost(number)
        return believed

    @property
    def due_s(self) -> float:
        """Time before which ``navigate`` has nothing to do, unless there are new goals."""
        due_s = math.inf
        for robot in self.robots.values():
            if robot.waiting_goal is not None:
                return -math.inf
            due_s = min(due_s, robot.due_s)
        return due_s

    def navigate(
        self, now_s: float, states: RobotStates, goals: Mapping[int, Pose2D]
    ) -> List[NavigatorResult]:
        """Tick the navigators that are due; the loop calls it from ``due_s`` on.

        Args:
            now_s: Simulated time.
            states: States of all robots.
            goals: New goals in ``map`` of robots of this group, by number.
        """
        states = self._believed(states)
        for number, goal in goals.items():
            self.robots[number].waiting_goal = goal
        self.before_ticks(now_s)
        due = [
            number
            for number, robot in self.robots.items()
            if (is_due(robot.due_s, now_s) or robot.waiting_goal is not None)
            and robot.is_due(now_s)
        ]
        peers = self._peers_in_reach(due, now_s, states)
        results = [self.tick(number, now_s, states, peers[number]) for number in due]
        for result in results:
            if result.intention is not None:
                self.intentions[result.robot] = result.intention
        return results

    def before_ticks(self, now_s: float) -> None:
        """Do something before the navigators that are due are chosen, as to set goals."""

    def tick(
        self, number: int, now_s: float, states: RobotStates, peers: Sequence[Peer]
    ) -> NavigatorResult:
        """Tick navigator ``number`` among the peers in reach, in ``map``."""
        robot = self.robots[number]
        tick, located = robot.navigate(now_s, states[number], peers)
        intention = robot.intention()
        return NavigatorResult(
            number,
            tick,
            located,
            robot.wall_s,
            robot.waiting_goal is not None,
            None if intention.is_same(self.intentions[number]) else intention,
        )

    def reset(self, now_s: float, jumped_back: bool, lidars: Lidars) -> None:
        """Continue after a reset of the simulation.

        Args:
            now_s: Simulated time.
            jumped_back: The clock has jumped back, so that the navigators restart.
            lidars: LIDARs of all robots.
        """
        self._lidars, self.localization = lidars, self._new_localization()
        for robot in self.robots.values():
            robot.reset(now_s, jumped_back)

    def close(self) -> None:
        """Free what a subclass holds; nothing is called afterwards."""

    def _peers_in_reach(
        self, robots: List[int], now_s: float, states: RobotStates
    ) -> Dict[int, List[Peer]]:
        """The peers within each robot's ``peers.reach_m``, by the robots' numbers."""
        if len(self.setup.names) == 1 or not robots:
            return {robot: [] for robot in robots}
        positions_m = states.bodies.positions_m[:, :2]
        offsets_m = positions_m - positions_m[robots][:, None]
        reaches_m = np.array([self.robots[robot].navigator.peers.reach_m for robot in robots])
        is_near = np.hypot(offsets_m[..., 0], offsets_m[..., 1]) < reaches_m[:, None]
        is_near[np.arange(len(robots)), robots] = False
        peers = {
            robot: self._as_peer(robot, now_s, states)
            for robot in np.flatnonzero(is_near.any(axis=0)).tolist()
        }
        return {
            robot: [peers[other] for other in np.flatnonzero(row).tolist()]
            for robot, row in zip(robots, is_near)
        }

    def _as_peer(self, robot: int, now_s: float, states: RobotStates) -> Peer:
        x_m, y_m, _, _, _, _, vx_mps, vy_mps = states.planar[robot].tolist()
        name, intention = self.setup.names[robot], self.intentions[robot]
        return Peer(name, x_m, y_m, vx_mps, vy_mps, now_s, intention)


GroupFactory = Callable[[LoopSetup, Sequence[int], Lidars], NavigatorGroup]
"""Maker of the group of a process: of the set-up, its robots' numbers, and all robots' LIDARs."""
