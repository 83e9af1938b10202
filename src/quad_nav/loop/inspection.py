"""Look at navigators and change them between ticks, in whatever process they are.

A view of a running flight asks now and then; between two questions it costs nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Callable, FrozenSet, List, Mapping, Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.config import Configuration
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.tracks import Tracks
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec
from quad_nav.loop.navigator_group import LocatedScan, LoopRobot, NavigatorGroup
from quad_nav.navigator.tick import State
from quad_nav.peers.right_of_way import YieldDecision

PLAN, LOCAL_PLAN, SCAN, TRACK = "plan", "local_plan", "scan", "track"
GLOBAL_COSTMAP, LOCAL_COSTMAP = "global_costmap", "local_costmap"

Change = Callable[[NavigatorGroup], None]
"""Change of a group, such as ``partial(cancel_goal, robot=3)``; it can be pickled."""
_NO_ROBOTS: FrozenSet[int] = frozenset()


@dataclass(frozen=True)
class Inspection:
    """What to look at, beside the small values of all robots.

    Attributes:
        parts: Numbers of the robots by part: "plan", "local_plan", "scan", "global_costmap",
            "local_costmap", "track".
    """

    parts: Mapping[str, FrozenSet[int]] = field(default_factory=dict)

    def includes(self, part: str, robot: int) -> bool:
        """Return whether to look at a part of a robot."""
        return robot in self.parts.get(part, _NO_ROBOTS)


@dataclass(frozen=True)
class CostmapView:
    """A costmap as it is now.

    Attributes:
        spec: Its cells, in its own frame.
        costs: uint8[H, W]; valid until the next tick.
        map_from_frame: Pose of its frame in ``map``.
    """

    spec: GridSpec
    costs: NDArray[np.uint8]
    map_from_frame: Pose2D


@dataclass(frozen=True)
class TrackView:
    """The moving obstacles that a robot tracks.

    Attributes:
        tracks: Tracks and suspects, in the local costmap's frame.
        map_from_frame: Pose of the frame in ``map``.
    """

    tracks: Tracks
    map_from_frame: Pose2D


@dataclass(frozen=True)
class NavigatorView:
    """A navigator as it is now.

    Attributes:
        robot: Number of the robot.
        state: State of the state machine.
        has_goal: It has a goal, or one waits for it.
        decision: The decision to yield that is in force.
        limited_by: Name of the peer that limited the last command, "" if none did.
        cycle_wall_s: Wall time of the last tick with a control cycle, None before the first.
        recoveries_done: Recovery behaviours that ran for what fails now.
        recoveries: Number of recovery behaviours.
        stopped_reason: Why the robot stops for lack of data, "" if it does not.
        safety_radius_m: Radius of the robot plus the margin to its peers.
        plan: float64[n, 2], global plan in ``map``; None without one or if not asked for.
        local_plan: float64[n, 2], local plan in ``map``; the same.
        scan: The last scan; None without one or if not asked for.
        costmaps: The costmaps that were asked for, by part.
        track: Tracks and suspects; None without any or if not asked for.
    """

    robot: int
    state: State
    has_goal: bool
    decision: Optional[YieldDecision]
    limited_by: str
    cycle_wall_s: Optional[float]
    recoveries_done: int
    recoveries: int
    stopped_reason: str
    safety_radius_m: float
    plan: Optional[NDArray[np.float64]] = None
    local_plan: Optional[NDArray[np.float64]] = None
    scan: Optional[LocatedScan] = None
    costmaps: Mapping[str, CostmapView] = field(default_factory=dict)
    track: Optional[TrackView] = None


def inspect_group(group: NavigatorGroup, what: Inspection, now_s: float) -> List[NavigatorView]:
    """Look at all navigators of a group."""
    return [
        _view(robot, number, group.last_scans.get(number), what, now_s)
        for number, robot in group.robots.items()
    ]


def cancel_goal(group: NavigatorGroup, robot: int) -> None:
    """Drop the goal of a navigator; its next tick commands a stop."""
    hosted = group.robots[robot]
    hosted.waiting_goal = None
    hosted.navigator.cancel()
    hosted.due_s = -math.inf


def clear_costmaps(group: NavigatorGroup, robot: int, now_s: float) -> None:
    """Clear both costmaps of a navigator, as the service ``~clear_costmaps`` does."""
    hosted = group.robots[robot]
    hosted.navigator.clear_costmaps(now_s)
    hosted.due_s = -math.inf


def reconfigure(group: NavigatorGroup, robot: int, configuration: Configuration) -> None:
    """Change every parameter of a navigator that may change in flight."""
    group.robots[robot].reconfigure(configuration)


def _view(
    robot: LoopRobot,
    number: int,
    scan: Optional[LocatedScan],
    what: Inspection,
    now_s: float,
) -> NavigatorView:
    navigator = robot.navigator
    global_costmap, local_costmap = robot.costmaps
    has_goal = navigator.state is not State.IDLE

    def shows(part: str) -> bool:
        return has_goal and what.includes(part, number)

    return NavigatorView(
        number,
        navigator.state,
        has_goal or robot.waiting_goal is not None,
        navigator.peers.decision,
        robot.limited_by,
        robot.cycle_wall_s,
        navigator.recoveries_done,
        len(navigator.recoveries),
        robot.stopped_reason,
        navigator.peers.safety_radius_m,
        _placed(robot, robot.plan, global_costmap) if shows(PLAN) else None,
        _placed(robot, robot.local_plan, local_costmap) if shows(LOCAL_PLAN) else None,
        scan if what.includes(SCAN, number) else None,
        {
            part: _costmap(robot, costmap)
            for part, costmap in zip((GLOBAL_COSTMAP, LOCAL_COSTMAP), robot.costmaps)
            if what.includes(part, number)
        },
        _track(robot, now_s) if what.includes(TRACK, number) else None,
    )


def _placed(
    robot: LoopRobot, plan: Optional[NDArray[np.float64]], costmap: LayeredCostmap
) -> Optional[NDArray[np.float64]]:
    """Return a plan in ``map``, float64[n, 2]."""
    if plan is None or not len(plan):
        return None
    placed: NDArray[np.float64] = robot.map_from(costmap.params.global_frame).transform_points(
        plan[:, :2]
    )
    return placed


def _costmap(robot: LoopRobot, costmap: LayeredCostmap) -> CostmapView:
    frame = costmap.params.global_frame
    return CostmapView(costmap.spec, costmap.costs, robot.map_from(frame))


def _track(robot: LoopRobot, now_s: float) -> Optional[TrackView]:
    tracks = robot.scan_filters.tracks(now_s)
    if tracks is None or not tracks.any_may_move:
        return None
    frame = robot.navigator.local_costmap.params.global_frame
    return TrackView(tracks, robot.map_from(frame))
