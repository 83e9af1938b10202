"""Periodic motion: obstacles that repeat their motion are known beforehand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.control.prediction import predict
from quad_nav.tracking.motion_memory import MotionMemory
from quad_nav.tracking.period_votes import (
    NEAR,
    ODD,
    ONE_TURN,
    SUPPORT,
    Votes,
    first_turns,
    sums_of_turns,
)
from quad_nav.tracking.periodic_motion import PeriodicMotion, multiples
from quad_nav.tracking.periodic_motion_kernel import (
    NONE,
    Trails,
    drop_repeats,
    follow_replays,
    forget_after,
    replay_all,
)
from quad_nav.tracking.tracks import Tracks
from quad_nav.tracking.trail_links import continued_trails, link

PERIOD_S, RADIUS_M = 20.0, 3.0
AHEAD_S = np.arange(0.0, 6.05, 0.5)


def circling(time_s):
    """Return the state of an obstacle on a circle of 3 m, 0.94 m/s."""
    angle, rate = 2.0 * math.pi * time_s / PERIOD_S, 2.0 * math.pi / PERIOD_S
    x, y = RADIUS_M * math.cos(angle), RADIUS_M * math.sin(angle)
    return [x, y, -rate * y, rate * x]


def watched(until_s, state=circling, hidden=lambda time_s: False):
    """Watch an obstacle whose track has another number every 1.5 s."""
    motion = PeriodicMotion()
    for k in range(round(until_s * 10) + 1):
        seen = 0 if hidden(0.1 * k) else 1
        states = np.array([state(0.1 * k)])[:seen]
        motion.add(0.1 * k, np.array([k // 15])[:seen], states, np.array([0.4])[:seen])
    return motion


def places(times_s):
    return np.array([circling(time_s)[:2] for time_s in times_s])


def known_places(replays):
    """Return the only place at each time."""
    known = np.isfinite(replays.places[:, :, 0])
    assert (known.sum(axis=1) == 1).all()
    return replays.places[known]


@pytest.mark.slow
def test_an_obstacle_is_where_it_was_a_period_ago():
    replays = watched(60.0).replay(60.0 + AHEAD_S)
    np.testing.assert_allclose(known_places(replays), places(60.0 + AHEAD_S), atol=0.02)
    assert set(replays.radii_m.tolist()) == {0.4}


def test_in_its_first_period_nothing_is_known():
    motion = watched(19.0)
    assert motion.is_empty
    assert motion.replay(19.0 + AHEAD_S).places.shape[1] == 0


def test_a_hidden_obstacle_is_known_too():
    """Nothing is seen from 60 s on."""
    motion = watched(70.0, hidden=lambda time_s: time_s > 60.0)
    np.testing.assert_allclose(
        known_places(motion.replay(70.0 + AHEAD_S)), places(70.0 + AHEAD_S), atol=0.02
    )


def test_where_it_is_always_hidden_nothing_is_known():
    """It is hidden for 6 s of each period, longer than a trail counts beyond its ends."""
    motion = watched(80.0, hidden=lambda time_s: time_s % PERIOD_S > 14.0)
    replays = motion.replay(np.array([81.0, 97.0]))
    known = np.isfinite(replays.places[:, :, 0]).any(axis=1)
    assert known.tolist() == [True, False]


def test_an_obstacle_that_wanders_has_no_period():
    rng = np.random.default_rng(3)
    speeds = rng.normal(0.0, 0.8, (200, 2))

    def wandering(time_s):
        at = int(time_s)
        place = speeds[:at].sum(axis=0) + (time_s - at) * speeds[at]
        return [*place, *speeds[at]]

    assert watched(90.0, wandering).is_empty


def people_who_wander(rng, count, until_s):
    """Return the states at each 0.1 s of people who walk to random places in a square of 12 m."""
    states, stamps_s = [], np.arange(0.0, until_s + 0.05, 0.1)
    for _ in range(count):
        ways = rng.uniform(-6.0, 6.0, (400, 2))
        legs = np.diff(ways, axis=0)
        speeds_mps = rng.uniform(0.5, 1.5, len(legs))
        begins_s = np.cumsum(np.append(0.0, np.hypot(*legs.T) / speeds_mps))
        leg = np.searchsorted(begins_s, stamps_s, side="right") - 1
        velocities = legs[leg] / (begins_s[leg + 1] - begins_s[leg])[:, None]
        places = ways[leg] + (stamps_s - begins_s[leg])[:, None] * velocities
        states.append(np.concatenate([places, velocities], axis=1))
    return np.array(states).transpose(1, 0, 2)


@pytest.mark.slow
def test_among_people_who_wander_only_a_shuttle_has_a_period():
    """After five minutes of ten people, each of whom passes where others were many times."""
    motion, people = PeriodicMotion(), people_who_wander(np.random.default_rng(0), 10, 300.0)
    for k, states in enumerate(people):
        states = np.concatenate([states, [circling(0.1 * k)]])
        motion.add(0.1 * k, np.arange(11) + 11 * (k // 15), states, np.full(11, 0.3))
    assert not motion.most_repeat
    replays = motion.replay(300.0 + AHEAD_S)
    np.testing.assert_allclose(known_places(replays), places(300.0 + AHEAD_S), atol=0.02)


def test_one_of_three_obstacles_that_repeats_its_motion_is_not_most():
    """One obstacle circles, two fly straight on."""
    motion = PeriodicMotion()
    for k in range(601):
        straight = [[0.05 * k, y, 0.5, 0.0] for y in (10.0, 20.0)]
        states = np.array([circling(0.1 * k), *straight])
        motion.add(0.1 * k, np.arange(3) + 3 * (k // 15), states, np.full(3, 0.4))
    assert not motion.is_empty
    assert not motion.most_repeat


@pytest.mark.slow
def test_a_full_memory_learns_anew():
    """100 tracks at 10 Hz fill it in 60 s."""
    motion = PeriodicMotion()
    for k in range(605):
        if k == 599:
            assert not motion.is_empty
        states = np.array([circling(0.1 * k)] * 100)
        motion.add(0.1 * k, np.arange(100), states, np.full(100, 0.4))
    assert motion.is_empty


def seen_tracks(time_s, states):
    """Return tracks numbered from 7 on that are seen well."""
    n = len(states)
    return Tracks(
        time_s, np.arange(7, 7 + n), np.array(states), np.zeros((n, 4, 4)), np.full(n, 0.4)
    )


def test_motion_memory_replays_what_it_has_seen_well():
    memory = MotionMemory()
    for k in range(601):
        memory.add(seen_tracks(0.1 * k, [circling(0.1 * k)]))
    replays = memory.replay(60.0 + AHEAD_S)
    np.testing.assert_allclose(known_places(replays), places(60.0 + AHEAD_S), atol=0.02)
    assert memory.most_repeat
    memory.reset()
    assert not memory.most_repeat
    assert memory.replay(60.0 + AHEAD_S).places.shape[1] == 0


def trails_of(samples, spans, period_s):
    """Return trails of consecutive samples, float64[n, 5], between first and last rows."""
    later = np.array([k + 1 for k in range(len(samples))])
    later[[last for _, last in spans]] = NONE
    count = len(spans)
    owners = np.concatenate([np.full(b + 1 - a, k) for k, (a, b) in enumerate(spans)])
    return Trails(
        np.array(samples, float),
        later,
        owners,
        np.array(spans),
        np.full(count, period_s),
        np.full(count, NONE),
        np.zeros(count),
    )


def test_a_trail_is_replayed_a_whole_number_of_periods_later():
    """Samples at 0 and 1 s, 1 m/s, period 10 s; 0.3 s beyond the ends count."""
    trails = trails_of([[0, 0, 0, 1, 0], [1, 1, 0, 1, 0]], [(0, 1)], 10.0)
    times = np.array([19.5, 19.75, 20.5, 21.25, 21.5])
    found, velocities = np.empty((5, 4, 2)), np.empty((5, 4, 2))
    owners = np.empty(4, np.int64)
    assert replay_all(trails, times, 0.3, found, velocities, owners) == 1
    np.testing.assert_allclose(
        found[:, 0, 0], [math.nan, -0.25, 0.5, 1.25, math.nan], equal_nan=True
    )
    np.testing.assert_allclose(velocities[1:4, 0], [[1.0, 0.0]] * 3)


@pytest.mark.parametrize(
    "begin_s, place_m, gap_s",
    [(3.0, 3.0, 2.0), (33.0, 3.0, 2.0), (5.0, 5.0, 0.0), (3.0, 8.0, 0.0), (0.5, 0.5, 0.0)],
    ids=["2 s later", "periods later", "too long", "too far", "it goes on"],
)
def test_a_trail_leads_to_the_one_after_the_gap(begin_s, place_m, gap_s):
    """At 1 m/s; the first ends at 1 s and 1 m, the other begins at a time and a place."""
    rows = [[0, 0, 0, 1, 0], [1, 1, 0, 1, 0]]
    rows += [[begin_s + k, place_m + k, 0, 1, 0] for k in range(2)]
    trails = trails_of(rows, [(0, 1), (2, 3)], 10.0)
    link(trails, 0.1, 3.0, (0.4, 1.2))
    assert trails.nexts[0] == (1 if gap_s else NONE)
    assert trails.gaps[0] == pytest.approx(gap_s)


def test_a_gap_is_replayed_as_a_cubic():
    """Around a corner in 2 s at 1 m/s: half of the way is at (0.75, 0.25) from (0, 0) to (1, 1)."""
    rows = [[0, -1, 0, 1, 0], [1, 0, 0, 1, 0], [3, 1, 1, 0, 1], [4, 1, 2, 0, 1]]
    trails = trails_of(rows, [(0, 1), (2, 3)], 10.0)
    link(trails, 0.1, 3.0, (0.4, 1.2))
    found, velocities = np.empty((1, 4, 2)), np.empty((1, 4, 2))
    replay_all(trails, np.array([12.0]), 0.3, found, velocities, np.empty(4, np.int64))
    np.testing.assert_allclose(found[0, 0], [0.75, 0.25])
    np.testing.assert_allclose(velocities[0, 0], [0.5, 0.5])


def test_a_multiple_of_a_period_is_none():
    """Trails 0 to 4 vote for 10 and 20 s; trails 5 to 9 for 60 s, which is 3 times 20 by chance."""
    voters = np.zeros((10, 3), bool)
    voters[:5, :2], voters[5:, 2] = True, True
    found = multiples(np.array([10.0, 20.0, 60.0]), voters)
    assert found.tolist() == [False, True, False]


def test_votes_count_for_every_number_of_turns():
    """Trail 0 votes 3 times for 10.02 s, once for 30 s; trail 1 twice for 20.1 s, once for 14 s."""
    votes = Votes(
        np.array([10.02, 30.0, 20.1, 14.0]),
        np.array([3, 1, 2, 1]),
        np.array([0, 0, 1, 1]),
        np.full(4, NONE),
        np.zeros(2, np.int64),
    )
    lag_counts, by_trail = first_turns(votes, 4, np.array([10.0, 20.1]), (0.05, 0.03))
    assert lag_counts.tolist() == [1, 1]
    assert by_trail.tolist() == [[3.0, 0.0], [0.0, 2.0]]
    sums = sums_of_turns(votes, 4, np.array([10.0]), (0.05, 0.03))[:, :, 0]
    expected = np.empty((4, 2))
    expected[NEAR] = 3.0 + 1.0 / 3.0, 2.0 / 2.0
    expected[SUPPORT] = 4.0, 2.0
    expected[ONE_TURN] = 3.0 * 10.02 + 30.0 / 3.0, 2.0 * 20.1 / 2.0
    expected[ODD] = 4.0, 0.0
    np.testing.assert_allclose(sums, expected, rtol=1e-12)


def test_a_trail_continues_the_one_that_leads_to_it():
    """Trail 0 ends at (1, 0) at 1 s with 1 m/s; at 2 s it would be at (2, 0)."""
    ends = [[0.0, 0.0], [1.0, 0.0], [2.1, 0.0], [3.0, 0.0], [2.3, 0.0], [4.0, 0.0], [8.0, 0.0]]
    stamps_s = [0.0, 1.0, 2.0, 3.0, 2.0, 4.0, 9.0]
    samples = np.array([[t, x, y, 1.0, 0.0] for t, (x, y) in zip(stamps_s, ends)])
    spans = np.array([[0, 1], [2, 3], [4, 5], [6, 6]])
    none = np.full(4, NONE)
    trails = Trails(samples, np.full(7, NONE), none, spans, np.zeros(4), none, np.zeros(4))
    limits = 0.2, 0.25  # 0.45 m after a second
    every = np.arange(4)
    assert continued_trails(trails, every[:1], every[1:], 1.5, limits).tolist() == [1]
    assert continued_trails(trails, every[1:], every[:1], 1.5, limits).tolist() == [0, 0, NONE]
    assert continued_trails(trails, every[1:], every[:1], 0.9, limits).tolist() == [NONE] * 3


@pytest.mark.slow
def test_an_obstacle_with_twice_the_period_of_others_is_not_where_half_a_period_leads():
    """Three obstacles with 10 s, and one with 20 s around (20, 0)."""
    motion = PeriodicMotion()
    for k in range(801):
        x, y, vx, vy = circling(0.1 * k)
        shorter = np.array(circling(0.2 * k)) * [1.0, 1.0, 2.0, 2.0]
        shorter = shorter + np.array(
            [[0.0, 0.0, 0.0, 0.0], [0.0, 20.0, 0.0, 0.0], [0.0, -20.0, 0.0, 0.0]]
        )
        states = np.concatenate([shorter, [[x + 20.0, y, vx, vy]]])
        motion.add(0.1 * k, np.arange(4) + 4 * (k // 15), states, np.full(4, 0.4))
    replays = motion.replay(80.0 + AHEAD_S)
    for k, (x, y) in enumerate(places(80.0 + AHEAD_S)):
        there = replays.places[k, replays.places[k, :, 0] > 10.0]
        np.testing.assert_allclose(there, [[x + 20.0, y]], atol=0.02)


def test_replays_of_one_obstacle_count_once():
    found = np.array([[[0.0, 0.0], [0.3, 0.0], [0.6, 0.0]], [[0.0, 0.0], [5.0, 0.0], [5.0, 0.5]]])
    radii = np.array([0.9, 0.5, 0.7])
    drop_repeats(found, radii, 0.4)
    assert radii.tolist() == [0.5, 0.5, 0.7]  # one that looked larger, beside another one
    assert np.isnan(found[:, :, 0]).tolist() == [[False, True, False], [False, False, False]]


@pytest.mark.parametrize(
    "speed, expected",
    [(1.0, [1e6, 1e6, 2.0, 1e6]), (-1.0, [0.0, -1.0, -2.0, -3.0])],
    ids=["its replay", "another motion"],
)
def test_a_track_leaves_its_place_to_its_replay(speed, expected):
    """The replay is known for 0 and 1 s; at 3 s another one is where the obstacle would be."""
    times = np.arange(4.0)
    discs = np.full((4, 1, 4), 0.5)
    discs[:, 0, 0], discs[:, 0, 1] = speed * times, 0.0
    nan = math.nan
    found = np.array(
        [
            [[0.1, 0.0], [nan, nan]],
            [[1.0, 0.0], [nan, nan]],
            [[nan, nan], [nan, nan]],
            [[nan, nan], [3.0, 0.0]],
        ]
    )
    velocities = np.full((4, 2, 2), [1.0, 0.0])
    follow_replays(discs, np.array([[speed, 0.0]]), found, velocities, times, (0.4, 0.8, 0.6), 1e6)
    np.testing.assert_allclose(discs[:, 0, 0], expected)


@pytest.mark.parametrize("turned_mps", [1.0, -1.0], ids=["goes on", "has turned"])
def test_a_track_follows_the_replay_that_begins_where_one_ends(turned_mps):
    """The first is known for 0 and 1 s, the other from 2 s on; it may have turned in between."""
    times = np.arange(5.0)
    discs = np.full((5, 1, 4), 0.5)
    discs[:, 0, 0], discs[:, 0, 1] = times, 0.0
    found, velocities = np.full((5, 2, 2), math.nan), np.full((5, 2, 2), math.nan)
    found[:2, 0], velocities[:2, 0] = [[0.0, 0.0], [1.0, 0.0]], [1.0, 0.0]
    found[2:, 1] = [[2.0 + turned_mps * k, 0.0] for k in range(3)]
    velocities[2:, 1] = [turned_mps, 0.0]
    follow_replays(discs, np.array([[1.0, 0.0]]), found, velocities, times, (0.4, 0.8, 0.6), 1e6)
    np.testing.assert_allclose(discs[:, 0, 0], 1e6)


def test_discs_without_a_replay_are_forgotten_after_a_while():
    """The first has none; the other has one until 2 s."""
    discs = np.zeros((6, 2, 4))
    discs[:3, 1, :2] = 1e6
    forget_after(discs, np.arange(6.0), 1.5, 1e6)
    assert (discs[:, 0, 0] == 1e6).tolist() == [False, False, True, True, True, True]
    assert (discs[:, 1, 0] == 1e6).tolist() == [True, True, True, False, True, True]


@pytest.mark.parametrize("is_new, known", [(True, False), (False, True)])
def test_where_most_obstacles_repeat_their_motion_others_are_known_for_a_while(is_new, known):
    """One obstacle has a period; two fly straight on, at the end or all the time."""
    memory = MotionMemory()
    for k in range(601):
        straight = [[0.1 * k - 80.0, 30.0 * n, 1.0, 0.0] for n in (1, 2)]
        tracks = seen_tracks(0.1 * k, [circling(0.1 * k), *straight])
        memory.add(tracks.chosen(np.array([True, *[k > 590 or not is_new] * 2])))
    discs = predict(tracks, memory, np.array([0.0, 1.0, 2.0]))
    np.testing.assert_allclose(discs[:2, 1, 0], [-20.0, -19.0])
    assert (abs(discs[2, 1, 0]) < 1e3) == known


@pytest.mark.parametrize("apart_m, known", [(0.39, False), (0.41, True)])
def test_where_most_obstacles_repeat_their_motion_a_track_that_holds_one_of_them_is_none(
    apart_m, known
):
    """A track with a radius of 0.4 m beside an obstacle with a period has another velocity."""
    memory = MotionMemory()
    for k in range(601):
        memory.add(seen_tracks(0.1 * k, [circling(0.1 * k)]))
    x, y, vx, vy = circling(60.0)
    tracks = seen_tracks(60.0, [[x + apart_m, y, -2.0 * vx, -2.0 * vy]])
    discs = predict(tracks, memory, np.array([0.0, 0.5]))
    assert (abs(discs[0, 0, 0]) < 1e3) == known


@pytest.mark.parametrize("spread_m, known", [(0.12, True), (0.13, False)])
def test_where_most_obstacles_repeat_their_motion_others_are_known_while_they_are_seen(
    spread_m, known
):
    memory = MotionMemory()
    for k in range(601):
        memory.add(seen_tracks(0.1 * k, [circling(0.1 * k)]))
    tracks = seen_tracks(60.0, [circling(60.0), [-20.0, 3.0, 1.0, 0.0]])
    tracks.covariances[1, :2, :2] = spread_m**2 * np.eye(2)
    discs = predict(tracks, memory, np.array([0.0, 1.0]))
    assert (abs(discs[:, 1, 0]) < 1e3).tolist() == [known, known]
