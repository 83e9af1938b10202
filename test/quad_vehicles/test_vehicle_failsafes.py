"""Which parameters of an autopilot keep the vehicle on the ground, and which are written."""

from __future__ import annotations

from dataclasses import replace

import pytest
from vehicles.ardupilot import ArduPilot
from vehicles.px4 import Px4
from vehicles.virtual_flight import SAFE_ARDUPILOT, SAFE_PX4, Flight

from quad_nav.topics.vehicle_states import State
from quad_vehicles import failsafes
from quad_vehicles.vehicle_file import Vehicle

VEHICLE = Vehicle(3, "mavlink", bridge_system=237)
SETS = Vehicle(3, "mavlink", bridge_system=237, sets_failsafes=True)
OUTDOORS = Vehicle(3, "mavlink", bridge_system=237, has_roof=False)
NO_RADIO = Vehicle(3, "mavlink", bridge_system=237, has_radio=False)
OWN = failsafes.own_parameters("ardupilot", VEHICLE.limits)
SAFE = {**ArduPilot.DEFAULTS, **SAFE_ARDUPILOT, **OWN, "SYSID_MYGCS": 237.0}
PX4_VEHICLE = Vehicle(0, "mavlink", "px4")
PX4_OWN = failsafes.own_parameters("px4", PX4_VEHICLE.limits)
PX4_SAFE = {**Px4.DEFAULTS, **SAFE_PX4, **PX4_OWN}


def without(name, **values):
    return {key: value for key, value in {**SAFE, **values}.items() if key != name}


def test_safe_parameters_have_no_faults():
    assert failsafes.faults(SAFE, VEHICLE) == []
    assert failsafes.wanted(SAFE, SETS) == {}
    assert failsafes.wanted({**SAFE, "BATT_FS_LOW_ACT": 2.0}, SETS) == {"BATT_FS_LOW_ACT": 1.0}
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
    "values, vehicle, problem",
    [
        ({"FS_GCS_ENABLE": 0.0}, OUTDOORS, "it does nothing when the link to this machine is lost"),
        ({"FS_GCS_ENABLE": 1.0}, VEHICLE, "it climbs to 15 m (RTL_ALT), expected 2.5 m or less"),
        ({"FS_GCS_ENABLE": 1.0}, OUTDOORS, ""),
        ({"FS_GCS_ENABLE": 1.0, "RTL_ALT": 200.0}, VEHICLE, ""),
        ({"FS_GCS_ENABLE": 1.0, "RTL_ALT": None}, VEHICLE, "at a height that it does not tell"),
        ({"FS_THR_ENABLE": 0.0}, VEHICLE, "it does nothing when the radio is lost; set it to 3"),
        ({"FS_THR_ENABLE": 0.0}, NO_RADIO, ""),
        ({"FS_THR_ENABLE": 1.0}, VEHICLE, "it climbs to 15 m"),
        (
            {"FS_THR_ENABLE": 1.0},
            NO_RADIO,
            "it climbs to 15 m (RTL_ALT), expected 2.5 m or less; set it to 0",
        ),
        ({"FS_THR_ENABLE": 1.0, "FS_OPTIONS": 4.0}, VEHICLE, ""),  # it flies on under our control
        ({"FS_EKF_ACTION": 0.0}, VEHICLE, "it does not land when it loses its position"),
        ({"FS_EKF_ACTION": None}, VEHICLE, ""),
        ({"FS_EKF_ACTION": 3.0}, VEHICLE, ""),
        ({"BATT_FS_LOW_ACT": 0.0}, OUTDOORS, "it does not land when the battery is low"),
        ({"BATT_FS_LOW_ACT": 5.0}, OUTDOORS, "it does not land when the battery is low"),
        ({"BATT_FS_LOW_ACT": 2.0}, VEHICLE, "it climbs to 15 m (RTL_ALT)"),
        ({"BATT_FS_LOW_ACT": 6.0}, OUTDOORS, ""),
        ({"GUID_TIMEOUT": 3.0}, VEHICLE, "is 3, the autopilot does not take 0.5"),
        ({"GUID_TIMEOUT": None}, VEHICLE, "the autopilot does not answer, expected 0.5"),
        ({"NAV_DLL_ACT": 0.0}, PX4_VEHICLE, "it does not land when the link to this machine"),
        ({"NAV_DLL_ACT": 2.0}, PX4_VEHICLE, "it climbs to 60 m (RTL_RETURN_ALT)"),
        ({"COM_OBL_RC_ACT": 0.0}, PX4_VEHICLE, "it does not land or hold when the set-points stop"),
        ({"COM_OBL_RC_ACT": 3.0}, PX4_VEHICLE, "it climbs to 60 m"),
        ({"COM_OBL_RC_ACT": 5.0}, PX4_VEHICLE, "it holds for ever when the bridge dies"),
        ({"NAV_RCL_ACT": 2.0}, PX4_VEHICLE, "it climbs to 60 m"),
        ({"NAV_RCL_ACT": 1.0}, PX4_VEHICLE, "it does not land when the radio is lost"),
        ({"NAV_RCL_ACT": 1.0, "COM_RCL_EXCEPT": 4.0}, PX4_VEHICLE, ""),
        ({"COM_LOW_BAT_ACT": 0.0}, PX4_VEHICLE, "when the battery is low; set it to 2"),
        ({"COM_LOW_BAT_ACT": 3.0}, PX4_VEHICLE, "it climbs to 60 m"),
    ],
)
def test_what_an_autopilot_that_is_left_alone_may_do(values, vehicle, problem):
    safe = PX4_SAFE if vehicle is PX4_VEHICLE else SAFE
    found = failsafes.faults({**safe, **values}, vehicle)
    assert len(found) == bool(problem)
    assert all(one.startswith(next(iter(values))) and problem in one for one in found)


def test_a_voltage_that_nobody_watches_is_refused_and_not_invented():
    values = {**SAFE, "BATT_LOW_VOLT": 0.0}
    (fault,) = failsafes.faults(values, VEHICLE)
    assert fault == (
        "BATT_LOW_VOLT: is 0: it does not notice a low voltage; set it to 3.5 for each cell of the"
        " battery"
    )
    assert failsafes.wanted(values, SETS) == {}


@pytest.mark.parametrize("sets_failsafes", [False, True])
def test_a_new_autopilot_is_refused_or_made_ready(sets_failsafes):
    """One with ArduPilot's own values, which listens to a ground station with the number 255."""
    flight = Flight()
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
