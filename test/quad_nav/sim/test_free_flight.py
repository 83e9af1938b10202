"""Free flight: equal to the physics engine while nothing is near."""

import math
from dataclasses import replace

import numpy as np
import pytest

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.sim.body import World
from quad_nav.sim.flight import Airframe, BodyState, FlightLaw, FlightParams
from quad_nav.sim.free_flight import FreeFlight
from quad_nav.sim.obstacles import Cylinder
from quad_nav.sim.rigid_body import step_freely
from quad_nav.sim.scene import Scene, Walls
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import STEP_S, SimulationParams

SKY = Scene("sky", 40.0, 40.0, 20.0, Walls(), (), (Pose2D(10.0, 20.0, 0.3), Pose2D(30.0, 20.0)))
POST = Cylinder("post", 4.0, 4.0, 0.2, 2.0)
ROOM = Scene("room", 8.0, 8.0, 1.0, Walls(), (POST,), (Pose2D(1.5, 2.0), Pose2D(1.5, 6.0)))
ENGINE = SimulationParams(lidar_caster="bullet")


def free_step(bodies, forces, torques, airframe, step_s):
    rows = bodies.rows.copy()
    constants = FlightLaw(airframe, FlightParams()).constants
    step_freely(rows, np.zeros(len(rows), bool), forces, torques, constants, step_s)
    return BodyState(rows)


def random_commands(seed, count, speed_mps):
    random = np.random.default_rng(seed)
    return [
        Twist2D(*random.uniform(-speed_mps, speed_mps, 2), random.uniform(-2.0, 2.0))
        for _ in range(count)
    ]


def test_a_free_step_equals_the_engines_step():
    world = World(SKY, SKY.starts, Airframe(), STEP_S)
    random = np.random.default_rng(1)
    for _ in range(500):
        forces = random.normal(0.0, 5.0, (2, 3)) + (0.0, 0.0, 9.81)
        torques = random.normal(0.0, 0.5, (2, 3))
        before = world.state()
        engine = world.step(before, forces, torques)
        free = free_step(before, forces, torques, Airframe(), STEP_S)
        ours, theirs = (np.delete(one.rows, range(3, 7), axis=1) for one in (free, engine))
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(free.rotations, engine.rotations, atol=1e-13)
    spin_radps = world.state().rows[:, 10:13]
    assert np.abs(spin_radps).max() > 1.0  # otherwise the gyroscopic term is not tested
    world.close()


def test_free_fall_for_one_step():
    falling = free_step(
        BodyState(np.array([[0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 1.0, 1.0] + 5 * [0.0]])),
        np.array([[4.0, 0.0, 0.0]]),
        np.array([[0.0, 0.0, 0.02]]),
        Airframe(mass_kg=2.0),
        0.5,
    )
    # v = (1 + 0.5 4 / 2, 0, -0.5 9.81), x = 0.5 v; the yaw rate is 0.5 0.02 / 0.02.
    half = 0.5 * 0.5 * 0.5
    position, quaternion = [1.0, 0.0, 9.0 - 0.25 * 9.81], [0.0, 0.0, math.sin(half), math.cos(half)]
    expected = [*position, *quaternion, 2.0, 0.0, -0.5 * 9.81, 0.0, 0.0, 0.5]
    np.testing.assert_allclose(falling.rows[0], expected, atol=1e-15)


def test_the_same_flight_with_and_without_the_engine():
    free, engine = Simulation(SKY, 2), Simulation(SKY, 2, ENGINE)
    for one, other in zip(random_commands(2, 40, 1.0), random_commands(3, 40, 1.0)):
        for simulation in (free, engine):
            simulation.set_command(0, one)
            simulation.set_command(1, other)
            for _ in range(60):
                simulation.step()
    np.testing.assert_allclose(free.body_state.rows, engine.body_state.rows, atol=1e-9)
    assert np.hypot(*(free.body_state.positions_m[0, :2] - (10.0, 20.0))) > 1.0
    for simulation in (free, engine):
        simulation.close()


@pytest.mark.parametrize("seed", range(3))
def test_every_touch_is_foreseen(seed):
    """Two quadcopters collide in a small room; free flight never reaches a touch."""
    simulation = Simulation(ROOM, 2, replace(ENGINE, jitter_m=0.3), seed)
    free = FreeFlight(
        ROOM, 2, simulation.params.airframe.radius_m, FlightLaw(Airframe(), FlightParams()), STEP_S
    )
    hover, none_free = np.zeros((2, 3)), np.zeros(2, bool)
    foreseen, free_steps = [], 0
    for one, other in zip(random_commands([seed, 0], 30, 1.5), random_commands([seed, 1], 30, 1.5)):
        simulation.set_command(0, one)
        simulation.set_command(1, other)
        for _ in range(120):
            _, done, _ = free.advance(simulation.body_state, hover, none_free, 1)
            near = done == 0
            free_steps += not near
            foreseen += [near for _ in simulation.step()]
    assert foreseen and all(foreseen)
    assert free_steps > 300
    simulation.close()


def test_the_engine_continues_from_the_free_flight():
    """A wall ahead: the contact is the same with and without free flight."""
    contacts = []
    for params in (SimulationParams(), ENGINE):
        simulation = Simulation(ROOM, 1, params)
        for step in range(960):
            if step % 60 == 0:
                simulation.set_command(0, Twist2D(-0.5, 0.0, 0.0))
            simulation.step()
        contacts.append(simulation.contacts)
        simulation.close()
    (free,), (engine,) = contacts
    assert (free.other, free.time_s) == (engine.other, engine.time_s)
    assert (free.x_m, free.y_m) == pytest.approx((engine.x_m, engine.y_m), abs=1e-6)


def test_only_quadcopters_near_something_are_in_the_engine():
    """One scrapes along a wall; the other, far away, flies as if it were alone."""
    starts = (Pose2D(2.0, 1.0), Pose2D(2.0, 6.0))
    alone = Simulation(replace(ROOM, starts=starts[1:]), 1)
    both = Simulation(replace(ROOM, starts=starts), 2)
    for step in range(1200):
        if step % 60 == 0:
            alone.set_command(0, Twist2D(0.3, 0.0, 0.1))
            both.set_command(0, Twist2D(0.1, -0.4, 0.0))
            both.set_command(1, Twist2D(0.3, 0.0, 0.1))
        alone.step()
        both.step()
    assert [contact.other for contact in both.contacts] == ["wall_south"]
    np.testing.assert_array_equal(both.body_state.rows[1], alone.body_state.rows[0])
    both.reset()
    np.testing.assert_allclose(both.body_state.positions_m[:, :2], [(2.0, 1.0), (2.0, 6.0)])
    for simulation in (alone, both):
        simulation.close()


def test_a_quadcopter_that_left_the_engine_is_no_obstacle_there():
    """One flies away from a post; then another one flies to its old position."""
    starts = (Pose2D(4.0, 4.56), Pose2D(4.0, 7.0, -math.pi / 2))
    simulation = Simulation(replace(ROOM, starts=starts), 2)
    for step in range(2880):
        if step % 60 == 0:
            simulation.set_command(0, Twist2D(-0.5 if step < 1200 else 0.0, 0.0, 0.0))
            simulation.set_command(1, Twist2D(0.4 if step > 960 else 0.0, 0.0, 0.0))
        simulation.step()
    (contact,) = simulation.contacts
    assert (contact.robot, contact.other) == ("quad1", "post")
    simulation.close()
