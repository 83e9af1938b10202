"""Files of vehicles: every fault at once, with its place."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import yaml

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.vehicle.vehicle_file import load_vehicles, vehicles_from_document

ROOT = Path(__file__).resolve().parents[2]
GOOD = """
vehicles:
  - number: 1
    kind: mavlink
    autopilot: px4
    address: "udpin:127.0.0.1:14552"
    odom: [1.0, 2.0, 0.5, 1.5707963267948966]
    lidar: {obstacle_distance: true}
  - {number: 0, kind: mavlink, address: "udpin:127.0.0.1:14551", system: 7, start: [1, 2, 3],
     altitude: 1.5, radio: false, failsafes: set, limits: {speed: 0.4, battery: 0.3}}
  - {number: 2, kind: simulated}
"""


def read(text):
    return vehicles_from_document(yaml.safe_load(text), "v.yaml")


def faults(text):
    with pytest.raises(InputError) as error:
        read(text)
    return error.value.problems


def test_a_good_file():
    first, second, third = read(GOOD)
    assert [one.number for one in (first, second, third)] == [0, 1, 2]
    assert (first.system, first.altitude_m, first.has_radio) == (7, 1.5, False)
    assert (first.limits.speed_mps, first.limits.battery, first.limits.climb_mps) == (0.4, 0.3, 0.3)
    assert first.map_from_start == Pose2D(1.0, 2.0, 3.0) and first.sets_failsafes
    assert second.autopilot == "px4" and second.lidar.is_obstacle_distance
    assert second.map_from_odom.yaw_rad == pytest.approx(math.pi / 2)
    assert second.has_roof and not second.sets_failsafes
    assert third.kind == "simulated"


def test_every_fault_is_listed_at_once():
    found = faults("""
roof: maybe
vehicles:
  - {number: 0, kind: balloon, address: "", start: [1, 2], speed: 3}
  - {number: 0, kind: mavlink, address: x, altitude: -1, system: 255, limits: {battery: 20}}
""")
    expected = [
        "v.yaml: roof: 'maybe', expected true or false",
        "v.yaml: vehicles[0].speed: unknown key",
        "v.yaml: vehicles[0].kind: 'balloon', expected mavlink or crazyflie or simulated",
        "v.yaml: vehicles[0].start: a list of 2, expected a list of 3 numbers",
        "v.yaml: vehicles[0].address: ''",
        "v.yaml: vehicles[1].limits.battery: 20, expected a share from 0 to 1",
        "v.yaml: vehicles[1].altitude: -1, expected a number above 0",
        "v.yaml: vehicles[1]: none given, expected one of start, odom, localisation: true",
        "v.yaml: vehicles[1].system: 255, expected a whole number, 1 to 254",
    ]
    assert len(found) == len(expected)
    for start in expected:
        assert any(line.startswith(start) for line in found), (start, found)


@pytest.mark.parametrize(
    "change, text",
    [
        (("number: 1", "number: 5"), "numbers [0, 2, 5], expected each of 0 to 2 once"),
        (("14551", "14552"), "two vehicles have the address udpin:127.0.0.1:14552"),
        (("altitude: 1.5", "altitude: 2.4"), "expected 0.3 m or more below limits.height"),
        (("start: [1, 2, 3]", "start: [1, 2, 3], localisation: true"), "start and localisation"),
        (("obstacle_distance: true", "mount: [0, 0, 0, 0]"), "expected one of topic"),
    ],
)
def test_fault(change, text):
    assert any(text in line for line in faults(GOOD.replace(*change)))


CRAZYFLIE = """
vehicles:
  - {number: 0, kind: crazyflie, address: "radio://0/80/2M", link_lost: falls, start: [1, 2, 3],
     lidar: {multiranger: true}}
"""


def test_a_crazyflie():
    (vehicle,) = read(CRAZYFLIE)
    assert vehicle.kind == "crazyflie" and vehicle.lidar.is_multiranger


@pytest.mark.parametrize(
    "change, text",
    [
        ((" link_lost: falls,", ""), "vehicles[0].link_lost: a crazyflie that hears nothing stops"),
        (("kind: crazyflie", "kind: mavlink"), "a mavlink vehicle has no such deck"),
        (("multiranger", "obstacle_distance"), "a crazyflie vehicle has no such message"),
    ],
)
def test_fault_of_a_crazyflie(change, text):
    assert any(text in line for line in faults(CRAZYFLIE.replace(*change)))


def test_the_test_files_and_the_documents_files_load(tmp_path):
    for name in ("two_vehicles", "mixed_vehicles", "two_crazyflies"):
        assert len(load_vehicles(ROOT / f"test/ros/{name}.yaml")) == 2
    page = (ROOT / "docs/vehicles.md").read_text()
    blocks = [part.split("```")[0] for part in page.split("```yaml\n")[1:]]
    assert len(blocks) == 4
    for block in blocks:
        indent = len(block) - len(block.lstrip(" "))
        lines = "\n".join(line[indent:] for line in block.splitlines())
        path = tmp_path / "vehicles.yaml"
        path.write_text(lines)
        assert load_vehicles(path)
