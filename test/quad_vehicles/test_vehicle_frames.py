"""NED and FRD to ENU and FLU: every axis, every yaw, and round trips."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from vehicles.estimator import ned_from_frd

from quad_nav.geometry import quaternion_from_euler, rotate
from quad_vehicles import frames
from quad_vehicles.setpoints import led, limited, setpoint_fields
from quad_vehicles.telemetry import Limits, Velocity

ANGLES = st.floats(-math.pi, math.pi)


def test_axes_of_the_world_and_of_the_body():
    north, east, down = (1, 0, 0), (0, 1, 0), (0, 0, 1)
    assert [frames.enu_from_ned(one) for one in (north, east, down)] == [
        (0, 1, 0),
        (1, 0, 0),
        (0, 0, -1),
    ]
    forward, right = (1, 0, 0), (0, 1, 0)
    assert [frames.flu_from_frd(one) for one in (forward, right, down)] == [
        (1, 0, 0),
        (0, -1, 0),
        (0, 0, -1),
    ]


def enu_yaw(heading_rad):
    """A heading clockwise from north as a yaw counter-clockwise from east."""
    return math.pi / 2.0 - heading_rad


@given(ANGLES, st.floats(-1.5, 1.5), ANGLES)
def test_attitudes_return(roll_rad, pitch_rad, yaw_rad):
    attitude = quaternion_from_euler(roll_rad, pitch_rad, yaw_rad)
    back = np.array(frames.enu_from_flu(ned_from_frd(attitude)))
    sign = 1.0 if np.dot(back, attitude) > 0 else -1.0  # q and -q are the same rotation
    np.testing.assert_allclose(back * sign, attitude, atol=1e-12)


@pytest.mark.parametrize("heading_deg", range(-180, 181, 30))
@pytest.mark.parametrize("roll_deg, pitch_deg", [(0, 0), (10, 0), (0, 10), (-20, 15)])
def test_an_attitude_turns_vectors_as_its_matrix_does(heading_deg, roll_deg, pitch_deg):
    """Forward, right and down of the body, turned by MAVLink's angles, agree in both frames."""
    roll, pitch, heading = map(math.radians, (roll_deg, pitch_deg, heading_deg))
    attitude = frames.enu_from_flu(frames.mavlink_quaternion(roll, pitch, heading))
    matrix = rotation(heading, 2) @ rotation(pitch, 1) @ rotation(roll, 0)  # FRD to NED
    for frd in np.eye(3):
        ned = tuple((matrix @ frd).tolist())
        enu = rotate(attitude, frames.flu_from_frd(tuple(frd.tolist())))
        np.testing.assert_allclose(enu, frames.enu_from_ned(ned), atol=1e-12)


@pytest.mark.parametrize("heading_deg", range(-180, 181, 45))
@pytest.mark.parametrize("axis", range(4))
def test_a_set_point_moves_the_vehicle_as_the_command_says(heading_deg, axis):
    """The command in ROS's axes, flown as MAVLink defines frame 8, ends where ROS expects it."""
    command = [0.0] * 4
    command[axis] = 0.3
    fields = setpoint_fields(Velocity(*command), 0)
    heading = math.radians(heading_deg)
    forward, right = fields["vx"], fields["vy"]
    ned = (
        forward * math.cos(heading) - right * math.sin(heading),
        forward * math.sin(heading) + right * math.cos(heading),
        fields["vz"],
    )
    yaw = enu_yaw(heading)
    vx, vy, vz, vyaw = command
    enu = (
        vx * math.cos(yaw) - vy * math.sin(yaw),
        vx * math.sin(yaw) + vy * math.cos(yaw),
        vz,
    )
    np.testing.assert_allclose(frames.enu_from_ned(ned), enu, atol=1e-12)
    turned = enu_yaw(heading + fields["yaw_rate"])
    assert math.remainder(turned - yaw - vyaw, math.tau) == pytest.approx(0.0, abs=1e-12)


def test_set_point_has_frame_8_and_mask_1479():
    fields = setpoint_fields(Velocity(0.1, 0.2, 0.3, 0.4), 2**32 + 7)
    assert fields == {
        "time_boot_ms": 7,
        "coordinate_frame": 8,
        "type_mask": 1479,
        **dict.fromkeys(("x", "y", "z", "afx", "afy", "afz", "yaw"), 0.0),
        "vx": 0.1,
        "vy": -0.2,
        "vz": -0.3,
        "yaw_rate": -0.4,
    }


def test_a_velocity_is_turned_by_what_the_heading_turns_until_it_is_flown():
    """0.6 s at 0.5 rad/s to the left are 0.3 rad."""
    turned = led(Velocity(0.4, 0.0, 0.1, 0.5, 1.2), 0.6)
    assert turned.vx_mps == pytest.approx(0.4 * math.cos(0.3))
    assert turned.vy_mps == pytest.approx(0.4 * math.sin(0.3))
    assert (turned.vz_mps, turned.vyaw_radps, turned.height_m) == (0.1, 0.5, 1.2)
    assert led(Velocity(0.4, 0.1, 0.0, 0.0), 0.6) == Velocity(0.4, 0.1, 0.0, 0.0)


ANY = st.floats(allow_nan=True, allow_infinity=True)


@given(ANY, ANY, ANY, ANY)
def test_nothing_leaves_but_finite_numbers_within_the_limits(vx, vy, vz, vyaw):
    limits = Limits(speed_mps=0.7, climb_mps=0.3, yaw_rate_radps=1.0)
    velocity = limited(Velocity(vx, vy, vz, vyaw), limits)
    if not all(map(math.isfinite, (vx, vy, vz, vyaw))):
        assert velocity is None
        return
    assert math.hypot(velocity.vx_mps, velocity.vy_mps) <= 0.7 * (1 + 1e-9)
    assert abs(velocity.vz_mps) <= 0.3 and abs(velocity.vyaw_radps) <= 1.0


def rotation(angle, axis):
    """Matrix of a right-handed rotation about an axis."""
    cos, sin = math.cos(angle), math.sin(angle)
    first, second = [k for k in range(3) if k != axis]
    sign = -1.0 if axis == 1 else 1.0
    matrix = np.eye(3)
    matrix[first, first] = matrix[second, second] = cos
    matrix[first, second], matrix[second, first] = -sign * sin, sign * sin
    return matrix
