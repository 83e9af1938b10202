"""The node of a vehicle: what ends its thread, what it logs, what it knows after it was killed."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace
from unittest import mock

import pytest

rospy = pytest.importorskip("rospy")

from ros.fake_ros import FakePublisher, FakeRos, FakeService, deliver  # noqa: E402
from std_srvs.srv import TriggerRequest  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402
from vehicles.virtual_flight import Flight  # noqa: E402

from quad_nav.geometry import Pose2D, Pose3D  # noqa: E402
from quad_nav.ros.common.conversions import transform_message  # noqa: E402
from quad_nav.topics.vehicle_states import State  # noqa: E402
from quad_vehicles.link import VehicleLink  # noqa: E402
from quad_vehicles.ros import node, topics  # noqa: E402
from quad_vehicles.ros.scene_topics import PoseListener  # noqa: E402
from quad_vehicles.vehicle_file import Vehicle  # noqa: E402

VEHICLE = Vehicle(0, "mavlink", map_from_start=Pose2D(1.5, 1.5, 0.0))


@pytest.fixture
def ros():
    with FakeRos("/vehicle0") as fake:
        yield fake


@pytest.fixture
def flight():
    return Flight()


class Bridge(VehicleLink):
    """The connection of a node to a virtual flight."""

    def __init__(self, flight, vehicle):
        super().__init__(vehicle, flight.adapter, lambda: flight.now_s)
        self.works = []  # of the next calls of `read`

    def read(self, timeout_s):
        self.works.pop(0)()

    def _send(self, messages):
        """The flight sends."""

    def close(self):
        """Nothing is open."""


def node_of(flight, vehicle=VEHICLE, **options):
    with mock.patch.object(node, "MissionPause"):  # there is no sequencer
        return node.VehicleNode(vehicle, Bridge(flight, vehicle), **options)


def frame(vehicle_topics, flight):
    pose = flight.adapter.estimate.odom_from_base
    found = vehicle_topics.map_from_odom(pose, flight.machine)
    return found and (found.x_m, found.y_m, found.z_m, found.yaw_rad)


def end_threads():
    """Wait until the parameter is set."""
    for thread in threading.enumerate():
        if thread.daemon and thread.name != "diagnostics":
            thread.join(1.0)


def test_nothing_that_comes_ends_the_thread_that_reads(ros, flight):
    ros.set_time(1.7e9)
    flight.to_flight()
    one = node_of(flight)

    def fail():
        raise ValueError("math domain error")

    one._bridge.works = [fail, lambda: None]
    with mock.patch.object(rospy, "is_shutdown", lambda: not one._bridge.works):
        one._read()
    assert "quad0: link: ValueError: math domain error; going on" in ros.log.lines
    assert FakePublisher.all["/odom0"].last is not None


def test_a_flood_of_texts_is_a_few_lines(ros, flight):
    one = node_of(flight)
    for k in range(40):  # a second
        for j in range(200):
            flight.adapter.take_text(f"word{'abcdefghij'[j % 10]}{'klmno'[k % 5]} {j}")
        one._tick()
    assert 0 < sum("autopilot: word" in line for line in ros.log.lines) <= 20


def test_a_bridge_that_is_restarted_in_flight_knows_where_its_vehicle_took_off(ros, flight):
    before = topics.VehicleTopics(VEHICLE, respawned=False)
    flight.to_flight()
    before.starts.update(flight.machine)
    known = frame(before, flight)
    start, ground_m = flight.machine.odom_from_start, flight.machine.ground_m
    end_threads()
    place = [start.x_m, start.y_m, start.yaw_rad, ground_m]
    assert rospy.get_param("~take_offs") == place + place
    flight.run(4.0)  # away from there
    flight.start_bridge()
    after = topics.VehicleTopics(VEHICLE, respawned=True)
    after.starts.update(flight.machine)
    assert flight.run(2.0, lambda: flight.state is State.TAKEN_OVER)
    flight.run(1.0)
    assert frame(after, flight) == pytest.approx(known)
    assert (flight.machine.odom_from_start, flight.machine.ground_m) == (start, ground_m)
    assert not after.is_lost(flight.machine)


def test_the_frame_is_that_of_the_first_take_off_also_after_a_restart(ros, flight):
    flight.to_hover()
    first = topics.VehicleTopics(VEHICLE, respawned=False)
    first.starts.update(flight.machine)
    known, begin = frame(first, flight), flight.machine.odom_from_start
    flight.machine.odom_from_start = Pose2D(begin.x_m + 3.0, begin.y_m, 1.0)  # another take-off
    flight.machine.ground_m = 0.25
    first.starts.update(flight.machine)
    end_threads()
    flight.start_bridge()
    after = topics.VehicleTopics(VEHICLE, respawned=True)
    after.starts.update(flight.machine)
    assert flight.run(2.0, lambda: flight.state is State.TAKEN_OVER)
    flight.run(1.0)
    assert frame(after, flight) == frame(first, flight) == pytest.approx(known)
    assert flight.machine.ground_m == 0.25


def test_without_a_known_take_off_there_is_no_frame_in_flight_and_no_way_to_resume(ros, flight):
    flight.to_flight()
    flight.start_bridge()
    one = node_of(flight)
    assert flight.run(2.0, lambda: flight.state is State.TAKEN_OVER)
    flight.run(1.0)
    assert frame(one._topics, flight) is None
    response = FakeService.all["/vehicle0/resume"].handler(TriggerRequest())
    assert not response.success and "its place in map is not known" in response.message
    assert flight.state is State.TAKEN_OVER


LOCALIZED = replace(VEHICLE, localization="amcl")


def test_the_bridge_leaves_the_frame_to_amcl_and_hears_it(ros):
    ros.set_time(1.7e9)
    flight = Flight(localization="amcl")
    one = node_of(flight, vehicle=LOCALIZED)
    flight.run(5.0)
    inputs = flight.machine.inputs
    assert flight.state is State.NOT_READY and inputs.lost_s(time.monotonic()) == math.inf
    for child, x_m in (("odom1", 1.0), ("base_link0", 2.0), ("odom0", 3.0), ("odom0", math.nan)):
        pose = Pose3D(x_m, 0.0, 0.0)
        deliver("/tf", TFMessage([transform_message(pose, "map", child, rospy.Time())]))
    assert (inputs.map_from_odom.x_m, inputs.lost_s(time.monotonic()) < 60.0) == (3.0, True)
    assert "quad0: transform of odom0 dropped" in ros.log.lines[-1]
    one._topics.publish_estimate(flight.adapter.estimate, flight.machine)
    frames = {one.child_frame_id for one in FakePublisher.all["/tf"].last.transforms}
    assert frames == {"base_link0", "Lidar0"}


def test_a_frame_that_never_changes_holds_for_good(ros):
    flight = Flight(localization="none")
    node_of(flight, vehicle=replace(VEHICLE, localization="none"))
    fixed = transform_message(Pose3D(1.0, 0.0, 0.0), "map", "odom0", rospy.Time())
    deliver("/tf_static", TFMessage([fixed]))
    assert flight.machine.inputs.lost_s(time.monotonic() + 1e6) == 0.0


def test_amcl_gets_heights_above_the_ground(ros):
    """The autopilot was switched on 2 m higher: its height of the ground is -2.035 m."""
    ros.set_time(1.7e9)
    flight = Flight(localization="amcl")
    flight.vehicle.estimator.jump_m, flight.map_from_odom = (0.0, 0.0, -2.0), Pose2D(0.0, 0.0)
    one = node_of(flight, vehicle=LOCALIZED)
    heights_m = []
    for step in (flight.to_ready, flight.to_hover):
        step()
        one._topics.publish_estimate(flight.adapter.estimate, flight.machine)
        heights_m.append(FakePublisher.all["/odom0"].last.pose.pose.position.z)
    assert flight.adapter.estimate.odom_from_base.z_m == pytest.approx(-0.8, abs=0.1)
    assert heights_m == pytest.approx([0.0, 1.2], abs=0.1)


def test_simulated_lidars_do_not_see_what_amcl_says(ros):
    """The scans would follow from the answer. The robot starts at (1.5, 1.5), then goes 1 m."""
    poses = PoseListener(2, {0: Pose2D(1.5, 1.5, math.pi / 2)})
    for frame, child, x_m in (
        ("map", "odom0", 8.0),
        ("odom0", "base_link0", 5.0),
        ("map", "odom0", 9.0),
        ("odom0", "base_link0", 6.0),
        ("map", "odom1", 2.0),
        ("odom1", "base_link1", 1.0),
    ):
        pose = Pose3D(x_m, 0.0, 0.0)
        deliver("/tf", TFMessage([transform_message(pose, frame, child, rospy.Time())]))
    found = [poses.pose(robot)[0].translation.tolist() for robot in range(2)]
    assert found == [pytest.approx([1.5, 2.5, 0.0]), pytest.approx([3.0, 0.0, 0.0])]


@pytest.mark.parametrize("kept", [None, 5, "x", [1.0] * 7, [1.0] * 7 + [float("nan")], [[]] * 8])
def test_a_parameter_that_is_no_take_off_is_ignored(ros, kept):
    rospy.set_param("~take_offs", kept)
    memory = topics.StartMemory(respawned=True)
    assert memory.first is memory.last is None


def test_a_bridge_that_was_not_killed_knows_no_take_off(ros):
    rospy.set_param("~take_offs", [1.0] * 8)
    assert topics.StartMemory(respawned=True).first == (Pose2D(1.0, 1.0, 1.0), 1.0)
    assert topics.StartMemory(respawned=False).first is None
