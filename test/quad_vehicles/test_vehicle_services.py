"""`/vehicle0/resume`: the node of a vehicle, with a stand-in on a virtual clock."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from unittest import mock

import pytest

rospy = pytest.importorskip("rospy")

from ros.fake_ros import FakeRos, FakeService  # noqa: E402
from std_srvs.srv import TriggerRequest  # noqa: E402
from vehicles.virtual_flight import Flight  # noqa: E402

from quad_nav.topics.vehicle_states import State  # noqa: E402
from quad_vehicles.orders import Output  # noqa: E402
from quad_vehicles.ros import maneuvers, node  # noqa: E402
from quad_vehicles.vehicle_file import Vehicle  # noqa: E402


class Bridge:
    """The connection of the node, to a vehicle on a virtual clock; a tick takes 10 ms."""

    scan = estimate = None

    def __init__(self):
        self.flight, self.lock = Flight(), threading.Lock()
        self.machine = self.flight.machine

    def tick(self):
        self.flight._step()
        return Output()

    def pop_texts(self):
        return []


@pytest.fixture
def bridge(monkeypatch):
    with FakeRos("/vehicle0") as ros:
        made = Bridge()
        clock = SimpleNamespace(monotonic=lambda: made.flight.now_s)
        clock.sleep = lambda _: made.node._tick()
        for module in (node, maneuvers):
            monkeypatch.setattr(module, "time", clock)
        monkeypatch.setattr(node, "MissionPause", mock.Mock())
        monkeypatch.setattr(node, "publish_health", mock.Mock())
        made.node = node.VehicleNode(Vehicle(0, "mavlink"), made)
        made.ros, made.pause = ros, made.node._pause
        yield made


def resume():
    response = FakeService.all["/vehicle0/resume"].handler(TriggerRequest())
    return response.success, response.message


def taken_over(bridge):
    """A pilot has changed the mode in the air."""
    flight = bridge.flight.to_flight()
    flight.vehicle.set_mode(flight.vehicle.kind["other"])
    assert flight.run(0.2, lambda: flight.state is State.TAKEN_OVER)
    return flight


def test_a_resumption_in_the_air_resumes_the_mission(bridge):
    flight = taken_over(bridge)
    assert resume() == (True, "holding")
    assert flight.state in (State.HOLDING, State.FLYING)
    bridge.pause.resume.assert_called_once_with()


@pytest.mark.parametrize("is_taken_over", [False, True])
def test_a_resumption_on_the_ground_fails_and_resumes_no_mission(bridge, is_taken_over):
    flight = bridge.flight
    if is_taken_over:
        taken_over(bridge)
        flight.vehicle.set_mode(flight.vehicle.kind["land"])
        flight.run(15.0, lambda: not flight.vehicle.armed)
        flight.vehicle.set_mode(flight.vehicle.kind["control"])
        flight.run(1.0)
        assert flight.state is State.TAKEN_OVER
    else:
        assert flight.run(10.0, lambda: flight.state is State.READY)
    is_resumed, text = resume()
    assert not is_resumed and text.endswith("take off first, then resume")
    flight.run(5.0)
    assert not flight.vehicle.armed
    bridge.pause.resume.assert_not_called()


def test_a_resumption_without_effect_fails_with_the_reason(bridge):
    flight = taken_over(bridge)
    flight.is_heard, start_s = False, flight.now_s
    assert resume() == (False, "taken over: no effect of the order to take control")
    assert flight.now_s - start_s < 6.0
    bridge.pause.resume.assert_not_called()
