"""Tracking of moving obstacles in flights: errors against the truth, costmaps, other navigators."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quad_nav.grid import LETHAL
from quad_nav.offline.flight import Flight
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.sim.motion import Motion
from quad_nav.sim.obstacles import Cylinder
from quad_nav.sim.scene import MovingObstacle

ROOT = Path(__file__).resolve().parents[2]
ON = (("scan_filters", [{"name": "tracker", "type": "quad_moving/Tracker"}]),)


def tracks_of(robot):
    """The tracks at the time of the last scan."""
    return robot.scan_filters.filters[-1].known


def setup_of(scene, goals, parameters=ON, robots=1, seed=0):
    options = FlightOptions(ROOT / scene, ROOT / goals, "default", parameters, robots, seed)
    return read_setup(options)


def arena(parameters=ON, moving=(), robots=1):
    setup = setup_of("scenes/arena.yaml", "goals", parameters, robots)
    return replace(setup, scene=replace(setup.scene, moving=tuple(moving)))


def walker(*points, speed_mps=1.0, radius_m=0.3):
    """A cylinder that goes to and fro between points (x, y)."""
    legs = [math.dist(a, b) / speed_mps for a, b in zip(points, points[1:])]
    times_s = np.cumsum([0.0, *legs, *reversed(legs)])
    poses = tuple((x_m, y_m, 0.0) for x_m, y_m in (*points, *reversed(points[:-1])))
    cylinder = Cylinder("walker", *points[0], radius_m, 1.8)
    return MovingObstacle(cylinder, Motion(tuple(times_s.tolist()), poses))


def fly_for(setup, seconds):
    """Yield a flight after each period of odometry."""
    flight = Flight(setup)
    try:
        while flight.now_s < seconds and not flight.is_done:
            flight.advance()
            yield flight
    finally:
        flight.end()


def test_where_nothing_moves_flights_are_the_same_with_and_without():
    scene, goals, paths = "scenes/encounters/corridor.yaml", "goals/encounters/corridor", []
    for parameters in (ON, ()):
        flights = fly_for(setup_of(scene, goals, parameters), 30.0)
        paths.append([flight.states.poses.tobytes() for flight in flights])
    assert paths[0] == paths[1]


def test_a_walker_is_tracked_while_the_robot_flies():
    """Within 8 m, from 1 s after it can be seen on; it turns at 4 s, 8 s, ..."""
    setup, errors = arena(moving=[walker((5.0, 2.0), (5.0, 6.0))]), []
    for flight in fly_for(setup, 12.0):
        tracks, now_s = tracks_of(flight.offline_robots[0]), flight.now_s
        since_turn_s = now_s % 4.0
        if since_turn_s < 1.0 or tracks.time_s != pytest.approx(now_s) or not len(tracks):
            continue
        movers = flight.simulation.movers
        before, here = movers.poses_at(np.array([now_s - 0.05, now_s]))[:, 0, :2]
        truth = np.concatenate([here, (here - before) / 0.05])
        errors.append(np.abs(tracks.states[0] - truth))
        assert len(tracks) == 1
    assert len(errors) > 80
    position_m, velocity_mps = np.array(errors)[:, :2], np.array(errors)[:, 2:]
    assert np.percentile(position_m, 95) < 0.05 and np.percentile(velocity_mps, 95) < 0.2


@pytest.mark.parametrize("layer", ["costmap_2d::ObstacleLayer", "costmap_2d::VoxelLayer"])
def test_a_walker_leaves_no_trace_in_the_costmaps(layer):
    kind = (("local_costmap/map_type", "voxel"),) if "Voxel" in layer else ()
    setup = arena((*ON, *kind), [walker((4.0, 3.0), (4.0, 7.0))])
    marked, tracked = 0, 0
    for flight in fly_for(setup, 14.0):
        robot = flight.offline_robots[0]
        if flight.now_s < 1.5 or not len(tracks_of(robot)):
            continue
        tracked += 1
        costmap = robot.navigator.local_costmap
        rows, columns = np.nonzero(costmap.costs == LETHAL)
        x_m = costmap.spec.origin_x_m + (columns + 0.5) * costmap.spec.resolution_m
        y_m = costmap.spec.origin_y_m + (rows + 0.5) * costmap.spec.resolution_m
        on_path = (np.abs(x_m - 4.0) < 0.35) & (y_m > 2.65) & (y_m < 7.35)
        marked += bool(on_path.any())
    assert tracked > 200
    assert marked <= 0.02 * tracked
