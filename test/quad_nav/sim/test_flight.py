"""Flight controller: forces that can be computed by hand, and limits of commands."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.geometry import Twist2D, quaternion_from_euler
from quad_nav.sim.flight import (
    GRAVITY_MPS2,
    Airframe,
    BodyState,
    FlightLaw,
    FlightParams,
    limit_command,
)

AIRFRAME = Airframe(mass_kg=2.0, inertia_kgm2=(0.01, 0.01, 0.02), max_thrust_n=60.0)
PARAMS = FlightParams()


def body(
    roll=0.0, pitch=0.0, yaw=0.0, z=1.0, velocity=(0.0, 0.0, 0.0), angular=(0.0, 0.0, 0.0)
) -> BodyState:
    return BodyState(
        np.array([[0.0, 0.0, z, *quaternion_from_euler(roll, pitch, yaw), *velocity, *angular]])
    )


def forces_on(state: BodyState, *command: float, params: FlightParams = PARAMS):
    forces, torques = FlightLaw(AIRFRAME, params).thrust_and_torque(state, np.array([command]), 1.0)
    return forces[0], torques[0]


def test_hovering_needs_the_weight_and_no_torque():
    force, torque = forces_on(body(), 0.0, 0.0, 0.0)
    assert force == pytest.approx([0.0, 0.0, 2.0 * GRAVITY_MPS2])
    assert torque == pytest.approx([0.0, 0.0, 0.0])


def test_a_step_ahead_pitches_first():
    """a = 3.125 * 0.3 m/s^2; d is a + g; torque about y is I w^2 sin(angle between z and d)."""
    force, torque = forces_on(body(), 0.3, 0.0, 0.0)
    acceleration = 3.125 * 0.3
    sine = acceleration / math.hypot(acceleration, GRAVITY_MPS2)
    assert force == pytest.approx([0.0, 0.0, 2.0 * GRAVITY_MPS2])
    assert torque == pytest.approx([0.0, 0.01 * 625.0 * sine, 0.0])


def test_a_tilted_body_accelerates_towards_its_tilt_and_keeps_its_altitude():
    force, torque = forces_on(body(pitch=0.2), 0.0, 0.0, 0.0)
    assert force == pytest.approx([2.0 * GRAVITY_MPS2 * math.tan(0.2), 0.0, 2.0 * GRAVITY_MPS2])
    assert torque == pytest.approx([0.0, -0.01 * 625.0 * math.sin(0.2), 0.0])


def test_commands_are_along_the_heading():
    _, torque = forces_on(body(yaw=math.pi / 2), 0.3, 0.0, 0.0)
    _, ahead = forces_on(body(), 0.3, 0.0, 0.0)
    assert torque == pytest.approx([-ahead[1], 0.0, 0.0], abs=1e-12)


def test_steady_turn_leans_inwards():
    """At 0.3 m/s and 1 rad/s the body needs 0.3 m/s^2 to its left: a roll to the left."""
    roll = -math.atan2(0.3, GRAVITY_MPS2)
    state = body(roll=roll, velocity=(0.3, 0.0, 0.0), angular=(0.0, 0.0, 1.0))
    force, _ = forces_on(state, 0.3, 0.0, 1.0)
    assert force[:2] == pytest.approx([0.0, 2.0 * 0.3])


def test_altitude_is_critically_damped():
    force, _ = forces_on(body(z=0.9, velocity=(0.0, 0.0, 0.05)), 0.0, 0.0, 0.0)
    assert force[2] == pytest.approx(2.0 * (GRAVITY_MPS2 + 25.0 * 0.1 - 10.0 * 0.05))


def test_yaw_rate_is_tracked_with_limited_acceleration():
    _, torque = forces_on(body(), 0.0, 0.0, 0.1)
    assert torque[2] == pytest.approx(0.02 * 12.0 * 0.1)
    _, torque = forces_on(body(), 0.0, 0.0, 1.0)
    assert torque[2] == pytest.approx(0.02 * PARAMS.max_yaw_acceleration_radps2)


def test_acceleration_is_limited_by_the_tilt():
    params = FlightParams(max_tilt_rad=0.05, max_acceleration_mps2=9.0)
    _, torque = forces_on(body(), 2.0, 0.0, 0.0, params=params)
    assert torque[1] == pytest.approx(0.01 * 625.0 * math.sin(0.05))


def test_rows_are_independent():
    turning = body(yaw=0.3, velocity=(0.1, 0.0, 0.0), angular=(0.0, 0.0, 0.2))
    tilted = body(0.1, -0.1, 2.0, 0.8, velocity=(0.0, 0.4, -0.1), angular=(0.3, 0.0, -0.5))
    commands = [(0.3, 0.0, 0.5), (-0.2, 0.1, 0.0)]
    both = BodyState(np.concatenate([turning.rows, tilted.rows]))
    forces, torques = FlightLaw(AIRFRAME, PARAMS).thrust_and_torque(both, np.array(commands), 1.0)
    for k, state in enumerate((turning, tilted)):
        force, torque = forces_on(state, *commands[k])
        assert forces[k] == pytest.approx(force) and torques[k] == pytest.approx(torque)


@pytest.mark.parametrize(
    "twist, limited",
    [
        (Twist2D(0.3, -0.1, 0.7), (0.3, -0.1, 0.7)),
        (Twist2D(3.0, 4.0, 0.0), (1.2, 1.6, 0.0)),
        (Twist2D(0.0, 0.0, -9.0), (0.0, 0.0, -2.0)),
        (Twist2D(1e308, 1e308, 0.0), (math.sqrt(2.0), math.sqrt(2.0), 0.0)),
    ],
)
def test_commands_are_limited_in_length_not_in_direction(twist, limited):
    assert limit_command(twist, PARAMS) == pytest.approx(limited)
