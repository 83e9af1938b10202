"""Files of vehicles: every fault at once, with its place."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import yaml

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_vehicles import localizers
from quad_vehicles.addresses import address_problem, share
from quad_vehicles.vehicle_file import OUR_SYSTEM, load_vehicles, vehicles_from_document

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


LOCALIZED = """
vehicles:
  - {number: 0, kind: mavlink, address: "udpin:127.0.0.1:14551", start: [1.5, 1.5, 0]}"""


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
        "v.yaml: vehicles[1]: none given with localization fixed, expected start or odom",
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
        (("start: [1, 2, 3]", "start: [1, 2, 3], odom: [0, 0, 0, 0]"), "start and odom given"),
        (("obstacle_distance: true", "mount: [0, 0, 0, 0]"), "expected one of topic"),
    ],
)
def test_fault(change, text):
    assert any(text in line for line in faults(GOOD.replace(*change)))


@pytest.mark.parametrize(
    "text, change, fault",
    [
        ("localization: gps", (), "localization: 'gps', expected fixed or amcl or slam or none"),
        ("localization: slam\nmap: v.yaml", (), "map: given with localization slam, expected amcl"),
        ("localization: amcl\nmap: no.yaml", (), "map: no.yaml is no file, expected a map, a"),
        (
            "localization: amcl",
            ("start: [1.5, 1.5, 0]", "odom: [0, 0, 0, 0]"),
            "vehicles[0]: odom given with localization amcl, expected start",
        ),
        (
            "localization: slam",
            (", start: [1.5, 1.5, 0]", ""),
            "vehicles[0]: none given with localization slam, expected start",
        ),
        (
            "localization: none",
            ("start: [1.5, 1.5, 0]", "odom: [0, 0, 0, 0]"),
            "vehicles[0]: odom given with localization none, expected start",
        ),
        (
            "localization: slam",
            ("number: 0", "number: 1}\n  - {number: 0, kind: simulated}\n  - {number: 2"),
            "vehicles[1].kind: simulated with localization slam, expected a real vehicle",
        ),
    ],
)
def test_fault_of_a_localization(text, change, fault):
    change = change or ("", "")
    found = faults(f"{text}\n{LOCALIZED.replace(*change)}")
    assert any(line.startswith(f"v.yaml: {fault}") for line in found), found


def test_a_file_with_a_map_beside_it(tmp_path):
    (tmp_path / "hall.yaml").write_text("")
    path = tmp_path / "vehicles.yaml"
    path.write_text(f"localization: amcl\nmap: hall.yaml\n{LOCALIZED}")
    (vehicle,) = load_vehicles(path)
    assert (vehicle.localization, vehicle.map_file) == ("amcl", str(tmp_path / "hall.yaml"))
    assert vehicle.map_from_start == Pose2D(1.5, 1.5, 0.0)


@pytest.mark.parametrize(
    "text, node, expected",
    [
        ("fixed", "amcl", None),
        ("amcl", "slam", None),
        ("slam", "map_server", None),
        ("amcl", "map_server", ["room.yaml"]),
        ("slam", "slam", ["_start0:=[1.5, 1.5, 0.0]"]),
        (
            "amcl",
            "amcl",
            ["_initial_pose_x:=1.5", "_initial_pose_y:=1.5", "_initial_pose_a:=0.0"],
        ),
    ],
)
def test_the_localizers_that_a_file_asks_for(text, node, expected):
    vehicles = read(f"localization: {text}\n{LOCALIZED}")
    assert localizers.arguments(node, vehicles, "room.yaml", 0) == expected


def test_a_simulated_vehicle_has_no_amcl():
    vehicles = read(f"localization: amcl\n{LOCALIZED}\n  - {{number: 1, kind: simulated}}")
    assert localizers.arguments("amcl", vehicles, "room.yaml", 1) is None


def two(first, second):
    """A file with two vehicles, each with the given fields beside the usual ones."""
    usual = [
        {"kind": "mavlink", "address": f"udpin:127.0.0.1:1455{k}", "start": [1.5, 1.5 + k, 0.0]}
        for k in range(2)
    ]
    vehicles = [{"number": k, **usual[k], **one} for k, one in enumerate((first, second))]
    return yaml.safe_dump({"vehicles": vehicles})


@pytest.mark.parametrize(
    "second, fault",
    [
        (
            {"start": [1.6, 1.5, 0.0]},
            "start: 0.10 m from vehicles[0].start, expected 0.2 m or more",
        ),
        ({"start": [50.0, 1.5, 0.0]}, "start: (50, 1.5) is not in the room"),
        ({"altitude": 0.01}, "altitude: 0.01, expected 0.2 m or more"),
        ({"limits": {"speed": 50}}, "limits.speed: 50, expected 5 or less"),
        ({"limits": {"radius": 1e5}}, "limits.radius: 100000, expected 500 or less"),
        (
            {"address": "udpin:127.0.0.1:99999"},
            "address: udpin:127.0.0.1:99999, expected udpin:HOST:PORT with a port from 1 to 65535",
        ),
        (
            {"address": "tcp:127.0.0.1"},
            "address: tcp:127.0.0.1, expected tcp:HOST:PORT with a port from 1 to 65535",
        ),
        (
            {"address": "udpin:0.0.0.0:14550"},
            "address: udpin:0.0.0.0:14550 takes what vehicles[0] has, udpin:127.0.0.1:14550;"
            " expected a port for each",
        ),
        ({"number": 0}, None),
        ({"system": 240}, None),
        ({"system": 2, "bridge_system": 240}, "bridge_system: 240, the number of a vehicle or of"),
        ({"system": 2, "bridge_system": 1}, "bridge_system: 1, the number of a vehicle or of"),
        ({"bridge_system": 255}, "bridge_system: 255, expected a whole number, 1 to 254"),
    ],
)
def test_a_fault_is_listed_with_file_and_place(second, fault):
    def room(start):
        return "" if start.x_m < 20.0 else f"({start.x_m:g}, {start.y_m:g}) is not in the room"

    with pytest.raises(InputError) as error:
        vehicles_from_document(yaml.safe_load(two({}, second)), "v.yaml", room)
    (found,) = error.value.problems
    if "number" in second:
        assert found == "v.yaml: vehicles: numbers [0, 0], expected each of 0 to 1 once"
    elif fault is None:  # vehicle 1 has the number of the first bridge
        assert found.startswith("v.yaml: vehicles[0].bridge_system: 240, the number of a vehicle")
    else:
        assert found.startswith(f"v.yaml: vehicles[1].{fault}")


def test_each_bridge_has_a_system_number_of_its_own():
    first, second = read(two({}, {"system": 2}))
    assert (first.bridge_system, second.bridge_system) == (OUR_SYSTEM, OUR_SYSTEM - 1) == (240, 239)
    first, _ = read(two({"bridge_system": 17}, {}))
    assert first.bridge_system == 17


@pytest.mark.parametrize(
    "address, other, is_shared",
    [
        ("udpin:127.0.0.1:14550", "udpin:0.0.0.0:14550", True),
        ("0.0.0.0:14550", "udpin:127.0.0.1:14550", True),
        ("udpin:localhost:14550", "udpin:127.0.0.1:14550", True),
        ("udpin:127.0.0.1:14550", "udpin:192.168.1.5:14550", False),
        ("udpout:192.168.1.5:14550", "udpout:192.168.1.6:14550", False),
        ("tcpin:0.0.0.0:5760", "udpin:0.0.0.0:5760", False),
        ("/dev/ttyUSB0,57600", "/dev/ttyUSB0,115200", True),
        ("radio://0/80/2M/E7E7E7E7E7", "radio://0/90/2M/E7E7E7E7E8", True),
        ("tcp://127.0.0.1:14661", "tcp://127.0.0.1:14662", False),
    ],
)
def test_what_two_addresses_share(address, other, is_shared):
    assert share(address, other) == share(other, address) == is_shared


def test_a_file_is_no_address(tmp_path):
    """Pymavlink would replay it, or run a program."""
    path = tmp_path / "vehicle.elf"
    path.write_text("")
    assert address_problem(str(path)) == f"{path} is a file, expected a serial line or a port"
    assert address_problem("/dev/null") == ""


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
    names = ("vehicles", "crazyflie", "vehicle_simulation")
    pages = [(ROOT / f"docs/{name}.md").read_text() for name in names]
    blocks = [part.split("```")[0] for page in pages for part in page.split("```yaml\n")[1:]]
    assert len(blocks) == 4
    for block in blocks:
        indent = len(block) - len(block.lstrip(" "))
        lines = "\n".join(line[indent:] for line in block.splitlines())
        path = tmp_path / "vehicles.yaml"
        path.write_text(lines)
        assert load_vehicles(path)
