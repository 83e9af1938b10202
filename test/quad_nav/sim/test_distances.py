"""Clearances and separations that can be computed by hand."""

import numpy as np
import pytest

from quad_nav.geometry import Pose2D
from quad_nav.mission.distances import BLOCK_S, DistanceLog, nearest_separations_m
from quad_nav.sim.motion import Motion
from quad_nav.sim.movers import Movers
from quad_nav.sim.obstacles import Box, Cylinder
from quad_nav.sim.scene import MovingObstacle, Scene, Walls

RADIUS_M = 0.3


def add(log, name, *sample):
    log.add_tracks({name: [sample]})


def to_wall(positions_m, _times_s):
    """A wall along x = 0: the clearance of a centre is its x."""
    return positions_m[:, 0]


def logged(tracks, **options):
    """A log of poses in the order of their stamps."""
    log = DistanceLog(list(tracks), RADIUS_M, **options)
    for stamp_s, name, x_m, y_m in sorted(
        (sample[0], name, *sample[1:]) for name, track in tracks.items() for sample in track
    ):
        add(log, name, stamp_s, x_m, y_m)
    return log


def test_distances_are_between_hulls():
    log = DistanceLog(["quad0", "quad1", "quad2"], RADIUS_M, to_wall)
    add(log, "quad0", 0.0, 2.0, 0.0)
    add(log, "quad0", 1.0, 1.0, 0.0)
    add(log, "quad0", 2.0, 4.0, 0.0)
    add(log, "quad1", 1.0, 4.0, 4.0)
    assert log.min_clearance_m("quad0") == pytest.approx(0.7)
    # 3-4-5 triangle at 1 s; at 2 s quad0 would be nearer, but quad1 has no pose yet.
    assert log.min_separation_m("quad0") == pytest.approx(5.0 - 0.6)
    assert log.min_separation_m("quad1") == pytest.approx(5.0 - 0.6)
    add(log, "quad1", 2.0, 4.0, 1.0)
    assert log.min_separation_m("quad0") == pytest.approx(1.0 - 0.6)
    assert log.min_separation_m("quad2") is None


def test_positions_are_not_extrapolated():
    log = logged({"quad0": [(0.0, 0.0, 0.0), (1.0, 1.0, 0.0)], "quad1": [(1.5, 1.0, 0.1)]})
    assert log.min_separation_m("quad0") is None
    assert log.min_clearance_m("quad0") is None


def test_an_encounter_is_found_wherever_a_block_ends():
    """Two robots fly along lines 1 m apart and meet once."""
    stamps_s = np.arange(0.0, 3.2 * BLOCK_S, 0.25)
    for meeting_s in (0.0, BLOCK_S, BLOCK_S + 0.25, 1.7 * BLOCK_S, 3.0 * BLOCK_S):
        log = logged(
            {
                "quad0": [(t, t, 0.0) for t in stamps_s],
                "quad1": [(t + 0.125, 2 * meeting_s - (t + 0.125), 1.0) for t in stamps_s],
            }
        )
        expected = np.hypot(0.25, 1.0) if meeting_s == 0.0 else 1.0
        assert log.min_separation_m("quad1") == pytest.approx(expected - 0.6, abs=1e-9)


def test_a_late_encounter_is_found_after_others_were_closer():
    log = logged(
        {
            "quad0": [(0.0, 0.0, 0.0), (20.0, 0.0, 0.0)],
            "quad1": [(0.0, 1.0, 0.0), (20.0, 9.0, 0.0)],
            "quad2": [(0.0, 20.0, 0.0), (20.0, 0.9, 0.0)],
        }
    )
    assert log.min_separation_m("quad2") == pytest.approx(0.9 - 0.6)
    assert log.min_separation_m("quad0") == pytest.approx(0.9 - 0.6)
    # quad1 passes quad2 on the same line: 1 + 0.4 t = 20 - 0.955 t.
    assert log.min_separation_m("quad1") == pytest.approx(1.0 - 0.6)


def test_distances_in_a_scene():
    """A pillar of 0.5 m radius in the middle; two fly past it and each other."""
    pillar = Cylinder("pillar", 10.0, 10.0, 0.5, 2.0)
    scene = Scene("pillar", 20.0, 20.0, 1.0, Walls(), (pillar,), (Pose2D(1.0, 1.0),))
    log = logged(
        {
            "quad0": [(0.0, 10.0, 12.0), (1.0, 13.0, 10.0)],
            "quad1": [(0.0, 10.0, 17.0), (1.0, 17.0, 13.0)],
        },
        surface_distance=Movers(scene).flight_surface_distances_m,
    )
    # To the pillar 2 - 0.5 - 0.3; the second is nearest to the walls, 3 - 0.3 away.
    assert log.min_clearance_m("quad0") == pytest.approx(1.2)
    assert log.min_clearance_m("quad1") == pytest.approx(2.7)
    assert log.min_separation_m("quad0") == log.min_separation_m("quad1")
    assert log.min_separation_m("quad0") == pytest.approx(5.0 - 0.6)


@pytest.mark.parametrize(
    "bottom_m, height_m, clearance_m",
    [
        (0.0, 2.0, 0.2),
        (0.0, 0.93, 4.2),  # the hull is from 0.94 to 1.18 m high
        (0.0, 0.95, 0.2),
        (1.17, 0.1, 0.2),
        (1.19, 0.1, 4.2),
    ],
)
@pytest.mark.parametrize("moves", [False, True])
def test_only_what_the_hull_can_touch_counts(bottom_m, height_m, clearance_m, moves):
    """A box from x = 5.0 on, 0.5 m from the robot's centre, and a wall 4.5 m away."""
    box = Box("box", 5.5, 4.5, 1.0, 1.0, height_m, bottom_m=bottom_m)
    still = MovingObstacle(box, Motion((0.0,), ((5.5, 4.5, 0.0),)))
    solids, moving = ((), (still,)) if moves else ((box,), ())
    scene = Scene("room", 9.0, 9.0, 1.0, Walls(), solids, (), moving=moving)
    log = logged(
        {"quad0": [(0.0, 4.5, 4.5)]}, surface_distance=Movers(scene).flight_surface_distances_m
    )
    assert log.min_clearance_m("quad0") == pytest.approx(clearance_m)


def test_equal_stamps_and_interpolation_give_the_same_bits():
    """Offline all robots have one clock; the minima are those of the direct formula."""
    random = np.random.default_rng(1)
    positions_m = random.uniform(0.0, 9.0, (3, 1000, 2))
    stamps_s = np.arange(1000) / 40.0
    log = logged(
        {f"quad{k}": [(t, *place) for t, place in zip(stamps_s, positions_m[k])] for k in range(3)}
    )
    expected = nearest_separations_m(positions_m, RADIUS_M).min(axis=1)
    assert [log.min_separation_m(f"quad{k}") for k in range(3)] == expected.tolist()


def test_a_journal_gets_distances_before_their_block_ends():
    """1 m apart after 2 s; a block takes 10 s."""
    log = DistanceLog(["quad0", "quad1"], RADIUS_M)
    for k in range(81):
        add(log, "quad0", 0.025 * k, 0.0, 0.0)
        add(log, "quad1", 0.025 * k, 5.0 - 0.05 * k, 0.0)
    assert log.recent_minima_m("quad0") == (None, pytest.approx(1.0 - 0.6))
    add(log, "quad0", 2.025, 0.5, 0.0)
    add(log, "quad1", 2.025, 1.0, 0.0)
    assert log.recent_minima_m("quad0") == (None, pytest.approx(1.0 - 0.6))  # within a second
    assert log.min_separation_m("quad0") == pytest.approx(0.5 - 0.6)
