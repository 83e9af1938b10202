"""The airframe ``arducopter`` responds as ArduCopter does: delays, lags, limits, directions."""

import math

import numpy as np
import pytest

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.scenario.simulator_setup import read_setup
from quad_nav.sim.flight import AIRFRAMES, Airframe, AutopilotResponse, airframe_name
from quad_nav.sim.scene import Scene, Walls
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import STEPS_PER_S, SimulationParams
from quad_vehicles.autopilots import ARDUPILOT
from quad_vehicles.setpoints import PERIOD_S

ROOM = Scene("room", 60.0, 60.0, 1.0, Walls(), (), (Pose2D(30.0, 30.0, 0.0),))


def simulation(scene=ROOM, timeout_s=60.0, repeat_s=0.05, turn_lead_s=0.0):
    response = AutopilotResponse(repeat_s=repeat_s, turn_lead_s=turn_lead_s)
    params = SimulationParams(airframe=Airframe(response=response), command_timeout_s=timeout_s)
    return Simulation(scene, 1, params)


def velocities(flown, seconds):
    """Velocities float64[n, 6] in ``map`` after each step."""
    rows = []
    for _ in range(round(seconds * STEPS_PER_S)):
        flown.advance(1)
        rows.append(flown.state(0).map_velocities)
    flown.close()
    return np.array(rows)


def time_s(values, level):
    """Time at which values first exceed a level."""
    return (int(np.argmax(values > level)) + 1) / STEPS_PER_S


@pytest.mark.parametrize("speed_mps", [0.3, 1.0])
def test_velocity_follows_with_delay_and_lag(speed_mps):
    flown = simulation()
    flown.set_command(0, Twist2D(speed_mps, 0.0, 0.0))
    vx = velocities(flown, 4.0)[:, 0] / speed_mps

    assert time_s(vx, 0.05) == pytest.approx(0.196 + 0.449 * -math.log(0.95), abs=0.03)
    assert time_s(vx, 1.0 - math.exp(-1.0)) == pytest.approx(0.196 + 0.449, abs=0.03)
    assert time_s(vx, 0.9) == pytest.approx(0.196 + 0.449 * math.log(10.0), abs=0.06)
    assert vx.max() < 1.01
    assert vx[-1] == pytest.approx(1.0, abs=0.005)


def test_fast_step_is_limited_by_the_acceleration():
    flown = simulation()
    flown.set_command(0, Twist2D(2.0, 0.0, 0.0))
    vx = velocities(flown, 2.0)[:, 0]

    assert np.diff(vx).max() * STEPS_PER_S == pytest.approx(2.5, abs=0.15)


def test_yaw_rate_overshoots():
    flown = simulation()
    flown.set_command(0, Twist2D(0.0, 0.0, 0.5))
    rate = velocities(flown, 6.0)[:, 5] / 0.5
    # Overshoot of a second-order system with damping d: exp(-pi d / sqrt(1 - d^2)).
    assert rate.max() - 1.0 == pytest.approx(
        math.exp(-math.pi * 0.25 / math.sqrt(0.9375)), abs=0.03
    )
    peak_s = (int(np.argmax(rate)) + 1) / STEPS_PER_S
    assert peak_s == pytest.approx(0.125 + math.pi / (5.6 * math.sqrt(0.9375)), abs=0.02)
    assert rate[-1] == pytest.approx(1.0, abs=0.01)


def test_yaw_rate_is_capped():
    flown = simulation()
    flown.set_command(0, Twist2D(0.0, 0.0, 2.0))

    assert velocities(flown, 6.0)[-1, 5] == pytest.approx(1.05, abs=0.01)


def test_direction_is_kept_between_setpoints():
    flown = simulation(repeat_s=math.inf)
    flown.set_command(0, Twist2D(0.5, 0.0, 0.5))
    rows = velocities(flown, 4.0)
    # It has turned by almost 2 rad and flies along x in map all the same.
    assert rows[-1, 0] == pytest.approx(0.5, abs=0.01)
    assert np.abs(rows[:, 1]).max() < 0.02


@pytest.mark.parametrize(
    "repeat_s, sent, turn_lead_s, lag_deg",
    [(math.inf, 160, 0.0, 18.0), (0.05, 1, 0.0, 18.0), (0.05, 1, 0.6, 18.0 - 17.2)],
)
def test_stream_while_turning_lags_behind_the_heading(repeat_s, sent, turn_lead_s, lag_deg):
    """Whether the commands come at 20 Hz or the bridge repeats one; a lead takes the lag away."""
    flown = simulation(repeat_s=repeat_s, turn_lead_s=turn_lead_s)
    for _ in range(sent):
        flown.set_command(0, Twist2D(0.5, 0.0, 0.5))
        flown.advance(8 * STEPS_PER_S // sent)
    twist = flown.state(0).twist
    flown.close()
    angle_deg = math.degrees(math.atan2(twist.vy_mps, twist.vx_mps))
    # Recorded: 18 degrees at 20 Hz. The model: 0.5 rad/s times (delay + lag + half a period).
    assert angle_deg == pytest.approx(-lag_deg, abs=2.0)


def test_the_bridge_in_the_airframe_is_that_of_real_vehicles():
    response = AIRFRAMES["arducopter"].response
    assert (response.repeat_s, response.turn_lead_s) == (PERIOD_S, ARDUPILOT.turn_lead_s)


def test_flights_are_reproducible_and_reset_forgets_setpoints():
    flown, rows = simulation(), []
    for _ in range(2):
        flown.set_command(0, Twist2D(0.4, 0.2, 0.3))
        flown.advance(400)
        rows.append(flown.body_state.rows.copy())
        flown.reset()
    flown.close()

    assert rows[0].tobytes() == rows[1].tobytes()


def test_names():
    assert airframe_name(Airframe(radius_m=0.4)) == "default"
    assert airframe_name(AIRFRAMES["arducopter"]) == "arducopter"
    setup = read_setup({"airframe": "arducopter", "scene": "random"}, "/simulator")
    assert setup.params.airframe.response == AIRFRAMES["arducopter"].response
