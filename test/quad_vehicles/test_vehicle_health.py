"""What the bridge makes of the autopilot's battery, position, texts and heartbeats.

Numbers and texts are those of recordings of ArduCopter 4.5.3, where nothing else is said.
"""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from vehicles.virtual_flight import Flight

from quad_nav.topics.vehicle_states import State
from quad_vehicles.autopilots import ARDUPILOT, PX4
from quad_vehicles.exchanges import Parameters
from quad_vehicles.health_watch import HealthWatch
from quad_vehicles.vehicle_file import OUR_SYSTEM

SENSORS, BATTERY = 1467087919, 1 << 25  # health of a vehicle that hovers
GLITCH = 1 << 15


def system(millivolts=12600, charge=100, health=SENSORS):
    return SimpleNamespace(
        onboard_control_sensors_present=1399979055,
        onboard_control_sensors_enabled=1398930479,
        onboard_control_sensors_health=health,
        voltage_battery=millivolts,
        battery_remaining=charge,
    )


def watch(autopilot=ARDUPILOT, **values):
    parameters = Parameters(list(values), sends_bits=False)
    for name, value in values.items():
        parameters.take(name, value, 9)
    return HealthWatch(autopilot, parameters)


def receiver(fix, satellites=10):
    return SimpleNamespace(fix_type=fix, satellites_visible=satellites)


def estimator(flags, position=0.005, velocity=0.01):
    return SimpleNamespace(flags=flags, velocity_variance=velocity, pos_horiz_variance=position)


# Battery.


@pytest.mark.parametrize(
    "message, least_v, problem",
    [
        (system(10500), 10.5, ""),
        (system(9000), 10.5, "battery at 9.00 V, expected 10.5 V or more"),
        (system(9000), 0.0, ""),
        (system(0), 10.5, ""),  # not measured
        (
            system(health=SENSORS & ~BATTERY),
            10.5,
            "the autopilot says that the battery is low or broken",
        ),
    ],
)
def test_a_charge_of_100_percent_hides_no_low_battery(message, least_v, problem):
    assert watch(BATT_LOW_VOLT=least_v).battery_problem(message, is_armed=True) == problem


@pytest.mark.parametrize("bits", ["present", "enabled"])
def test_a_battery_that_is_not_watched_is_not_low(bits):
    message = system(health=0)
    setattr(message, f"onboard_control_sensors_{bits}", 0)
    assert watch().battery_problem(message, is_armed=True) == ""


@pytest.mark.parametrize(
    "autopilot, text, is_low",
    [
        (ARDUPILOT, "Battery Failsafe", True),
        (ARDUPILOT, "Battery 1 is low 9.00V used 12 mAh", True),
        (ARDUPILOT, "Radio Failsafe", False),
        (PX4, "Low battery", True),
        (PX4, "Battery 1 disconnected", True),
        (PX4, "Takeoff detected", False),
    ],
)
def test_texts_tell_a_low_battery(autopilot, text, is_low):
    health = watch(autopilot)
    assert health.take_text(text, 0.0) == is_low
    assert health.battery_problem(system(), is_armed=True) == (text if is_low else "")
    assert health.battery_problem(system(), is_armed=False) == ""  # a new one


@pytest.mark.parametrize("is_told", ["voltage", "health", "text"])
def test_a_low_battery_lands_the_vehicle(is_told):
    flight = Flight().to_flight()
    if is_told == "text":
        flight.adapter.receive("STATUSTEXT", 1, text("Battery Failsafe"), flight.now_s)
        said = "Battery Failsafe"
    else:
        message = system(9000) if is_told == "voltage" else system(health=SENSORS & ~BATTERY)
        flight.vehicle._periods.pop("SYS_STATUS")
        flight.adapter.receive("SYS_STATUS", 1, message, flight.now_s)
        said = "battery at 9.00 V" if is_told == "voltage" else "says that the battery is low"
    assert not flight.run(1.9, lambda: flight.state is not State.FLYING)  # it may sag for 2 s
    assert flight.run(0.3, lambda: flight.state is State.LANDING)
    assert said in flight.machine.reason


# Position.


def test_a_receiver_counts_when_it_has_had_a_position():
    health = watch()
    health.take_receiver(receiver(1, 3))
    assert health.position_problem(0.0) == ""  # a vehicle that flies by another estimate
    health.take_receiver(receiver(6))
    assert health.position_problem(0.0) == ""
    for fix in (0, 1, 2):
        health.take_receiver(receiver(fix, 3))
        assert health.position_problem(1.0) == "the GPS has lost its position (3 satellites)"
    health.take_receiver(receiver(3))
    assert health.position_problem(2.0) == ""


@pytest.mark.parametrize(
    "autopilot, name, value, is_used",
    [
        (ARDUPILOT, "EK3_SRC1_POSXY", 3.0, True),
        (ARDUPILOT, "EK3_SRC1_POSXY", 6.0, False),  # a pose from outside
        (PX4, "EKF2_GPS_CTRL", 7.0, True),
        (PX4, "EKF2_GPS_CTRL", 0.0, False),
    ],
)
def test_a_receiver_that_the_estimator_does_not_use_does_not_count(autopilot, name, value, is_used):
    health = watch(autopilot, **{name: value})
    health.take_receiver(receiver(3))
    health.take_receiver(receiver(0, 0))
    assert bool(health.position_problem(0.0)) == is_used


@pytest.mark.parametrize(
    "message, problem",
    [
        (estimator(831), ""),
        (estimator(831 & ~16), ""),  # a relative position, by optical flow
        (estimator(167), "the estimator has no position that counts (flags 167)"),
        (estimator(831 | GLITCH), "the estimator has no position that counts (flags 33599)"),
        (estimator(831, 1.0), "the estimator rejects its measurements of position or velocity"),
        (
            estimator(831, velocity=2.0),
            "the estimator rejects its measurements of position or velocity",
        ),
        (estimator(831, float("nan")), ""),  # PX4: nothing is measured
    ],
)
def test_the_estimator_tells_whether_its_position_counts(message, problem):
    health = watch()
    health.take_estimator(message)
    assert health.position_problem(0.0) == problem
    health.take_estimator(estimator(831))
    assert health.position_problem(0.0) == ""


@pytest.mark.parametrize(
    "autopilot, text, counts",
    [
        (ARDUPILOT, "EKF variance", True),
        (ARDUPILOT, "EKF3 IMU1 stopped aiding", True),
        (ARDUPILOT, "EKF3 IMU0 is using GPS", False),
        (PX4, "GNSS data fusion stopped", True),
    ],
)
def test_texts_about_the_position_count_for_5_s(autopilot, text, counts):
    health = watch(autopilot)
    health.take_text(text, 10.0)
    assert health.position_problem(14.9) == (text if counts else "")
    assert health.position_problem(15.0) == ""


def test_without_gps_or_with_a_low_battery_it_stays_on_the_ground():
    flight = Flight().to_ready()
    flight.vehicle.lose_receiver()
    flight.vehicle.battery, flight.vehicle.voltage_v = 100, 9.0
    flight.run(2.0)
    assert flight.state is State.NOT_READY
    assert "the GPS has lost its position (3 satellites)" in flight.machine.reason
    assert "battery at 9.00 V, expected 10.5 V or more" in flight.machine.reason


def test_a_gap_of_the_receiver_is_flown_through():
    flight = Flight().to_flight()
    flight.vehicle.estimator.is_dead_reckoning = True
    assert flight.run(0.9, lambda: flight.state is State.HOLDING)
    flight.vehicle.estimator.is_dead_reckoning = False
    assert flight.run(0.5, lambda: flight.state is State.FLYING)


# The autopilot acts by itself.


def text(words, severity=4):
    return SimpleNamespace(text=words, severity=severity, id=0)


def heartbeat(mode, base_mode=209):
    return SimpleNamespace(autopilot=3, base_mode=base_mode, custom_mode=mode)


@pytest.mark.parametrize(
    "mode, texts, reason",
    [
        (9, ["GCS Failsafe"], "LAND by the autopilot: GCS Failsafe"),
        (
            9,
            ["EKF variance", "EKF Failsafe: changed to LAND Mode"],
            "LAND by the autopilot: EKF variance; EKF Failsafe: changed to LAND Mode",
        ),
        (9, ["Radio Failsafe Cleared", "EKF3 lane switch 1"], "LAND from outside"),
        (5, [], "LOITER from outside"),
    ],
)
@pytest.mark.parametrize("texts_first", [False, True])
def test_the_autopilots_own_reason_for_a_new_mode(mode, texts, reason, texts_first):
    """Recorded: the heartbeat with the new mode, and 1 to 3 ms later the texts."""
    flight = Flight().to_flight()
    messages = [("HEARTBEAT", heartbeat(mode))]
    told = [("STATUSTEXT", text(words)) for words in texts]
    for name, message in told + messages if texts_first else messages + told:
        flight.adapter.receive(name, 1, message, flight.now_s)
        flight._tick()
    flight.vehicle.mode = mode
    flight.run(0.1)
    assert flight.state is State.TAKEN_OVER and flight.pauses == 1
    assert flight.machine.reason == f"the mode was changed to {reason}"
    assert f"taken over: the mode was changed to {reason}" in [line for _, line in flight.news]
    flight.run(3.0)
    assert flight.machine.reason == f"the mode was changed to {reason}"


def test_the_autopilots_own_reason_for_disarming():
    """The text comes at once, the heartbeat that tells it up to 1 s later."""
    flight = Flight().to_flight()
    words = "Crash: Disarming: AngErr=55>30, Accel=1.0<3.0"
    flight.adapter.receive("STATUSTEXT", 1, text(words, 2), flight.now_s)
    flight.run(0.9)
    flight.vehicle.kill_motors()
    flight.vehicle.heartbeat()
    assert flight.run(0.1, lambda: flight.state is State.TAKEN_OVER)
    assert flight.machine.reason == f"the motors were disarmed by the autopilot: {words}"


def test_old_texts_explain_nothing_and_many_make_no_long_reason():
    flight = Flight().to_flight()
    for k in range(1000):
        flight.adapter.receive("STATUSTEXT", 1, text(f"Failsafe {k}"), flight.now_s)
    flight.run(2.0)
    for k in range(1000, 2000):
        flight.adapter.receive("STATUSTEXT", 1, text(f"Failsafe {k}"), flight.now_s)
    flight.vehicle.set_mode(9)
    flight.run(0.1)
    told = "; ".join(f"Failsafe {k}" for k in range(1996, 2000))
    assert flight.machine.reason == f"the mode was changed to LAND by the autopilot: {told}"
    flight = Flight().to_flight()
    flight.adapter.receive("STATUSTEXT", 1, text("Radio Failsafe - Continuing"), flight.now_s)
    flight.run(2.0)
    flight.vehicle.set_mode(5)
    flight.run(0.1)
    assert flight.machine.reason == "the mode was changed to LOITER from outside"


# Heartbeats of others.


def test_another_station_with_our_number_is_told_and_keeps_the_vehicle_on_the_ground():
    flight = Flight()
    flight.to_ready()
    for _ in range(4):
        other = SimpleNamespace(autopilot=8)
        flight.adapter.receive_other(OUR_SYSTEM, other, flight.now_s)
        flight.run(1.0)
    told = "another station sends heartbeats as system 240, as the bridge does"
    assert flight.state is State.NOT_READY and told in flight.machine.reason
    assert sum(line.startswith(told) for _, line in flight.news) == 1
    assert flight.run(5.1, lambda: flight.state is State.READY)  # it has gone
    flight.to_flight()
    flight.adapter.receive_other(OUR_SYSTEM, SimpleNamespace(autopilot=8), flight.now_s)
    flight.run(0.5)
    assert flight.state is State.FLYING and flight.news[-1][1].startswith(told)


def test_heartbeats_of_other_vehicles_are_told_while_the_vehicle_is_not_heard():
    flight = Flight()
    flight.hears = False
    flight.adapter.receive_other(255, SimpleNamespace(autopilot=8), flight.now_s)
    flight.run(0.1)
    assert flight.machine.reason == "no heartbeat yet"
    for number in (7, 2):
        flight.adapter.receive_other(number, SimpleNamespace(autopilot=3), flight.now_s)
    flight.run(0.1)
    assert flight.state is State.NO_LINK
    assert flight.machine.reason == "heartbeats of system 2, 7, expected 1"
    flight.hears = True
    assert flight.run(10.0, lambda: flight.state is State.READY)


def test_an_autopilot_of_another_kind_is_told():
    flight = Flight()
    flight.hears = False
    message = SimpleNamespace(autopilot=12, base_mode=81, custom_mode=0)
    flight.adapter.receive("HEARTBEAT", 1, message, flight.now_s)
    flight.run(0.1)
    assert flight.machine.reason == "the autopilot's number is 12, expected 3 (ardupilot)"
