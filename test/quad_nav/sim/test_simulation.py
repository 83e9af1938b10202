"""Flights of the whole simulation: tracking, hovering, contacts, scans, repeatability."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.sim.body import World
from quad_nav.sim.contacts import CONTACT_GAP_S, ContactLog, Touch
from quad_nav.sim.flight import Airframe
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.obstacles import Box, Cylinder
from quad_nav.sim.scene import BODY_RADIUS_M, Scene, Walls
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import LIDAR_CASTERS, STEPS_PER_S, SimulationParams


def room(*starts: Pose2D, obstacles=(), size_m: float = 20.0) -> Scene:
    return Scene("room", size_m, size_m, 1.0, Walls(), tuple(obstacles), starts)


MIDDLE = Pose2D(10.0, 10.0, 0.0)


@pytest.fixture
def make():
    """Simulations that are closed at the end of the test."""
    made = []

    def build(*args, **kwargs) -> Simulation:
        made.append(Simulation(*args, **kwargs))
        return made[-1]

    yield build
    for simulation in made:
        simulation.close()


def fly(simulation: Simulation, seconds: float, *twists: Twist2D) -> np.ndarray:
    """Fly with one steady command per quadcopter.

    Returns float64[steps, n, 4]: body-frame vx, vy, yaw rate, and z in map.
    """
    rows = []
    for _ in range(round(seconds * STEPS_PER_S)):
        for robot, twist in enumerate(twists):
            simulation.set_command(robot, twist)
        simulation.step()
        states = [simulation.state(robot) for robot in range(simulation.n_robots)]
        rows.append(
            [
                [s.twist.vx_mps, s.twist.vy_mps, s.twist.vyaw_radps, s.map_from_base.z_m]
                for s in states
            ]
        )
    return np.array(rows)


@pytest.mark.parametrize(
    "command, axis, value",
    [
        (Twist2D(0.3, 0.0, 0.0), 0, 0.3),
        (Twist2D(-0.3, 0.0, 0.0), 0, -0.3),
        (Twist2D(0.0, 0.3, 0.0), 1, 0.3),
        (Twist2D(0.0, 0.0, 1.0), 2, 1.0),
        (Twist2D(1.0, 0.0, 0.0), 0, 1.0),
    ],
)
def test_step_settles_within_a_second_without_overshoot(make, command, axis, value):
    flown = fly(make(room(MIDDLE), 1), 2.5, command)
    relative = flown[:, 0, axis] / value
    settled = round((1.0 if abs(value) == 0.3 else 1.25) * STEPS_PER_S)
    assert abs(relative[settled:] - 1.0).max() < 0.05
    assert relative.max() < 1.02
    assert relative[:24].min() > -0.01
    assert abs(flown[:, 0, 3] - 1.0).max() < 0.02


def test_turning_while_moving_keeps_the_body_velocity(make):
    flown = fly(make(room(MIDDLE), 1), 4.0, Twist2D(0.3, 0.0, 1.0))[-240:, 0]
    assert abs(flown[:, 0] - 0.3).max() < 0.01
    assert abs(flown[:, 1]).max() < 0.01
    assert abs(flown[:, 2] - 1.0).max() < 0.01


def test_accelerating_needs_tilt_and_is_limited(make):
    simulation = make(room(MIDDLE), 1)
    simulation.set_command(0, Twist2D(2.0, 0.0, 0.0))
    tilts = []
    for _ in range(120):
        simulation.step()
        tilts.append(math.acos(simulation.body_state.rotations[0, 2, 2]))
    assert max(tilts) == pytest.approx(math.atan(2.0 / 9.81), rel=0.1)
    assert tilts[0] < 0.01


def test_hovers_when_commands_time_out(make):
    params = SimulationParams(command_timeout_s=0.5, controller_period_s=0.1)
    simulation = make(room(MIDDLE, Pose2D(5.0, 5.0)), 2, params)
    assert simulation.is_hovering.tolist() == [True, True]
    fly(simulation, 1.0, Twist2D(0.3, 0.0, 0.0))
    assert simulation.is_hovering.tolist() == [False, True]
    fly(simulation, 0.59)
    assert simulation.is_hovering.tolist() == [False, True]
    fly(simulation, 0.02)
    assert simulation.is_hovering.tolist() == [True, True]
    stopped = fly(simulation, 2.0)
    assert abs(stopped[-1, 0, :3]).max() < 0.003


def test_a_command_that_is_not_finite_never_reaches_the_body(make):
    simulation = make(room(MIDDLE), 1)
    for bad in (
        Twist2D(math.nan, 0.0, 0.0),
        Twist2D(0.0, math.inf, 0.0),
        Twist2D(0.0, 0.0, -math.inf),
    ):
        with pytest.raises(ValueError, match="not finite"):
            simulation.set_command(0, bad)
    fly(simulation, 0.5)
    assert simulation.state(0).map_from_base.to_2d() == MIDDLE


def test_odometry_is_in_the_body_frame(make):
    simulation = make(room(Pose2D(10.0, 10.0, math.pi / 2)), 1)
    fly(simulation, 2.0, Twist2D(0.3, 0.0, 0.0))
    state = simulation.state(0)
    assert state.linear_mps == pytest.approx((0.3, 0.0, 0.0), abs=0.002)
    assert simulation.body_state.velocities_mps[0] == pytest.approx([0.0, 0.3, 0.0], abs=0.002)
    assert state.map_from_base.yaw_rad == pytest.approx(math.pi / 2, abs=1e-3)
    assert state.map_from_base.y_m > 10.4


def test_one_contact_for_a_push_against_a_pillar(make):
    pillar = Cylinder("pillar", 12.0, 10.0, 0.5, 2.0)
    simulation = make(room(MIDDLE, obstacles=[pillar]), 1)
    fly(simulation, 6.0, Twist2D(0.5, 0.0, 0.0))
    assert len(simulation.contacts) == 1
    contact = simulation.contacts[0]
    assert str(contact) == "quad0 touches pillar"
    assert (contact.x_m, contact.y_m) == pytest.approx((11.5, 10.0), abs=0.02)
    # 1.2 m to go at 0.5 m/s, and 0.32 s that the velocity loop lags behind
    assert contact.time_s == pytest.approx(1.2 / 0.5 + 0.32, abs=0.05)
    assert simulation.state(0).map_from_base.z_m == pytest.approx(1.0, abs=0.02)
    simulation.reset()
    assert simulation.contacts == []


def test_two_quadcopters_make_one_contact_that_involves_both(make):
    simulation = make(room(Pose2D(9.0, 10.0, 0.0), Pose2D(11.0, 10.0, math.pi)), 2)
    fly(simulation, 3.0, Twist2D(0.5, 0.0, 0.0), Twist2D(0.5, 0.0, 0.0))
    assert [str(c) for c in simulation.contacts] == ["quad0 touches quad1"]
    contact = simulation.contacts[0]
    assert contact.involves("quad0") and contact.involves("quad1")
    assert (contact.x_m, contact.y_m) == pytest.approx((10.0, 10.0), abs=0.02)


def test_a_contact_ends_half_a_second_after_its_last_touch():
    log = ContactLog()
    touch = Touch(0, "pillar", (1.0, 2.0, 3.0))
    other = Touch(1, "pillar", (1.0, 2.0, 3.0))
    assert [c.time_s for c in log.update(1.0, [touch])] == [1.0]
    assert log.update(1.0 + CONTACT_GAP_S, [touch]) == []
    assert [c.robot for c in log.update(1.1 + CONTACT_GAP_S, [touch, other])] == ["quad1"]
    assert log.update(3.0, []) == []
    assert [c.time_s for c in log.update(3.0, [touch])] == [3.0]
    assert len(log.contacts) == 3


def test_scan_sees_walls_obstacles_and_the_peer_but_not_itself(make):
    params = SimulationParams(LidarParams(step_size_rad=math.pi / 2))
    scene = room(
        MIDDLE,
        Pose2D(12.0, 10.0),
        obstacles=[Box("box", 10.0, 13.0, 1.0, 1.0, 2.0), Cylinder("pillar", 10.0, 6.0, 0.5, 2.0)],
    )
    ranges = make(scene, 2, params).scan(0).ranges_m
    west, pillar, peer, box = ranges
    assert (west, pillar, peer, box) == pytest.approx((10.0, 3.5, 1.7, 2.5), abs=1e-3)


@pytest.mark.parametrize("caster", LIDAR_CASTERS)
def test_thousands_of_boxes_are_seen_and_touched_like_single_boxes(make, caster):
    """The engine has them in few bodies; a contact still names the box. No beam passes a gap."""
    boxes = [Box(f"b{k}", 14.0, 0.02 * k, 0.4, 0.019, 2.0) for k in range(1000)]
    scene = room(Pose2D(13.0, 10.0), obstacles=boxes)
    params = SimulationParams(LidarParams(step_size_rad=math.pi / 2), lidar_caster=caster)
    simulation = make(scene, 1, params)
    _, _, ahead, _ = simulation.scan(0).ranges_m
    assert ahead == pytest.approx(0.8, abs=1e-3)
    fly(simulation, 2.0, Twist2D(0.5, 0.0, 0.0))
    touched = {contact.other for contact in simulation.contacts}
    assert touched and touched <= {f"b{k}" for k in range(480, 521)}
    assert simulation.state(0).map_from_base.x_m == pytest.approx(13.5, abs=0.03)
    simulation.reset()
    assert simulation.scan(0).ranges_m[2] == pytest.approx(0.8, abs=1e-3)


def test_lidar_tilts_with_the_body(make):
    """Acceleration pitches the nose down: the LIDAR sees the floor ahead, not behind."""
    simulation = make(room(MIDDLE, size_m=60.0), 1)
    simulation.set_command(0, Twist2D(2.0, 0.0, 0.0))
    for _ in range(60):
        simulation.step()
    state = simulation.state(0)
    pitch = math.asin(-simulation.body_state.rotations[0, 2, 0])
    ranges = simulation.scan(0).ranges_m
    height_m = state.map_from_base.z_m + 0.06 * math.cos(pitch)
    assert ranges[256] == pytest.approx(height_m / math.sin(pitch), rel=1e-3)
    assert np.isinf(ranges[0])


def test_same_seed_same_bits(make):
    params = SimulationParams(LidarParams(noise_std_m=0.01), jitter_m=0.3)
    scene = room(
        Pose2D(9.0, 10.0),
        Pose2D(11.0, 10.0, math.pi),
        obstacles=[Cylinder("pillar", 10.0, 11.0, 0.3, 2.0)],
    )
    commands = Twist2D(0.5, 0.1, 0.2), Twist2D(0.5, -0.1, -0.3)

    def flight(simulation):
        flown = fly(simulation, 3.0, *commands)
        return flown, simulation.scan(1).ranges_m, list(simulation.contacts)

    first = make(scene, 2, params, seed=5)
    flown, ranges, contacts = flight(first)
    first.reset()
    for again in (make(scene, 2, params, seed=5), first):
        flown_again, ranges_again, contacts_again = flight(again)
        assert np.array_equal(flown, flown_again)
        assert np.array_equal(ranges, ranges_again)
        assert len(contacts) > 0
        assert [(c.x_m, c.y_m) for c in contacts] == [(c.x_m, c.y_m) for c in contacts_again]
    assert not np.array_equal(flown, flight(make(scene, 2, params, seed=6))[0])


def test_reset_restores_the_start_and_the_clock_continues(make):
    simulation = make(room(MIDDLE), 1, start_step=240)
    fly(simulation, 1.0, Twist2D(0.3, 0.0, 0.5))
    assert simulation.now_s == pytest.approx(2.0)
    simulation.reset()
    state = simulation.state(0)
    assert state.map_from_base.to_2d() == MIDDLE
    assert state.linear_mps == (0.0, 0.0, 0.0)
    assert simulation.now_s == pytest.approx(2.0)
    assert simulation.is_hovering.tolist() == [True]
    fly(simulation, 0.5)
    assert simulation.state(0).map_from_base.to_2d() == MIDDLE


def test_bad_parameters_are_listed_together():
    with pytest.raises(InputError) as caught:
        SimulationParams(command_timeout_s=math.nan, jitter_m=-1.0, lidar_caster="gazebo")
    assert [p.split(":")[0] for p in caught.value.problems] == [
        "command_timeout",
        "jitter",
        "lidar",
    ]


@pytest.mark.parametrize("radius_m, touches", [(0.20, False), (0.30, True)])
def test_a_body_touches_from_its_own_radius_on(make, radius_m, touches):
    pillar = Cylinder("pillar", 10.6, 10.0, 0.35, 2.0)  # its surface is 0.25 m ahead
    simulation = make(
        room(MIDDLE, obstacles=[pillar]), 1, SimulationParams(airframe=Airframe(radius_m=radius_m))
    )
    for _ in range(STEPS_PER_S // 10):
        simulation.step()
    assert bool(simulation.contacts) is touches


@pytest.mark.parametrize("caster", LIDAR_CASTERS)
def test_a_body_is_seen_with_its_own_radius(make, caster):
    params = SimulationParams(
        LidarParams(step_size_rad=math.pi / 2), airframe=Airframe(radius_m=0.2), lidar_caster=caster
    )
    ahead_m = make(room(MIDDLE, Pose2D(12.0, 10.0)), 2, params).scan(0).ranges_m[2]
    assert ahead_m == pytest.approx(1.8, abs=0.01)


@pytest.mark.parametrize("radius_m", [0.0, -0.2, math.nan, math.inf])
def test_a_body_needs_a_radius(radius_m):
    with pytest.raises(InputError, match="body_radius: .* expected metres above 0"):
        Airframe(radius_m=radius_m)


def test_a_reset_with_a_seed_is_a_new_simulation_with_it(make):
    """Also after contacts, for which the engine moved the robots."""
    params = SimulationParams(LidarParams(noise_std_m=0.02), jitter_m=0.3)
    scene = room(Pose2D(1.0, 1.0, 3.0), Pose2D(2.4, 1.0, 0.3))
    used = make(scene, 2, params, seed=1)
    fly_into_wall(used)
    assert used.contacts
    used.reset(7, start_step=0)
    new = make(scene, 2, params, seed=7)
    assert np.array_equal(used.body_state.rows, new.body_state.rows)
    assert np.array_equal(used.scan(1).ranges_m, new.scan(1).ranges_m)
    fly_into_wall(used)
    fly_into_wall(new)
    assert np.array_equal(used.body_state.rows, new.body_state.rows)
    assert used.contacts == new.contacts != []


def fly_into_wall(simulation: Simulation) -> None:
    for _ in range(10):
        simulation.set_command(0, Twist2D(1.0, 0.0, 0.0))
        simulation.set_command(1, Twist2D(-0.5, 0.0, 0.2))
        simulation.advance(60)


def test_starts_are_those_of_the_engine_to_the_last_bit():
    """Before the engine has built its world, and after."""
    random = np.random.default_rng(5)
    starts = [Pose2D(*random.uniform(1.0, 19.0, 2), random.uniform(-7.0, 7.0)) for _ in range(200)]
    world = World(room(*starts), starts, Airframe(), 1.0 / STEPS_PER_S)
    early = world.state().rows
    world.touches()
    assert np.array_equal(world.state().rows, early)
    world.close()


def test_a_placed_body_is_seen_and_touched():
    starts = (Pose2D(5.0, 5.0, 0.0), Pose2D(8.0, 5.0, 0.0))
    scene = Scene("room", 20.0, 20.0, 1.0, Walls(), (), starts)
    simulation = Simulation(scene, 2)
    row = np.zeros((1, 13))
    row[0, :7] = (7.0, 5.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    contacts = []
    for k in range(400):
        row[0, 0] = 7.0 - 0.004 * k  # towards robot 0, which hovers
        simulation.place([1], row)
        contacts += simulation.advance(4)
        if k == 0:
            assert simulation.scan(0).ranges_m[256] == pytest.approx(2.0 - BODY_RADIUS_M, abs=0.02)
    assert simulation.state(1).map_from_base.x_m == pytest.approx(7.0 - 0.004 * 399, abs=0.01)
    assert [(one.robot, one.other) for one in contacts] == [("quad0", "quad1")]
    # It moved 1.596 m and pushes robot 0 ahead of it.
    assert contacts[0].x_m == pytest.approx(5.0 + BODY_RADIUS_M, abs=0.02)
    simulation.close()
