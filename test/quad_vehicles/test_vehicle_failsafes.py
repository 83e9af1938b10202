"""Which parameters of an autopilot keep the vehicle on the ground, and which are written."""

from __future__ import annotations

from dataclasses import replace

import pytest
from vehicles.point_vehicle import ARDUPILOT, PX4
from vehicles.virtual_flight import StandInFlight

from quad_nav.topics.vehicle_states import State
from quad_vehicles import failsafes
from quad_vehicles.vehicle_file import Vehicle

VEHICLE = Vehicle(3, "mavlink", bridge_system=237)
SETS = Vehicle(3, "mavlink", bridge_system=237, sets_failsafes=True)
OUTDOORS = Vehicle(3, "mavlink", bridge_system=237, has_roof=False)
OWN = failsafes.own_parameters("ardupilot", VEHICLE.limits)
SAFE = {**ARDUPILOT["parameters"], **OWN, "SYSID_MYGCS": 237.0}
PX4_VEHICLE = Vehicle(0, "mavlink", "px4")
PX4_SAFE = {**PX4["parameters"], **failsafes.own_parameters("px4", PX4_VEHICLE.limits)}


def without(name, **values):
    return {key: value for key, value in {**SAFE, **values}.items() if key != name}


def test_safe_parameters_have_no_faults():
    assert failsafes.faults(SAFE, VEHICLE) == []
    assert failsafes.wanted(SAFE, SETS) == {}
    assert failsafes.faults(PX4_SAFE, PX4_VEHICLE) == []


@pytest.mark.parametrize(
    "values, name, number",
    [
        ({**SAFE, "SYSID_MYGCS": 255.0}, "SYSID_MYGCS", "255"),
        ({**SAFE, "SYSID_MYGCS": 240.0}, "SYSID_MYGCS", "240"),  # another vehicle's bridge
        (without("SYSID_MYGCS", MAV_GCS_SYSID=255.0), "MAV_GCS_SYSID", "255"),
    ],
)
def test_another_ground_station_is_refused_or_written(values, name, number):
    (fault,) = failsafes.faults(values, VEHICLE)
    assert fault == (
        f"{name}: is {number}: it does not notice when the bridge dies, because it counts another"
        " station's heartbeats, not those of the bridge, system 237; set it to 237"
    )
    assert failsafes.wanted(values, VEHICLE) == {}
    assert failsafes.wanted(values, SETS) == {name: 237.0}


def test_a_range_of_ground_stations_is_refused_or_written():
    values = without("SYSID_MYGCS", MAV_GCS_SYSID=237.0, MAV_GCS_SYSID_HI=255.0)
    (fault,) = failsafes.faults(values, VEHICLE)
    assert fault.startswith("MAV_GCS_SYSID_HI: is 255: it does not notice when the bridge dies")
    assert failsafes.wanted(values, SETS) == {"MAV_GCS_SYSID_HI": 0.0}
    assert failsafes.faults({**values, "MAV_GCS_SYSID_HI": 0.0}, VEHICLE) == []


def test_an_autopilot_that_does_not_tell_its_ground_station_is_refused():
    (fault,) = failsafes.faults(without("SYSID_MYGCS"), VEHICLE)
    assert fault.endswith("the autopilot does not answer")


@pytest.mark.parametrize(
    "action, vehicle, problem",
    [
        (0.0, OUTDOORS, "it does not land when the battery is low"),
        (5.0, OUTDOORS, "it does not land when the battery is low"),  # it stops the motors
        (1.0, VEHICLE, ""),
        (2.0, VEHICLE, "it climbs to 15 m (RTL_ALT)"),
        (6.0, VEHICLE, "it climbs to 15 m (RTL_ALT)"),
        (2.0, OUTDOORS, ""),
    ],
)
def test_what_it_does_about_a_low_battery(action, vehicle, problem):
    values = {**SAFE, "BATT_FS_LOW_ACT": action}
    faults = failsafes.faults(values, vehicle)
    assert len(faults) == bool(problem) and all(problem in one for one in faults)
    if vehicle is VEHICLE and problem:
        assert failsafes.wanted(values, SETS) == {"BATT_FS_LOW_ACT": 1.0}


def test_a_voltage_that_nobody_watches_is_refused_and_not_invented():
    values = {**SAFE, "BATT_LOW_VOLT": 0.0}
    (fault,) = failsafes.faults(values, VEHICLE)
    assert fault == (
        "BATT_LOW_VOLT: is 0: it does not notice a low voltage; set it to 3.5 for each cell of the"
        " battery"
    )
    assert failsafes.wanted(values, SETS) == {}


@pytest.mark.parametrize(
    "name, value, problem",
    [
        ("COM_LOW_BAT_ACT", 0.0, "it does not land when the battery is low; set it to 2"),
        ("COM_OBL_RC_ACT", 5.0, "it holds for ever when the bridge dies"),
    ],
)
def test_px4_lands_by_itself(name, value, problem):
    (fault,) = failsafes.faults({**PX4_SAFE, name: value}, PX4_VEHICLE)
    assert fault.startswith(f"{name}: is {value:g}: {problem}")


@pytest.mark.parametrize("sets_failsafes", [False, True])
def test_a_new_autopilot_is_refused_or_made_ready(sets_failsafes):
    """One with ArduPilot's own values, which listens to a ground station with the number 255."""
    flight = StandInFlight()
    vehicle = flight.vehicle
    vehicle.parameters.update(type(vehicle).DEFAULTS)
    flight.adapter._vehicle = replace(flight.adapter._vehicle, sets_failsafes=sets_failsafes)
    flight.run(10.0)
    values = [vehicle.parameters[name] for name in ("SYSID_MYGCS", "BATT_FS_LOW_ACT")]
    if sets_failsafes:
        assert flight.state is State.READY and values == [240.0, 1.0]
    else:
        assert flight.state is State.NOT_READY and values == [255.0, 0.0]
        assert "SYSID_MYGCS: is 255" in flight.machine.reason
        assert "BATT_FS_LOW_ACT: is 0" in flight.machine.reason
    flight.end()
