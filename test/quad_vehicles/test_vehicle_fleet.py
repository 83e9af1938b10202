"""Take-off and landing of all vehicles, among pilots who take one over: the node `vehicles`."""

from __future__ import annotations

import threading
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

rospy = pytest.importorskip("rospy")

from ros.fake_ros import FakePublisher, FakeRos, FakeService, deliver, subscribed  # noqa: E402
from ros.own_messages import event_message, state_message  # noqa: E402
from std_msgs.msg import Empty  # noqa: E402
from std_srvs.srv import TriggerRequest, TriggerResponse  # noqa: E402

from quad_nav.errors import InputError  # noqa: E402
from quad_nav.geometry import Pose2D  # noqa: E402
from quad_nav.mission.actions import Event  # noqa: E402
from quad_nav.topics.mission_events import EVENTS_TOPIC  # noqa: E402
from quad_vehicles.ros import fleet  # noqa: E402
from quad_vehicles.ros.node import LAND_ALL_TOPIC  # noqa: E402
from quad_vehicles.vehicle_file import Vehicle  # noqa: E402

ARENA = Path(__file__).resolve().parents[2] / "scenes" / "arena.yaml"


class Fleet:
    """Two real vehicles, and simulated ones, whose bridges the test plays.

    Attributes:
        now_s: The virtual clock, which sleeping advances.
        calls: Services of the bridges that were called.
        landings: Number of orders to land that the node has published.
        answers: What `/vehicle{i}/take_off` responds, if it does not succeed.
        script: Functions by the times at which they are called.
    """

    def __init__(self, ros, monkeypatch, simulated=0):
        self.ros, self.now_s, self.calls, self.landings = ros, 0.0, [], 0
        self.answers, self.script, self.states = {}, {}, {}
        clock = SimpleNamespace(monotonic=lambda: self.now_s, sleep=self.sleep)
        monkeypatch.setattr(fleet, "time", clock)
        monkeypatch.setattr(rospy, "wait_for_service", lambda *_: None)
        monkeypatch.setattr(rospy, "ServiceProxy", lambda name, _: lambda: self.respond(name))
        monkeypatch.setattr(fleet.threading, "Timer", self.timer)
        kinds = ["mavlink", "mavlink", *["simulated"] * simulated]
        vehicles = [
            Vehicle(k, kind, map_from_start=Pose2D(1.0 + k, 1.0, 0.0))
            for k, kind in enumerate(kinds)
        ]
        self.node = fleet.VehicleFleet(vehicles, lands_when_done=True)
        FakePublisher.all[LAND_ALL_TOPIC].publish = self.count_landing

    def sleep(self, seconds):
        self.now_s += seconds
        for at_s in [at_s for at_s in self.script if at_s <= self.now_s]:
            self.script.pop(at_s)()
        self.tell(**self.states)  # as bridges do once a second

    def timer(self, _, function, arguments):
        return SimpleNamespace(start=lambda: function(*arguments))

    def count_landing(self, _):
        self.landings += 1
        if LAND_ALL_TOPIC in subscribed():
            deliver(LAND_ALL_TOPIC, Empty())  # rospy's nodes hear themselves

    def respond(self, name):
        self.calls.append(name)
        return self.answers.get(name, TriggerResponse(True, "holding"))

    def tell(self, **states):
        self.states.update(states)
        for name, state in states.items():
            deliver(f"/{name}/state", state_message(state, "as the test says"))

    def say(self, robot, event):
        deliver(EVENTS_TOPIC, event_message(robot, event))

    def take_off(self):
        return FakeService.all["/vehicles/take_off"].handler(TriggerRequest())


@pytest.fixture
def ros():
    with FakeRos("/vehicles") as fake:
        yield fake


@pytest.fixture
def flown(ros, monkeypatch):
    return Fleet(ros, monkeypatch)


TAKE_OFFS = ["/vehicle0/take_off", "/vehicle1/take_off"]


def test_all_take_off_when_the_last_is_ready(flown):
    flown.tell(vehicle0="ready", vehicle1="not ready")
    flown.script[45.0] = lambda: flown.tell(vehicle1="ready")
    assert flown.take_off().success
    assert sorted(flown.calls) == TAKE_OFFS
    assert flown.now_s == pytest.approx(45.0, abs=0.11)


def test_a_vehicle_that_was_taken_over_does_not_delay_the_others(flown):
    flown.tell(vehicle0="flying", vehicle1="taken over")
    response = flown.take_off()
    assert response.success
    assert "quad1" in response.message and "taken over" in response.message
    assert (flown.calls, flown.landings, flown.now_s) == (TAKE_OFFS[:1], 0, 0.0)


def test_a_vehicle_that_is_taken_over_in_the_wait_is_left_out_for_good(flown):
    """A person who resumes it on the ground has not asked for a take-off."""
    flown.tell(vehicle0="ready", vehicle1="not ready")
    flown.script[10.0] = lambda: flown.tell(vehicle0="taken over")
    flown.script[20.0] = lambda: flown.tell(vehicle0="ready")
    flown.script[30.0] = lambda: flown.tell(vehicle1="ready")
    assert flown.take_off().success
    assert flown.calls == TAKE_OFFS[1:]


def test_a_pilot_who_takes_over_in_the_climb_lands_nobody(flown):
    flown.tell(vehicle0="ready", vehicle1="ready")
    flown.answers["/vehicle1/take_off"] = TriggerResponse(False, "taken over: LOITER")
    response = flown.take_off()
    assert response.success and "quad1: taken over: LOITER" in response.message
    assert flown.landings == 0


def test_a_vehicle_that_does_not_get_ready_leaves_the_others_as_they_are(flown):
    flown.tell(vehicle0="flying", vehicle1="not ready")
    response = flown.take_off()
    assert not response.success
    assert response.message.startswith("quad1: not ready: as the test says")
    assert (flown.calls, flown.landings) == ([], 0)


def test_a_refusal_to_arm_lands_those_that_have_taken_off(flown):
    flown.tell(vehicle0="ready", vehicle1="ready")
    flown.answers["/vehicle1/take_off"] = TriggerResponse(False, "the autopilot refuses to arm")
    response = flown.take_off()
    assert (response.success, response.message) == (False, "quad1: the autopilot refuses to arm")
    assert flown.landings == 1


def test_a_bridge_that_does_not_respond_is_no_success(flown, monkeypatch):
    flown.tell(vehicle0="ready", vehicle1="ready")
    monkeypatch.setattr(fleet, "CALL_WAIT_S", 0.01)
    released = threading.Event()
    respond = flown.respond
    flown.respond = lambda name: (name == TAKE_OFFS[1] and released.wait(), respond(name))[1]
    response = flown.take_off()
    released.set()
    assert not response.success and "quad1: no response" in response.message


STOPPED = {"/mission/quad0/stopped": True, "/mission/quad1/stopped": True}
ORDERS = {
    "land all": (lambda flown: deliver(LAND_ALL_TOPIC, Empty()), "ordered to land"),
    "land": (
        lambda flown: FakeService.all["/vehicles/land"].handler(TriggerRequest()),
        "ordered to land",
    ),
    "stop": (lambda flown: flown.ros._parameters.update(STOPPED), "no vehicle is left"),
}


@pytest.mark.parametrize("order", ORDERS)
def test_an_order_to_stop_ends_a_take_off_that_waits(flown, order):
    give, text = ORDERS[order]
    flown.tell(vehicle0="ready", vehicle1="not ready")
    flown.script[10.0] = lambda: give(flown)
    flown.script[50.0] = lambda: flown.tell(vehicle1="ready")
    response = flown.take_off()
    assert not response.success and text in response.message
    assert flown.calls == []
    assert LAND_ALL_TOPIC not in subscribed()


def test_a_landing_during_the_take_off_lands_what_takes_off_after_it(flown):
    flown.tell(vehicle0="ready", vehicle1="ready")
    respond = flown.respond

    def land_and_respond(name):
        if name == TAKE_OFFS[0]:
            deliver(LAND_ALL_TOPIC, Empty())  # before the bridge has heard of the take-off
        return respond(name)

    flown.respond = land_and_respond
    response = flown.take_off()
    assert not response.success and "ordered to land" in response.message
    assert flown.landings == 1


def test_a_take_off_of_stopped_missions_that_a_person_asks_for(flown):
    """After a restart: the missions were stopped before the request."""
    flown.ros._parameters.update(STOPPED)
    flown.tell(vehicle0="landed", vehicle1="ready")
    assert flown.take_off().success
    assert sorted(flown.calls) == TAKE_OFFS


def test_a_robot_that_is_stopped_in_the_wait_stays_on_the_ground(flown):
    flown.tell(vehicle0="ready", vehicle1="not ready")
    flown.script[10.0] = lambda: flown.ros._parameters.update({"/mission/quad0/stopped": True})
    flown.script[50.0] = lambda: flown.tell(vehicle1="ready")
    response = flown.take_off()
    assert response.success and "quad0" in response.message
    assert flown.calls == TAKE_OFFS[1:]


def test_the_last_goal_lands_all(flown):
    flown.tell(vehicle0="flying", vehicle1="flying")
    flown.say(0, Event.DONE)
    assert flown.landings == 0
    flown.say(1, Event.DONE)
    assert flown.landings == 1


def test_the_others_land_when_the_rest_is_taken_over(flown):
    flown.tell(vehicle0="flying", vehicle1="taken over")
    flown.say(0, Event.SENT)
    flown.tell(vehicle0="flying", vehicle1="taken over")
    assert flown.landings == 0
    flown.say(0, Event.DONE)
    assert flown.landings == 1
    flown.tell(vehicle0="landing", vehicle1="taken over")
    assert flown.landings == 1


@pytest.mark.parametrize("is_stopped", [False, True])
def test_a_vehicle_on_the_ground_is_waited_for_unless_its_mission_is_stopped(flown, is_stopped):
    flown.ros._parameters["/mission/quad1/stopped"] = is_stopped
    flown.tell(vehicle0="flying", vehicle1="landed")
    flown.say(0, Event.DONE)
    assert flown.landings == is_stopped
    flown.ros._parameters["/mission/quad1/stopped"] = False
    flown.tell(vehicle0="landed", vehicle1="flying")
    flown.say(1, Event.SENT)
    flown.say(1, Event.DONE)


def test_a_vehicle_that_flies_again_lands_after_its_own_last_goal(ros, monkeypatch):
    flown = Fleet(ros, monkeypatch, simulated=1)
    flown.tell(vehicle0="flying", vehicle1="taken over")
    flown.say(2, Event.DONE)
    flown.say(0, Event.DONE)
    assert flown.landings == 1
    flown.tell(vehicle0="landed", vehicle1="flying")
    flown.say(1, Event.SENT)
    ros._parameters["/mission/quad0/stopped"] = False
    flown.tell(vehicle0="landed")
    assert flown.landings == 1
    flown.say(1, Event.DONE)
    assert flown.landings == 2


# Bridges that have died.


def test_a_vehicle_whose_bridge_has_died_in_flight_is_not_reported_as_flying(flown):
    flown.tell(vehicle0="flying", vehicle1="landed")
    flown.now_s += 3.1
    flown.states.pop("vehicle0")  # it says nothing any more
    flown.tell(vehicle1="landed")
    start_s = flown.now_s
    told = FakeService.all["/vehicles/land"].handler(TriggerRequest())
    silent = "quad0 (its bridge is silent, last state: flying: as the test says)"
    assert (told.success, told.message) == (False, f"still in the air: {silent}")
    assert flown.now_s == start_s  # there is nothing to wait for


def test_landing_waits_for_those_whose_bridges_live(flown):
    flown.tell(vehicle0="flying", vehicle1="landing")
    flown.states.pop("vehicle0")
    flown.script[4.0] = lambda: flown.tell(vehicle1="landed")
    told = FakeService.all["/vehicles/land"].handler(TriggerRequest())
    assert not told.success and "quad0 (its bridge is silent" in told.message
    assert flown.now_s == pytest.approx(4.0, abs=0.2)


def test_take_off_names_bridges_that_are_silent_or_missing(flown):
    flown.tell(vehicle0="ready")
    flown.states.pop("vehicle0")
    silent = "quad0: its bridge is silent, last state: ready: as the test says"
    assert flown.take_off().message == f"{silent}; quad1: no bridge"


# Files that do not fit the scene.


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
        (  # the scene's second start pose
            [{**REAL, "start": [10.0, 2.0, 0.0]}, {"kind": "simulated"}],
            "quad1: starts less than 0.6 m from quad0, expected a place of its own",
        ),
    ],
)
def test_a_start_that_does_not_fit_the_scene_is_a_fault(tmp_path, vehicles, fault):
    path = vehicles_file(tmp_path, *vehicles)
    with pytest.raises(InputError) as error:
        fleet.read_setup({"vehicles": str(path), "scene": str(ARENA)}, "vehicles")
    (found,) = error.value.problems
    assert found.startswith(f"{path}: {fault}") or found == fault


@pytest.mark.parametrize(
    "parameters, fault",
    [
        ({"localization": "slam"}, "slam, expected amcl, as the file of the vehicles says"),
        ({"scene": ""}, "amcl, expected map in the file, or a scene"),
    ],
)
def test_parameters_that_contradict_the_file_s_localization(tmp_path, parameters, fault):
    path = vehicles_file(tmp_path, {**REAL, "start": [1.5, 1.5, 0.0]})
    path.write_text(f"localization: amcl\n{path.read_text()}")
    given = {"vehicles": str(path), "scene": str(ARENA), "localization": "amcl"}
    assert fleet.read_setup(given, "vehicles")
    with pytest.raises(InputError) as error:
        fleet.read_setup({**given, **parameters}, "vehicles")
    assert error.value.problems == [f"vehicles: localization {fault}"]


def test_starts_in_the_scene_are_good(tmp_path):
    path = vehicles_file(tmp_path, {**REAL, "start": [1.5, 1.5, 0.0]}, {"kind": "simulated"})
    _, vehicles, scene = fleet.read_setup({"vehicles": str(path), "scene": str(ARENA)}, "vehicles")
    assert len(vehicles) == 2 and scene.contains(1.5, 1.5)
