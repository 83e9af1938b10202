"""amcl's core where it deviates from upstream, and whole localisations in a small room."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from quad_localization import Amcl, AmclParams, Observation, OccupancyMap, PoseEstimate
from quad_localization.occupancy_map import ray_range
from quad_localization.parameters import BEAM, LASER_MODELS, LIKELIHOOD_FIELD_PROB
from quad_nav.geometry import Pose2D, Pose3D, Scan, quaternion_from_euler

BEAMS = 72
STEP_RAD = 2 * math.pi / BEAMS
MOUNT = Pose3D(0.1, 0.0, 0.1)
QUICK = AmclParams(
    max_particles=300,
    resample_interval=1,
    update_min_d_m=0.05,
    update_min_a_rad=0.05,
    odom_model_type="omni-corrected",
)
START = Pose2D(1.5, 2.0, 0.3)


def room(boxes):
    cells = np.zeros((81, 121), np.int8)
    cells[0], cells[-1], cells[:, 0], cells[:, -1] = 100, 100, 100, 100
    for rows, columns in boxes:
        cells[rows, columns] = 100
    return OccupancyMap.from_occupancy(cells, 0.05, 0.0, 0.0)


ROOM = room([(slice(60, 80), slice(20, 30)), (slice(10, 16), slice(80, 100))])


def estimate(pose=START, variance=0.01):
    return PoseEstimate(pose, variance * np.eye(3))


def localizer(params=QUICK, seed=1, pose=START, variance=0.01, grid=ROOM):
    amcl = Amcl(params, seed)
    amcl.set_map(grid, estimate(pose, variance))
    return amcl


def scan_from(pose, hidden=(), range_max_m=60.0, grid=ROOM):
    """Return the scan at a pose; beams in ``hidden`` have the range given there."""
    x_m, y_m = pose.transform(MOUNT.x_m, MOUNT.y_m)
    ranges_m = [
        ray_range(grid.states, grid.frame, x_m, y_m, pose.yaw_rad - math.pi + k * STEP_RAD, 60.0)
        for k in range(BEAMS)
    ]
    for k, range_m in dict(hidden).items():
        ranges_m[k] = range_m
    ranges = np.array(ranges_m, np.float32)
    return Scan(0.0, -math.pi, STEP_RAD, 0.02, range_max_m, ranges)


def seen(pose, odometry=None, scan=None, **more):
    odometry = (odometry or pose).to_3d()
    return Observation("lidar", scan or scan_from(pose), MOUNT, odometry, **more)


def places(amcl):
    return amcl.particles.poses.mean(axis=0)


@pytest.mark.parametrize("model", LASER_MODELS)
def test_finds_where_it_is(model):
    """From 0.3 m beside, with an odometry that turns by 0.02 rad and drifts by 5 %."""
    amcl = localizer(
        replace(QUICK, laser_model_type=model), pose=Pose2D(1.7, 2.2, 0.2), variance=0.05
    )
    for k in range(30):
        pose = Pose2D(1.5 + 0.1 * k, 2.0, 0.3)
        along_m = 1.05 * 0.1 * k
        odometry = Pose2D(along_m * math.cos(0.3), -along_m * math.sin(0.3), 0.002 * k)
        amcl.update(seen(pose, odometry))
    assert amcl.estimate.pose.distance_to(pose) < 0.12
    assert abs(amcl.estimate.pose.yaw_rad - 0.3) < 0.06
    assert amcl.particles.is_converged


def test_the_transform_takes_odometry_to_the_map():
    amcl = localizer(variance=0.0)
    amcl.update(seen(START, Pose2D(0.2, -0.1, 1.0)))
    found = amcl.map_from_odom.compose(Pose2D(0.2, -0.1, 1.0).to_3d()).to_2d()
    assert found.distance_to(START) < 1e-9
    assert found.yaw_rad == pytest.approx(0.3)


def test_a_reconfiguration_keeps_the_particles_before_and_after_the_first_pose():
    amcl = localizer(variance=0.0)
    amcl.reconfigure(replace(QUICK, laser_max_beams=60))
    assert places(amcl) == pytest.approx([1.5, 2.0, 0.3])
    amcl.update(seen(START))
    amcl.reconfigure(replace(QUICK, max_particles=200))
    assert len(amcl.particles.poses) <= 300
    assert places(amcl)[:2] == pytest.approx([1.5, 2.0], abs=0.05)


def test_upstream_puts_all_at_the_origin_before_the_first_pose():
    params = replace(QUICK, upstream=True)
    amcl = localizer(params)
    amcl.reconfigure(params)
    assert not amcl.particles.poses.any()


@pytest.mark.parametrize("upstream, same", [(False, False), (True, True)])
def test_upstreams_runs_have_the_same_numbers(upstream, same):
    params = replace(QUICK, upstream=upstream)
    a, b = (localizer(params, seed).particles.poses for seed in (1, 2))
    assert np.array_equal(a, b) == same


def test_a_map_that_comes_again_leaves_a_robot_where_it_is():
    amcl = localizer(variance=0.0)
    amcl.update(seen(START))
    amcl.set_map(ROOM, estimate(Pose2D(5.0, 3.5)))
    assert places(amcl)[:2] == pytest.approx([1.5, 2.0], abs=0.05)
    amcl.set_pose(estimate(Pose2D(4.0, 3.0), 0.0))
    assert places(amcl)[:2] == pytest.approx([4.0, 3.0])


@pytest.mark.parametrize("upstream, moved_m", [(False, 0.1), (True, 0.2)])
def test_an_unusable_scan_does_not_move_the_particles(upstream, moved_m):
    still = {f"odom_alpha{k}": 0.0 for k in range(1, 6)}
    amcl = localizer(replace(QUICK, upstream=upstream, resample_interval=9, **still), variance=0.0)
    amcl.update(seen(START, Pose2D(0.0, 0.0, 0.3)))
    bad = scan_from(START, range_max_m=-1.0)
    assert amcl.update(seen(START, Pose2D(0.1, 0.0, 0.3), scan=bad)) is None
    amcl.update(seen(START, Pose2D(0.1, 0.0, 0.3)))
    assert np.hypot(*(places(amcl)[:2] - (1.5, 2.0))) == pytest.approx(moved_m)


@pytest.mark.parametrize("upstream", [False, True])
def test_beams_without_a_return(upstream):
    """One NaN (beam), or gaps while all beams count (beam skipping), end the weighing upstream."""
    gaps = {k: math.nan for k in range(0, BEAMS, 5)}
    skipping = {"do_beamskip": True, "beam_skip_error_threshold": 0.0}
    for model, more in ((BEAM, {}), (LIKELIHOOD_FIELD_PROB, skipping)):
        params = replace(QUICK, laser_model_type=model, upstream=upstream, resample_interval=9)
        amcl = localizer(replace(params, **more))
        amcl.particles.is_converged = True
        amcl.update(seen(START, scan=scan_from(START, gaps)))
        assert (np.ptp(amcl.particles.weights) == 0.0) == upstream, model


def test_fewer_ranges_than_beams():
    params = replace(QUICK, laser_model_type=BEAM, laser_max_beams=200)
    assert localizer(params).update(seen(START)).is_weighed


@pytest.mark.parametrize("upstream, clusters", [(False, 1), (True, 2)])
def test_a_heading_across_pi_is_one_cluster(upstream, clusters):
    amcl = localizer(replace(QUICK, upstream=upstream))
    yaws_rad = np.where(np.arange(100) % 2, math.pi - 0.05, 0.05 - math.pi)
    amcl.particles.poses = np.column_stack((np.full((100, 2), 2.1), yaws_rad))
    amcl.particles.weights = np.full(100, 0.01)
    amcl.particles.update_statistics()
    assert len(amcl.particles.statistics.weights) == clusters


def test_no_free_cell():
    amcl = Amcl(QUICK, 1)
    assert not amcl.set_uniform()
    full = OccupancyMap.from_occupancy(np.full((5, 5), 100, np.int8), 0.1, 0.0, 0.0)
    amcl.set_map(full, estimate(Pose2D(0.2, 0.2)))
    assert not amcl.set_uniform()
    amcl.particles.w_slow, amcl.particles.w_fast = 1.0, 0.1  # would draw random poses
    amcl.particles.resample()


def test_beams_that_end_on_a_known_peer_are_left_out():
    """A peer 0.8 m ahead hides a wall that is 4 m away: with its beams no pose is likely."""
    hidden = {k: 0.5 for k in range(BEAMS // 2 - 5, BEAMS // 2 + 6)}
    ahead = START.transform(0.8, 0.0)
    weights = []
    for peers in (np.array([ahead]), np.array([[4.0, 3.0]])):
        params = replace(QUICK, laser_model_type=LIKELIHOOD_FIELD_PROB, resample_interval=9)
        amcl = localizer(params, variance=0.0)
        amcl.update(seen(START))
        amcl.is_update_requested = True
        amcl.update(seen(START, scan=scan_from(START, hidden), peers=peers))
        weights.append(amcl.particles.w_fast)
    assert weights[0] > 1.05 * weights[1]


def test_the_transform_of_a_flying_robot_keeps_its_height_and_tilt():
    amcl = Amcl(AmclParams(), seed=1)
    amcl.set_map(ROOM, PoseEstimate(Pose2D(1.0, 1.0), 1e-6 * np.eye(3)))
    tilted = Pose3D(0.5, 0.2, 1.2, quaternion_from_euler(0.1, 0.05, 0.3))
    scan = Scan(0.0, -math.pi, math.pi / 8, 0.02, 60.0, np.full(16, 1.0, np.float32))
    amcl.update(Observation("lidar", scan, Pose3D(0.0, 0.0, 0.06), tilted))
    found = amcl.map_from_odom.compose(tilted)
    assert found.z_m == pytest.approx(1.2)
    assert found.rotation[2] == pytest.approx(tilted.rotation[2])
    assert (found.x_m, found.y_m) == pytest.approx((1.0, 1.0), abs=0.01)


CARRIED = Pose2D(4.5, 2.6, -1.0)
AT_ZERO = Pose2D(0.0, 0.0)
ALL_OVER = 60  # scans, of 4,000 random poses each: more than a search of this room needs


def carried_away(grid, is_begun, params=QUICK):
    """Return a robot that was carried by 3 m, or that was told a place 3 m off, after one scan."""
    amcl = localizer(params, grid=grid)
    if is_begun:
        amcl.update(seen(START, AT_ZERO, scan_from(START, grid=grid)))
        assert not amcl.is_lost
    amcl.update(seen(CARRIED, AT_ZERO, scan_from(CARRIED, grid=grid)))
    return amcl


@pytest.mark.parametrize("is_begun", [True, False], ids=["kidnapped", "told a wrong place"])
def test_a_robot_whose_scans_do_not_fit_is_lost_at_once_and_finds_its_place(is_begun):
    amcl = carried_away(ROOM, is_begun)
    assert amcl.is_lost and amcl.fit < 0.5
    for _ in range(ALL_OVER):
        amcl.update(seen(CARRIED, AT_ZERO))
    assert not amcl.is_lost and amcl.fit > 0.9
    assert amcl.estimate.pose.distance_to(CARRIED) < 0.1
    assert amcl.estimate.pose.yaw_rad == pytest.approx(CARRIED.yaw_rad, abs=0.05)


def test_a_likelihood_field_of_few_centimetres_does_not_hide_that_a_robot_is_lost():
    amcl = carried_away(ROOM, True, replace(QUICK, laser_likelihood_max_dist_m=0.1))
    assert amcl.is_lost and amcl.fit < 0.5


def test_a_search_of_the_whole_map_begins_anywhere():
    amcl = localizer()
    amcl.set_uniform()
    assert amcl.is_lost
    for k in range(ALL_OVER):  # it drifts meanwhile
        amcl.update(seen(CARRIED, Pose2D(0.001 * k, 0.0), scan_from(CARRIED)))
    assert not amcl.is_lost
    assert amcl.estimate.pose.distance_to(CARRIED) < 0.1


def test_where_two_places_look_the_same_a_robot_stays_lost():
    """A room without boxes looks the same from the opposite place."""
    empty = room([])
    amcl = carried_away(empty, True)
    for _ in range(ALL_OVER):
        amcl.update(seen(CARRIED, AT_ZERO, scan_from(CARRIED, grid=empty)))
        assert amcl.is_lost
    assert amcl.search.is_complete and amcl.search.is_ambiguous
    turned = Pose2D(6.05 - CARRIED.x_m, 4.05 - CARRIED.y_m, CARRIED.yaw_rad + math.pi)
    best = [Pose2D(*row) for row in amcl.search.poses[:2].tolist()]
    assert min(one.distance_to(CARRIED) for one in best) < 0.1
    assert min(one.distance_to(turned) for one in best) < 0.1
    amcl.set_pose(estimate(CARRIED))
    amcl.update(seen(CARRIED, AT_ZERO, scan_from(CARRIED, grid=empty)))
    assert not amcl.is_lost, "a person told it"


@pytest.mark.parametrize("peer", [True, False], ids=["a peer", "a box that is not on the map"])
def test_what_hides_beams_does_not_make_a_robot_lost(peer):
    """Ten beams end on a peer, 0.8 m ahead; a box of 1 m, 0.4 m ahead, hides 21."""
    half, range_m = (5, 0.5) if peer else (10, 0.4)
    hidden = {k: range_m for k in range(BEAMS // 2 - half, BEAMS // 2 + half + 1)}
    peers = np.array([START.transform(0.8, 0.0)] if peer else []).reshape(-1, 2)
    amcl = localizer()
    amcl.update(seen(START))
    for _ in range(20):
        amcl.update(seen(START, scan=scan_from(START, hidden), peers=peers))
        assert not amcl.is_lost
    assert amcl.fit == pytest.approx(1.0 if peer else 1.0 - 21 / 72, abs=0.1)
