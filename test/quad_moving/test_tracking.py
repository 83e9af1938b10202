"""Tracking of moving obstacles: in scans made by hand, and in flights against the truth."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from quad_moving.moving_points import TrackerParams
from quad_moving.tracker import Tracker
from quad_nav.config.plugins import Parameters
from quad_nav.geometry import Pose3D, Scan, quaternion_from_yaw

BEAMS = 512
STEP_RAD = 2.0 * math.pi / BEAMS
ON = TrackerParams(range_m=10.0, lost_after_s=1.5)
LIDAR = Pose3D(0.0, 0.0, 1.0)
ROOM = (-6.0, -6.0, 6.0, 6.0)


def pose_at(x_m, y_m, yaw_rad=0.0):
    return Pose3D(x_m, y_m, 1.0, quaternion_from_yaw(yaw_rad))


def scan_of(stamp_s, discs=(), pose=LIDAR, room=ROOM, noise_m=0.0, seed=0):
    """Cast beams at upright discs (x, y, radius) in a room (min x, min y, max x, max y)."""
    angles = -math.pi + STEP_RAD * np.arange(BEAMS)
    along = np.column_stack([np.cos(angles), np.sin(angles)]) @ pose.rotation[:2, :2].T
    level = np.hypot(*along.T)
    along /= level[:, None]
    here = np.array([pose.x_m, pose.y_m])
    with np.errstate(divide="ignore"):
        far = np.where(along > 0, np.array(room[2:]) - here, here - np.array(room[:2]))
        far = far / np.abs(along)
    ranges = far.min(axis=1)
    for x_m, y_m, radius_m in discs:
        off = np.array([x_m, y_m]) - here
        middle = along @ off
        depth = middle**2 - off @ off + radius_m**2
        hit = middle - np.sqrt(np.maximum(depth, 0.0))
        ranges = np.where((depth >= 0.0) & (hit > 0.0), np.minimum(ranges, hit), ranges)
    ranges = ranges / level + noise_m * np.random.default_rng([seed, round(1e6 * stamp_s)]).normal(
        size=BEAMS
    )
    return Scan(stamp_s, -math.pi, STEP_RAD, 0.02, 60.0, ranges.astype(np.float32))


def new_tracker(params=ON):
    tracker = Tracker(Parameters({}, "tracker"))
    tracker.params = params
    return tracker


def track(discs_at, times_s, pose_of=lambda _: LIDAR, params=ON, noise_m=0.0):
    """Yield time, result and tracker after each scan of discs that move."""
    tracker = new_tracker(params)
    for time_s in times_s:
        pose = pose_of(time_s)
        scan = scan_of(time_s, discs_at(time_s), pose, noise_m=noise_m)
        yield time_s, tracker.add_scan("scan", scan, pose), tracker


def times(until_s, rate_hz=10.0):
    return np.arange(round(until_s * rate_hz) + 1) / rate_hz


PILLARS = ((2.0, 1.0, 0.3), (3.0, -2.0, 0.5), (-2.0, 2.5, 0.1), (-3.0, -3.0, 0.4))


@pytest.mark.parametrize("speed_mps", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("rate_hz", [10.0, 20.0])
def test_a_crossing_cylinder_is_tracked(speed_mps, rate_hz):
    errors, confirmed_s = [], math.nan
    for now_s, _, tracker in track(
        lambda t: ((3.0, -4.0 + speed_mps * t, 0.3),), times(7.0 / speed_mps, rate_hz)
    ):
        if len(tracker.known):
            confirmed_s = min(confirmed_s, now_s) if confirmed_s == confirmed_s else now_s
            truth = (3.0, -4.0 + speed_mps * now_s, 0.0, speed_mps)
            errors.append(np.abs(tracker.known.states[0] - truth))
            assert len(tracker.known) == 1 and tracker.known.numbers[0] == 1
    assert confirmed_s <= 0.4 + 0.3 / speed_mps
    settled = np.array(errors[round(rate_hz) :])
    assert settled[:, :2].max() < 0.05 and settled[:, 2:].max() < 0.15
    assert tracker.known.radii_m[0] == pytest.approx(0.3, abs=0.05)


@pytest.mark.parametrize("older_s", [0.005, 0.03, 0.09, 0.2])
@pytest.mark.parametrize("speed_mps", [0.5, 1.0, 2.0])
def test_two_lidars_measure_one_speed(speed_mps, older_s):
    """The scans of the second LIDAR come at the same time as those of the first, but are older."""

    def disc_at(now_s):
        return ((3.0, -4.0 + speed_mps * now_s, 0.3),)

    tracker, errors = new_tracker(), []
    for now_s in times(7.0 / speed_mps):
        for sensor, stamp_s in (("front", now_s), ("back", now_s - older_s)):
            if stamp_s >= 0.0:
                tracker.add_scan(sensor, scan_of(stamp_s, disc_at(stamp_s)), LIDAR)
                if len(tracker.known):
                    truth = (*disc_at(tracker.known.time_s)[0][:2], 0.0, speed_mps)
                    errors.append(tracker.known.states[0] - truth)
                    assert tracker.known.numbers.tolist() == [1]
    settled = np.abs(errors[20:])
    assert settled[:, :2].max() < 0.05 and settled[:, 2:].max() < 0.15
    assert abs(np.mean(errors[20:], axis=0)[3]) < 0.02 * speed_mps


@pytest.mark.parametrize("noise_m", [0.0, 0.02])
@pytest.mark.parametrize("rate_hz", [5.0, 20.0])
def test_standing_things_do_not_move_for_a_lidar_that_flies_and_turns(noise_m, rate_hz):
    def pose_of(t):
        return pose_at(-1.0 + 0.5 * t, 0.5 * math.sin(t), 0.6 * math.sin(0.7 * t))

    for _, _, tracker in track(lambda _: PILLARS, times(12.0, rate_hz), pose_of, noise_m=noise_m):
        assert len(tracker.known) == 0


def test_a_field_of_thin_pillars_does_not_move():
    """As in BARN: pillars of 0.075 m with gaps, seen from between them."""
    random = np.random.default_rng(0)
    places = random.uniform(-5.5, 5.5, (120, 2))
    pillars = [(x_m, y_m, 0.075) for x_m, y_m in places if abs(y_m) > 0.6]

    def pose_of(t):
        return pose_at(-5.0 + 0.7 * t, 0.2 * math.sin(t), 0.5 * math.sin(1.3 * t))

    for _, _, tracker in track(lambda _: pillars, times(12.0, 20.0), pose_of, noise_m=0.01):
        assert len(tracker.known) == 0


@pytest.mark.parametrize("x_m, yaw_rad", [(0.4, 0.0), (0.0, 1.0)])
def test_jumps_of_the_pose_move_nothing(x_m, yaw_rad):
    """The localisation of a LIDAR that stands is corrected every second."""
    tracker = new_tracker()
    for now_s in times(6.0):
        jumps = int(now_s)
        pose = pose_at(jumps * x_m, 0.0, jumps * yaw_rad)
        tracker.add_scan("scan", scan_of(now_s, PILLARS), pose)
        assert len(tracker.known) == 0


def test_an_obstacle_that_passes_behind_a_pillar_keeps_its_number():
    numbers, hidden_s = [], []
    for now_s, _, tracker in track(lambda t: ((2.0, 0.0, 0.3), (4.0, -3.0 + t, 0.25)), times(6.0)):
        if now_s > 1.0:
            numbers += tracker.known.numbers.tolist()
            assert len(tracker.known) == 1
            hidden_s.append(abs(-3.0 + now_s) < 0.3)
            assert tracker.known.states[0, 1] == pytest.approx(-3.0 + now_s, abs=0.15)
    assert set(numbers) == {1} and any(hidden_s)


def test_who_comes_out_of_a_long_shadow_is_tracked_where_it_was_free_long_ago():
    """One stands at (2, 0) from 4 s to 10 s and hides the other; the shadow is 2.5 m wide there."""

    def discs_at(t):
        hider = (2.0, min(t - 4.0, 0.0) - 2.0 * max(t - 10.0, 0.0), 0.5)
        return (hider, (5.0, 10.0 - t, 0.25)) if t >= 9.5 else (hider,)

    for now_s, _, tracker in track(discs_at, times(10.9, 20.0)):
        seen = np.hypot(*(tracker.known.states[:, :2] - (5.0, 10.0 - now_s)).T) < 0.2
    assert seen.any()


def test_an_obstacle_that_stops_becomes_a_standing_one():
    moving = {}
    for now_s, result, tracker in track(lambda t: ((3.0, -2.0 + min(t, 2.0), 0.3),), times(6.0)):
        moving[round(now_s, 1)] = len(tracker.known)
        last = result
    assert moving[2.0] == 1 and moving[6.0] == 0
    ended_s = max(time_s for time_s, count in moving.items() if count)
    assert 2.5 < ended_s < 5.0
    assert not last.any_moving  # its beams mark again


def test_moving_beams_are_those_on_confirmed_tracks():
    *_, (now_s, result, _) = track(lambda t: ((3.0, -2.0 + t, 0.3), *PILLARS), times(2.0))
    scan = scan_of(now_s, ((3.0, 0.0, 0.3),), room=(-100.0, -100.0, 100.0, 100.0))
    np.testing.assert_array_equal(result.moving_beams, scan.ranges_m < 4.0)


def test_known_peers_are_not_tracked_and_lost_ones_are():
    tracker = new_tracker()
    for now_s in times(4.0):
        y_m = -2.0 + now_s
        known = np.array([(3.0, y_m, 0.5)]) if now_s < 2.0 else np.empty((0, 3))
        scan = scan_of(now_s, ((3.0, y_m, 0.3),))
        tracker.add_scan("scan", scan, LIDAR, known_circles=known)
        assert now_s > 2.0 or len(tracker.known) == 0
    assert tracker.known.states[0, 3] == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("lost_after_s", [0.5, 1.5, 4.0])
def test_a_track_ends_by_the_clock(lost_after_s):
    """Nothing scans after 3 s."""
    params = replace(ON, lost_after_s=lost_after_s)
    *_, (_, _, tracker) = track(lambda t: ((3.0, -3.0 + t, 0.3),), times(3.0), params=params)
    number = tracker.known.numbers.tolist()
    tracker.tracks(3.0 + lost_after_s)
    assert tracker.known.numbers.tolist() == number and len(tracker.known.unseen_s) == 1
    tracker.tracks(3.01 + lost_after_s)
    assert not tracker.known.any_may_move and len(tracker.known.unseen_s) == 0


@pytest.mark.parametrize("back_s", [0.5, 100.0])
def test_a_lidar_whose_clock_is_set_back_goes_on(back_s):
    tracker = new_tracker()
    for now_s in times(5.0):
        stamp_s = 200.0 + now_s - (back_s if now_s >= 2.0 else 0.0)
        tracker.add_scan("scan", scan_of(stamp_s, ((3.0, -3.0 + now_s, 0.3),)), LIDAR)
    np.testing.assert_allclose(tracker.known.states, [(3.0, 2.0, 0.0, 1.0)], atol=0.1)


def test_covariances_are_honest():
    """With the noise and accelerations that the tracker assumes the mean NEES is 4, or less.

    Errors that stay from scan to scan are allowed for.
    """
    random = np.random.default_rng(7)
    nees = []
    for run in range(12):
        velocity = random.normal(0.0, 0.5, 2) + (0.0, 1.0)
        path, place = [], np.array([3.0, -3.0])
        for _ in times(6.0):
            path.append((*place, *velocity))
            change = 0.1 * ON.acceleration_mps2 * random.normal(size=2)
            place, velocity = place + 0.1 * velocity + 0.05 * change, velocity + change
        tracker = new_tracker()
        for k, now_s in enumerate(times(6.0)):
            x_m, y_m = path[k][:2]
            if not (1.0 < x_m < 5.5 and abs(y_m) < 5.5):
                break
            scan = scan_of(now_s, ((x_m, y_m, 0.3),), noise_m=0.02, seed=run)
            tracker.add_scan("scan", scan, LIDAR)
            if len(tracker.known) == 1:
                off = tracker.known.states[0] - path[k]
                nees.append(off @ np.linalg.solve(tracker.known.covariances[0], off))
    assert len(nees) > 150
    assert 1.0 < np.mean(nees) < 5.0
    assert np.mean(np.array(nees) < 9.49) > 0.95  # chi-square with 4 degrees of freedom


def tilted(pitch_rad):
    return Pose3D(0.0, 0.0, 1.0, (0.0, math.sin(pitch_rad / 2.0), 0.0, math.cos(pitch_rad / 2.0)))


def test_a_wall_that_comes_into_view_behind_a_pillar_does_not_move():
    """The pillar's shadow sweeps over the walls and uncovers a post."""
    for _, _, tracker in track(
        lambda _: ((2.0, 0.0, 0.5), (4.0, 0.3, 0.1)),
        times(8.0),
        lambda t: pose_at(0.0, -2.0 + 0.5 * t),
    ):
        assert len(tracker.known) == 0


def test_a_lidar_that_tilts_and_looks_over_an_obstacle_does_not_lose_it():
    """At 5 m its beams are 1 m above the level."""
    tracks = {}
    for now_s, _, tracker in track(
        lambda t: ((5.0, -2.0 + t, 0.3),) if t < 2.0 else (),
        times(2.6, 20.0),
        lambda t: tilted(-0.2 if t >= 2.0 else 0.0),
    ):
        tracks[round(now_s, 2)] = tracker.known
    assert tracks[2.6].numbers.tolist() == tracks[1.9].numbers.tolist() == [1]
    assert tracks[2.6].states[0, 1] == pytest.approx(0.6, abs=0.1)
