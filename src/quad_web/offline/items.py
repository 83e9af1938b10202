"""The items of a page from a running offline flight."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Dict, List, Mapping, Optional, Sequence, Set, Tuple

import numpy as np

from quad_nav.costmap.cost_grid import occupancy
from quad_nav.loop.inspection import (
    GLOBAL_COSTMAP,
    LOCAL_COSTMAP,
    LOCAL_PLAN,
    PLAN,
    SCAN,
    TRACK,
    Inspection,
    NavigatorView,
)
from quad_nav.offline.flight import Flight
from quad_nav.sim.contacts import Contact
from quad_nav.sim.localization import believed_states
from quad_nav.topics.robot_topics import COLUMNS, RobotStatus
from quad_nav.topics.tracked_obstacles import track_rows
from quad_web.offline.actions import HAS_ENDED, STOPPED, FlightActions
from quad_web.view import rows
from quad_web.view.cells import cell_items
from quad_web.view.items import (
    ObstacleItems,
    Trails,
    costmap_item,
    line_item,
    poses_item,
    robots_item,
    scan_item,
    scene_item,
    track_item,
)
from quad_web.view.localization import LOST, Located
from quad_web.view.state import Item, Wanted, robots_by_layer

TRACK_PERIOD_S = 0.2
_PARTS = (PLAN, LOCAL_PLAN, SCAN, GLOBAL_COSTMAP, LOCAL_COSTMAP, TRACK)


class FlightItems:
    """Makes the items of a flight that pages show, and only these."""

    def __init__(self, flight: Flight) -> None:
        """Show a flight from its start on."""
        self._flight = flight
        self._names = [robot.name for robot in flight.robots]
        self._robots = range(len(self._names))
        self._contacts: List[Contact] = []
        self._failed: Dict[int, Set[int]] = {robot: set() for robot in self._robots}
        self._trails, self._obstacles, self._samples = Trails(), ObstacleItems(), rows.Samples()
        self._next_track_s = -math.inf
        self._has_static = self._has_goals = False
        self._shown: Set[str] = set()  # keys of items that may disappear
        self._has_contacts = True

    def track(self, flight: Flight) -> None:
        """Add the robots' positions to samples and trails; called at each odometry."""
        self._samples.add(flight.now_s, flight.states.bodies.rows)
        if flight.now_s < self._next_track_s:
            return
        self._next_track_s = flight.now_s + TRACK_PERIOD_S
        for robot, (x_m, y_m, _) in enumerate(flight.states.poses.tolist()):
            self._trails.add(robot, x_m, y_m)

    def add_contact(self, contact: Contact) -> None:
        """Show a contact from now on."""
        self._contacts.append(contact)
        self._has_contacts = True

    def note_goals(self, robot: int, failed: Optional[int] = None) -> None:
        """Show the goals anew: one of a robot was sent or has ended, and ``failed`` failed."""
        if failed is not None:
            self._failed[robot].add(failed)
        self._has_goals = False

    def sample(
        self, wanted: Optional[Sequence[Wanted]], actions: FlightActions, rate: float
    ) -> Tuple[List[Item], Tuple[str, ...]]:
        """Return new items, and the keys of items that are gone; ``wanted`` None is everything."""
        robots_of = robots_by_layer(wanted, self._robots)
        views = self._flight.loop.inspect(
            Inspection({part: robots_of[part] for part in _PARTS if robots_of[part]})
        )
        items = [] if self._has_static else self._static_items()
        if self._has_contacts:
            items.append(rows.contacts_item(self._contacts, self._names))
        if not self._has_goals:
            items.append(rows.goals_item(self._goal_rows()))
        self._has_static = self._has_goals = True
        self._has_contacts = False
        located = self._located()
        items += self._present_items(views, located, actions, rate)
        items += self._trails.items(sorted(robots_of["trail"]))
        radii_m = {v.robot: v.safety_radius_m for v in views if v.robot in robots_of["cell"]}
        positions = self._flight.states.poses[:, :2]
        passing = cell_items(self._flight.setup.scene, positions, radii_m)
        for view in views:
            passing += _navigator_items(view)
        passing += [located[robot].item(robot) for robot in robots_of["localization"] if located]
        keys = {item.key for item in passing}
        removed, self._shown = tuple(self._shown - keys), keys
        return items + passing, removed

    def _static_items(self) -> List[Item]:
        setup = self._flight.setup
        return [scene_item(setup.scene), robots_item(self._names, setup.robot_radius_m)]

    def _goal_rows(self) -> List[Dict[str, object]]:
        return [
            row
            for number, robot in enumerate(self._flight.robots)
            for row in rows.goal_rows(
                number,
                robot.sequencer.sequence.goals,
                robot.sequencer.index,
                robot.sequencer.active_goal is not None,
                self._failed[number],
            )
        ]

    def _present_items(
        self,
        views: Sequence[NavigatorView],
        located: Mapping[int, Located],
        actions: FlightActions,
        rate: float,
    ) -> List[Item]:
        """Return what changes all the time, of all robots."""
        flight, setup = self._flight, self._flight.setup
        poses = poses_item(flight.now_s, time.time(), flight.states.bodies.rows)
        movers = flight.simulation.movers
        moving = movers.poses(flight.now_s)
        known_s = {v.robot: v.cycle_wall_s for v in views if v.cycle_wall_s is not None}
        cycles_s = np.array([known_s.get(robot, np.nan) for robot in self._robots])
        samples = rows.samples_item(
            flight.now_s,
            poses.arrays["pose"],
            setup.robot_radius_m,
            setup.scene,
            setup.scene.moving_solids(moving),
            cycles_s,
        )
        now = {v.robot: self._robot_now(v, located.get(v.robot), actions) for v in views}
        status, yields = rows.fleet_items(now, self._names, samples)
        return [
            rows.flight_item(
                "offline",
                setup.scene.name,
                actions.state,
                flight.now_s,
                rate=rate,
                wanted_rate=actions.rate,
                reason=flight.reason,
            ),
            poses,
            *self._obstacles.items(setup.scene, moving),
            *self._samples.take(setup.robot_radius_m, movers.flight_surface_distances_m, cycles_s),
            yields,
            *([status] if views else []),
        ]

    def _located(self) -> Dict[int, Located]:
        """Return where the robots believe themselves now; {} if they know it."""
        localization, states = self._flight.loop.group.localization, self._flight.states
        if localization is None:
            return {}
        found, believed = {}, believed_states(states, localization)
        for robot in self._robots:
            estimate, particles = localization.estimate(robot), localization.particles(robot)
            found[robot] = Located(
                is_lost=localization.is_lost(robot),
                searches=particles is not None,
                particles=particles,
                truth=states[robot].map_from_base.to_2d(),
            )
            if estimate is not None:
                pose = believed[robot].map_from_base.to_2d()
                found[robot] = replace(found[robot], pose=pose, covariance=estimate[1])
        return found

    def _robot_now(
        self, view: NavigatorView, located: Optional[Located], actions: FlightActions
    ) -> rows.RobotNow:
        sequencer = self._flight.robots[view.robot].sequencer
        has_ended = actions.state == "ended"
        is_lost = located is not None and located.is_lost
        return rows.RobotNow(
            view.state.value,
            view.decision,
            view.limited_by,
            is_done=sequencer.done,
            is_stopped=actions.is_stopped or view.stopped_reason != "",
            is_lost=is_lost,
            has_ended=has_ended,
            goal=None if sequencer.done else sequencer.index + 1,
            goals=len(sequencer.sequence.goals),
            said=self._columns(view),
            recoveries=(view.recoveries_done, view.recoveries),
            lidar=actions.lidars[view.robot],
            reason=(LOST if is_lost and not has_ended else view.stopped_reason)
            or (HAS_ENDED if has_ended else STOPPED if actions.is_stopped else ""),
            localization=None if located is None else located.row(),
        )

    def _columns(self, view: NavigatorView) -> Dict[str, float]:
        """Return the numbers of the topics in ``COLUMNS``."""
        body = self._flight.states[view.robot]
        active = self._flight.robots[view.robot].sequencer.active_goal
        status = RobotStatus(
            view.state,
            view.decision,
            view.limited_by,
            None if active is None else active.pose,
            body.map_from_base.to_2d(),
            body.twist,
        )
        return {topic.name: topic.fields(status)["data"] for topic in COLUMNS}


def _navigator_items(view: NavigatorView) -> List[Item]:
    """Return the layers of a robot that were asked for."""
    items = []
    for layer, points in ((PLAN, view.plan), (LOCAL_PLAN, view.local_plan)):
        if points is not None:
            items.append(line_item(layer, view.robot, points))
    if view.scan is not None:
        items.append(scan_item(view.robot, *view.scan))
    if view.track is not None:
        rows_of = track_rows(view.track.tracks)
        items.append(track_item(view.robot, rows_of, view.track.map_from_frame))
    for layer, costmap in view.costmaps.items():
        items.append(
            costmap_item(
                layer, view.robot, costmap.spec, occupancy(costmap.costs), costmap.map_from_frame
            )
        )
    return items
