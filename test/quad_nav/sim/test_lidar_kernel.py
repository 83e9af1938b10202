"""The LIDAR's kernel: each shape by hand, and thousands of poses beside the physics engine."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Iterator

import numpy as np
import pybullet
import pytest

from quad_nav.geometry import Twist2D, quaternion_from_euler
from quad_nav.sim.body import World
from quad_nav.sim.casters import KernelCaster, WorldCaster
from quad_nav.sim.flight import Airframe, BodyState
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.lidar_kernel import Beams, SolidGrid, Solids, cast_scans
from quad_nav.sim.obstacles import Box, Cylinder
from quad_nav.sim.rays import BOX, CYLINDER, SPHERE
from quad_nav.sim.scene import Scene, Walls
from quad_nav.sim.scene_file import load_scene
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import SimulationParams
from quad_nav.sim.solids import grid_of, solids_of, split_scene

ARENA = load_scene(Path(__file__).parents[3] / "scenes" / "arena.yaml")
PARAMS = LidarParams(step_size_rad=2 * math.pi / 128)
NO_SOLIDS = solids_of([])
NO_GRID = grid_of(NO_SOLIDS, 1.0)
FAR_M = 60.0


def beams(*bearings_rad: float) -> Beams:
    """Beams that are a step apart; the first may be anywhere."""
    angles = np.array(bearings_rad)
    step = float(angles[1] - angles[0]) if len(angles) > 1 else 0.1
    return Beams(
        np.column_stack([np.cos(angles), np.sin(angles)]), float(angles[0]), step, 0.02, FAR_M
    )


def cast(
    solids: Solids, origin, pattern: Beams, *, pitch_rad: float = 0.0, grid: SolidGrid = NO_GRID
) -> np.ndarray:
    """Ranges of one LIDAR whose nose is down by the pitch."""
    cos, sin = math.cos(pitch_rad), math.sin(pitch_rad)
    rotation = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    ranges = np.empty((1, len(pattern.directions)))
    cast_scans(np.array([origin], float), rotation[None], pattern, solids, grid, ranges)
    return ranges[0]


def solid(kind: int, centre, sizes, rotation=((1, 0, 0), (0, 1, 0), (0, 0, 1))) -> Solids:
    return Solids(
        np.array([kind]),
        np.array([centre], float),
        np.array([rotation], float),
        np.array([sizes], float),
    )


AHEAD = beams(0.0)
QUARTERS = beams(-math.pi, -math.pi / 2, 0.0, math.pi / 2)
ON_ITS_SIDE = ((1, 0, 0), (0, 0, 1), (0, -1, 0))  # the solid's z axis is map's -y


def test_the_floor_is_seen_by_beams_that_look_down():
    ranges = cast(NO_SOLIDS, (0, 0, 1.5), QUARTERS, pitch_rad=0.3)
    assert ranges[2] == pytest.approx(1.5 / math.sin(0.3))
    assert np.isinf(ranges[[0, 1, 3]]).all()
    assert np.isinf(cast(NO_SOLIDS, (0, 0, 1.5), QUARTERS, pitch_rad=0.02)).all()  # 75 m


def test_a_box_turned_by_an_eighth():
    """Its corner is sqrt(2) from its centre; 0.5 m beside it a face is 0.5 m further."""
    box = solids_of([Box("box", 5.0, 0.0, 2.0, 2.0, 2.0, math.pi / 4)])
    assert cast(box, (0, 0, 1), AHEAD)[0] == pytest.approx(5 - math.sqrt(2))
    assert cast(box, (0, 0.5, 1), AHEAD)[0] == pytest.approx(5 - math.sqrt(2) + 0.5)
    assert np.isinf(cast(box, (0, 1.42, 1), AHEAD)[0])


def test_a_low_box_is_seen_by_a_tilted_lidar_alone():
    """From 1 m up, a beam that sinks by 0.2 m each metre meets the top, 0.5 m up, at x = 2.5."""
    box = solids_of([Box("box", 3.0, 0.0, 2.0, 2.0, 0.5)])
    assert np.isinf(cast(box, (0, 0, 1), AHEAD)[0])
    pitch = math.atan(0.2)
    assert cast(box, (0, 0, 1), AHEAD, pitch_rad=pitch)[0] == pytest.approx(math.hypot(2.5, 0.5))
    assert cast(box, (2.2, 0, 1), AHEAD, pitch_rad=pitch)[0] == pytest.approx(
        math.hypot(5.0, 1.0)
    )  # beyond the box, on the floor


def test_an_upright_cylinder():
    pillar = solids_of([Cylinder("pillar", 5.0, 0.0, 0.5, 2.0)])
    assert cast(pillar, (0, 0, 1), AHEAD)[0] == pytest.approx(4.5)
    assert cast(pillar, (0, 0.3, 1), AHEAD)[0] == pytest.approx(5 - 0.4)
    assert np.isinf(cast(pillar, (0, 0.501, 1), AHEAD)[0])
    assert np.isinf(cast(pillar, (0, 0, 2.1), AHEAD)[0])
    # Sinking by 0.05 m per metre from 2.24 m, it reaches the top at x = 4.8.
    assert cast(pillar, (0, 0, 2.24), AHEAD, pitch_rad=math.atan(0.05))[0] == pytest.approx(
        math.hypot(4.8, 0.24)
    )


def test_a_cylinder_on_its_side():
    """Across the beam, its half height is what it has to the left; a tilted one in between."""
    log = solid(CYLINDER, (5, 0, 1), (0.5, 0.5, 2.0), ON_ITS_SIDE)
    assert cast(log, (0, 1.9, 1), AHEAD)[0] == pytest.approx(4.5)
    assert cast(log, (0, 1.9, 1.3), AHEAD)[0] == pytest.approx(4.6)
    assert np.isinf(cast(log, (0, 2.1, 1), AHEAD)[0])
    tilt = 0.2
    cos, sin = math.cos(tilt), math.sin(tilt)
    guard = solid(CYLINDER, (5, 0, 1), (0.3, 0.3, 0.12), ((cos, 0, -sin), (0, 1, 0), (sin, 0, cos)))
    assert cast(guard, (0, 0, 1), AHEAD)[0] == pytest.approx(5 - 0.3 / cos)


def test_a_sphere():
    ball = solid(SPHERE, (5, 0, 1), (0.5, 0.5, 0.5))
    assert cast(ball, (0, 0, 1), AHEAD)[0] == pytest.approx(4.5)
    assert cast(ball, (0, 0.3, 1), AHEAD)[0] == pytest.approx(4.6)
    assert cast(ball, (0, 0, 1.4), AHEAD)[0] == pytest.approx(4.7)
    assert np.isinf(cast(ball, (0, 0, 1.51), AHEAD)[0])


@pytest.mark.parametrize("kind", [BOX, CYLINDER, SPHERE])
@pytest.mark.parametrize("size", [0.015, 0.5])
def test_a_solid_around_the_lidar_is_not_seen(kind, size):
    """Nor one that ends before the beams begin, at 0.02 m."""
    around = solid(kind, (3.0, 3.0, 1.0), (size, size, size))
    assert np.isinf(cast(around, (3.0, 3.0, 1.0), QUARTERS)).all()


def test_nothing_beyond_the_range():
    assert np.isinf(cast(solids_of([Box("box", 61.0, 0.0, 1.0, 1.0, 2.0)]), (0, 0, 1), AHEAD)[0])


@pytest.mark.parametrize("bearing", np.linspace(-math.pi, math.pi, 17))
@pytest.mark.parametrize("span", [2 * math.pi, math.pi, 2.0])
def test_a_pillar_is_seen_at_every_bearing_that_the_lidar_has(bearing, span):
    """The sector wraps around; beams off by less than asin(0.5 / 5) see it, and no others."""
    params = LidarParams(scan_range_rad=span, step_size_rad=span / 100)
    angles = params.angle_min_rad + params.step_size_rad * np.arange(100)
    x, y = 5 * math.cos(bearing), 5 * math.sin(bearing)
    ranges = cast(solids_of([Cylinder("pillar", x, y, 0.5, 2.0)]), (0, 0, 1), beams(*angles))
    off = np.abs(np.angle(np.exp(1j * (angles - bearing))))
    assert np.isfinite(ranges).tolist() == (off < math.asin(0.1)).tolist()


@pytest.mark.parametrize("span, count", [(2 * math.pi, 128), (1.0, 101), (math.pi, 130)])
def test_the_grid_gives_the_same_ranges(span, count):
    """Obstacles of any size, tilted LIDARs inside and outside of what the grid holds.

    The grid tries every solid near a beam: a sector that is too narrow shows.
    """
    random = np.random.default_rng(3)
    solids = solids_of(list(forest(random, 300, 30.0)))
    pattern = beams(*np.linspace(-span / 2, span / 2, count, endpoint=False))
    solids_seen = 0
    for _ in range(60):
        origin = random.uniform((-5.0, -5.0, 0.3), (35.0, 35.0, 3.0))
        pitch = random.uniform(-0.35, 0.35)
        projected = cast(solids, origin, pattern, pitch_rad=pitch)
        walked = cast(NO_SOLIDS, origin, pattern, pitch_rad=pitch, grid=grid_of(solids, 0.7))
        assert walked == pytest.approx(projected, abs=1e-9)
        solids_seen += (projected < cast(NO_SOLIDS, origin, pattern, pitch_rad=pitch)).sum()
    assert solids_seen > 1000


@pytest.mark.parametrize("span, count", [(2 * math.pi, 512), (2.0, 101)])
def test_hidden_solids_change_no_range(span, count):
    """The ranges among solids are the least of those with each solid alone, to the bit."""
    random = np.random.default_rng(4)
    solids = solids_of(list(forest(random, 120, 60.0)))
    pattern = beams(*np.linspace(-span / 2, span / 2, count, endpoint=False))
    beyond_m = 0.0
    for _ in range(6):
        origin = random.uniform((-5.0, -5.0, 0.3), (65.0, 65.0, 1.5))
        pitch = random.uniform(-0.05, 0.05)
        alone = [
            cast(Solids(*(field[k : k + 1] for field in solids)), origin, pattern, pitch_rad=pitch)
            for k in range(len(solids.kinds))
        ]
        ranges = cast(solids, origin, pattern, pitch_rad=pitch)
        np.testing.assert_array_equal(ranges, np.min(alone, axis=0))
        beyond_m = max(beyond_m, ranges[np.isfinite(ranges)].max())
    assert beyond_m > 24.0


def test_a_scene_of_many_solids_is_split():
    """Walls reach over many columns and are projected; all of the rest is in the grid."""
    random = np.random.default_rng(4)
    few = Scene("few", 30.0, 30.0, 1.0, Walls(), tuple(forest(random, 100, 30.0)), ())
    many = Scene("many", 30.0, 30.0, 1.0, Walls(), tuple(forest(random, 1000, 30.0)), ())
    solids, grid = split_scene(few)
    assert (len(solids.kinds), len(grid.members)) == (104, 0)
    solids, grid = split_scene(many)
    assert solids.centres.tolist() == [[box.x_m, box.y_m, 1.0] for box in many.wall_boxes()]
    assert set(grid.members.tolist()) == set(range(1000))


def forest(random: np.random.Generator, count: int, size_m: float) -> Iterator:
    for k in range(count):
        x, y = random.uniform(0.0, size_m, 2).tolist()
        a, b, yaw = random.uniform((0.1, 0.1, -3.0), (0.8, 0.8, 3.0)).tolist()
        height, bottom = random.uniform((0.2, 0.0), (2.0, 1.0)).tolist()
        yield (
            Box(f"box{k}", x, y, a, b, height, yaw, bottom)
            if k % 2
            else Cylinder(f"pillar{k}", x, y, a / 2, height, bottom)
        )


# Beside the physics engine, for whose rays solids are up to a millimetre thicker.

FOREST = tuple(forest(np.random.default_rng(1), 60, 20.0))
SCENES = {"arena": ARENA, "forest": Scene("forest", 20.0, 20.0, 1.0, Walls(1.5), FOREST, ())}
MARGIN_M = 1e-3


def body_at_random(scene: Scene, random: np.random.Generator) -> BodyState:
    """A quadcopter that touches nothing, tilted by up to 20 degrees, from low to above all."""
    position = np.zeros(3)
    while scene.surface_distance_m(*position) < 0.35:
        high = (scene.size_x_m - 0.4, scene.size_y_m - 0.4, 2.5)
        position = random.uniform((0.4, 0.4, 0.35), high)
    towards, tilt, yaw = random.uniform((-3.1, 0.0, -3.1), (3.1, math.radians(20.0), 3.1))
    turn = quaternion_from_euler(tilt * math.cos(towards), tilt * math.sin(towards), yaw)
    return BodyState(np.array([[*position, *turn, *np.zeros(6)]]))


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_every_range_of_the_engine_is_one_of_solids_up_to_a_millimetre_thicker(scene):
    """Without exception, grazing or not; rounding in its single precision apart."""
    world = World(scene, [], Airframe(), 1.0 / 240)
    engine = WorldCaster(PARAMS, world.cast)
    thicker, thinner = KernelCaster(PARAMS, scene, 1), KernelCaster(PARAMS, scene, 1)
    thicker._solids.sizes[:] += MARGIN_M
    thinner._solids.sizes[:] -= MARGIN_M
    random = np.random.default_rng(11)
    for _ in range(150):
        bodies = body_at_random(scene, random)
        seen, least, most = (
            np.minimum(caster.cast(bodies, [0]), 2 * FAR_M) for caster in (engine, thicker, thinner)
        )
        assert (seen > least - 1e-4).all() and (seen < most + 1e-4).all()
    world.close()


def test_simulations_see_the_same_with_either_caster():
    """Moving, tilting quadcopters that see each other; all at once or one by one."""
    simulations = [
        Simulation(ARENA, 4, SimulationParams(PARAMS, lidar_caster=caster))
        for caster in ("kernel", "bullet")
    ]
    for simulation in simulations:
        for robot in range(4):
            simulation.set_command(robot, Twist2D(1.0, 0.0, 0.5))
        for _ in range(60):
            simulation.step()
    kernel, bullet = (simulation.scans([0, 3, 1]) for simulation in simulations)
    for ours, theirs in zip(kernel, bullet):
        assert (np.abs(ours.ranges_m - theirs.ranges_m) < 2e-3).mean() > 0.98
        assert ours.ranges_m.dtype == np.float32
    assert np.array_equal(kernel[1].ranges_m, simulations[0].scan(3).ranges_m)
    for simulation in simulations:
        assert simulation.scans([]) == []
        simulation.close()


def test_more_rays_than_the_engine_takes_at_once():
    world = World(ARENA, ARENA.starts[:1], Airframe(), 1.0 / 240)
    count = 2 * pybullet.MAX_RAY_INTERSECTION_BATCH_SIZE
    fractions = world.cast(
        np.tile([1.0, 1.0, 2.0], (count, 1)), np.tile([1.0, 1.0, -2.0], (count, 1))
    )
    world.close()
    assert fractions == pytest.approx(np.full(count, 0.5))
