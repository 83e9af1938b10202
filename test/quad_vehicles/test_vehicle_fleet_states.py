"""The node of all vehicles: bridges that have died, and files that do not fit the scene."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

rospy = pytest.importorskip("rospy")

from ros.fake_ros import FakeRos, FakeService, deliver  # noqa: E402
from ros.own_messages import state_message  # noqa: E402
from std_srvs.srv import TriggerRequest  # noqa: E402

from quad_nav.errors import InputError  # noqa: E402
from quad_nav.geometry import Pose2D  # noqa: E402
from quad_vehicles.ros import fleet  # noqa: E402
from quad_vehicles.ros.fleet import VehicleFleet, read_setup  # noqa: E402
from quad_vehicles.vehicle_file import Vehicle  # noqa: E402

ARENA = Path(__file__).resolve().parents[2] / "scenes" / "arena.yaml"


class Wall:
    """Wall time, which passes while a service waits."""

    now_s, on_sleep = 100.0, staticmethod(lambda: None)

    def monotonic(self):
        return self.now_s

    def sleep(self, seconds):
        self.now_s += seconds
        self.on_sleep()


@pytest.fixture
def wall(monkeypatch):
    with FakeRos("/vehicles"):
        monkeypatch.setattr(fleet, "time", Wall())
        VehicleFleet([Vehicle(k, "mavlink", map_from_start=Pose2D(k, 0.0)) for k in (0, 1)], True)
        yield fleet.time


def tell(number, state, reason=""):
    deliver(f"/vehicle{number}/state", state_message(state, reason))


def call(service):
    response = FakeService.all[f"/vehicles/{service}"].handler(TriggerRequest())
    return response.success, response.message


def test_a_vehicle_whose_bridge_has_died_in_flight_is_not_reported_as_flying(wall):
    tell(0, "flying")
    tell(1, "landed")
    wall.now_s += 3.1
    tell(1, "landed")
    start_s = wall.now_s
    assert call("land") == (
        False,
        "still in the air: quad0 (its bridge is silent, last state: flying)",
    )
    assert wall.now_s == start_s  # there is nothing to wait for


def test_landing_waits_for_those_whose_bridges_live(wall):
    tell(0, "flying")
    tell(1, "landing", "asked to land")
    start_s = wall.now_s

    def land():
        if wall.now_s < start_s + 4.0:
            tell(1, "landing", "asked to land")
        else:
            tell(1, "landed")

    wall.on_sleep = land
    assert call("land")[1] == "still in the air: quad0 (its bridge is silent, last state: flying)"
    assert wall.now_s == pytest.approx(start_s + 4.0, abs=0.2)


def test_take_off_names_bridges_that_are_silent_or_missing(wall):
    tell(0, "ready")
    is_good, text = call("take_off")
    assert not is_good
    assert text == "quad0: its bridge is silent, last state: ready; quad1: no bridge"


def test_take_off_names_the_reason_of_a_vehicle_that_is_not_ready(wall):
    wall.on_sleep = lambda: (tell(0, "ready"), tell(1, "not ready", "no position estimate"))
    assert call("take_off") == (False, "quad1: not ready: no position estimate")


def vehicles_file(tmp_path, *vehicles):
    path = tmp_path / "vehicles.yaml"
    numbered = [{"number": k, **one} for k, one in enumerate(vehicles)]
    path.write_text(yaml.safe_dump({"vehicles": numbered}))
    return path


REAL = {"kind": "mavlink", "address": "udpin:127.0.0.1:14551"}


@pytest.mark.parametrize(
    "vehicles, fault",
    [
        (
            [{**REAL, "start": [50.0, 1.5, 0.0]}],
            "vehicles[0].start: (50, 1.5) is outside the arena, expected 0 < x <",
        ),
        (
            [{**REAL, "start": [1.5, 1.5, 0.0]}, {"kind": "simulated", "start": [5.0, -1.0, 0.0]}],
            "vehicles[1].start: (5, -1) is outside the arena, expected 0 < x <",
        ),
        (  # the scene's second start pose
            [{**REAL, "start": [10.0, 2.0, 0.0]}, {"kind": "simulated"}],
            "quad1: starts less than 0.6 m from quad0, expected a place of its own",
        ),
    ],
)
def test_a_start_that_does_not_fit_the_scene_is_a_fault(tmp_path, vehicles, fault):
    path = vehicles_file(tmp_path, *vehicles)
    with pytest.raises(InputError) as error:
        read_setup({"vehicles": str(path), "scene": str(ARENA)}, "vehicles")
    (found,) = error.value.problems
    assert found.startswith(f"{path}: {fault}") or found == fault


def test_starts_in_the_scene_are_good(tmp_path):
    path = vehicles_file(tmp_path, {**REAL, "start": [1.5, 1.5, 0.0]}, {"kind": "simulated"})
    _, vehicles, scene = read_setup({"vehicles": str(path), "scene": str(ARENA)}, "vehicles")
    assert len(vehicles) == 2 and scene.contains(1.5, 1.5)
