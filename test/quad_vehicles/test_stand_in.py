"""The stand-ins behave as the recorded ArduCopter, and as PX4's documentation says.

`make replay-vehicles` compares ArduCopter's with whole recordings; its numbers here are theirs.
"""

from __future__ import annotations

import math
import struct

import pytest
from vehicles.ardupilot import GUIDED, LOITER, ArduPilot
from vehicles.ardupilot import LAND as ARDUPILOT_LAND
from vehicles.bodies import Bodies
from vehicles.estimator import LocalFrame
from vehicles.point_bodies import PointBodies
from vehicles.px4 import HOLD, INT32, LAND, OFFBOARD, REJECTED, Px4
from vehicles.stand_in import ACCEPTED, IN_AIR, ON_GROUND, TAKING_OFF
from vehicles.virtual_flight import Flight

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.sim.obstacles import Box
from quad_nav.sim.scene import Scene, Walls
from quad_nav.topics.vehicle_states import State

HEADING_RAD = 0.5
WALL = Box("wall", 4.0, 2.0, 0.2, 4.0, 2.0)
ROOM = Scene("room", 8.0, 4.0, 1.0, Walls(), (WALL,), (Pose2D(1.0, 2.0, 0.0),))


class Desk:
    """A stand-in, and the messages that have come from it."""

    def __init__(self, make, bodies=None, **parameters):
        self.bodies = bodies or PointBodies()
        frame = LocalFrame(5.0, -3.0, HEADING_RAD)
        self.vehicle = make(self.bodies, 0, frame, 1, 60.0, parameters)
        self.got = []  # (name, fields)

    def run(self, seconds):
        self.got += self.vehicle.advance(seconds)
        return self

    def command(self, number, **parameters):
        """Send a command; return its result and the texts that came with it."""
        self.got.clear()
        self.vehicle.receive("COMMAND_LONG", {"command": number, **parameters})
        self.run(0.05)
        (result,) = [fields["result"] for name, fields in self.got if name == "COMMAND_ACK"]
        return result, self.texts()

    def stream(self, seconds, frame=8, mask=1479, hz=20.0, **fields):
        """Send set-points."""
        fields = {"coordinate_frame": frame, "type_mask": mask, **fields}
        for _ in range(round(seconds * hz)):
            self.vehicle.receive("SET_POSITION_TARGET_LOCAL_NED", fields)
            self.run(1.0 / hz)
        return self

    def lift(self, height_m):
        """Let ArduPilot take off; return at once."""
        assert self.command(176, param1=1, param2=GUIDED)[0] == ACCEPTED
        assert self.command(400, param1=1) == (ACCEPTED, ["Arming motors"])
        self.run(0.2)
        assert self.command(22, param7=height_m)[0] == ACCEPTED
        return self

    def texts(self):
        return [fields["text"].rstrip() for name, fields in self.got if name == "STATUSTEXT"]

    def last(self, wanted):
        return [fields for name, fields in self.got if name == wanted][-1]


@pytest.fixture
def flying():
    return Desk(ArduPilot).lift(1.5).run(9.0)


def test_takes_off_as_recorded():
    desk, heights, landed = Desk(ArduPilot).lift(1.5), {}, {}
    start_s = desk.vehicle.now_s - 0.05
    while desk.vehicle.now_s < start_s + 8.0:
        desk.run(0.01)
        k = round((desk.vehicle.now_s - start_s) / 0.05)
        heights[k] = -desk.vehicle.estimator.position_ned[2]
        landed[k] = desk.vehicle.landed
    # Recorded after the acknowledgement: 0.15 m at 3.72 s, 0.75 m at 4.28 s, 1.42 m at 5.21 s.
    assert [heights[k] for k in (74, 86, 104)] == pytest.approx([0.15, 0.75, 1.42], abs=0.08)
    assert max(heights.values()) == pytest.approx(1.534, abs=0.01)
    assert landed[56] == ON_GROUND and landed[72] == TAKING_OFF and landed[116] == IN_AIR


def test_one_set_point_cancels_the_take_off_without_a_word():
    desk = Desk(ArduPilot).lift(1.5).run(0.9)
    desk.got.clear()
    desk.stream(0.05).run(7.0)
    assert desk.vehicle.height_m < 0.01 and desk.vehicle.armed and desk.texts() == []


@pytest.mark.parametrize(
    "frame, mask, north_east_mps",
    [
        (8, 1479, (0.5 * math.cos(HEADING_RAD), 0.5 * math.sin(HEADING_RAD))),
        (1, 1479, (0.5, 0.0)),
        (12, 1479, (0.0, 0.0)),
        (8, 1511, (0.0, 0.0)),
    ],
)
def test_which_set_points_it_takes(flying, frame, mask, north_east_mps):
    flying.stream(3.0, frame, mask, vx=0.5)
    assert flying.vehicle.velocity[:2] == pytest.approx(north_east_mps, abs=0.02)


def test_flies_blind_until_the_time_out(flying):
    flying.stream(4.0, vx=0.5)
    speeds = [flying.run(0.1).vehicle.speed_mps for _ in range(46)]
    assert speeds[30] > 0.45  # 3 s later; below 90 % after 3.26 s, below 10 % after 4.39 s
    assert speeds[34] < 0.40 and speeds[45] < 0.05


@pytest.mark.parametrize("stick_us, is_up", [(1500, True), (1000, False)])
def test_kicked_out_it_follows_the_stick(flying, stick_us, is_up):
    flying.vehicle.sticks[2] = stick_us
    flying.vehicle.set_mode(LOITER)
    flying.stream(4.0, vx=0.5)  # ignored
    assert flying.vehicle.speed_mps < 0.03
    assert flying.vehicle.height_m == pytest.approx(1.49 if is_up else 0.0, abs=0.03)


def test_after_the_bridge_has_died_it_comes_down_as_recorded():
    desk = Desk(ArduPilot, FS_GCS_ENABLE=5.0).lift(1.0).run(9.0)
    desk.vehicle.receive("HEARTBEAT", {"type": 6})
    desk.run(0.5)  # then the bridge dies, in the middle between two heartbeats
    desk.vehicle.receive("HEARTBEAT", {"type": 6}, sender=(254, 190))  # another station's
    assert desk.run(4.7).vehicle.mode == GUIDED
    assert desk.run(0.2).vehicle.mode == ARDUPILOT_LAND
    assert desk.run(4.4).vehicle.height_m > 0.9
    assert desk.run(2.0).vehicle.height_m < 0.05  # at 11.3 s
    assert not desk.run(3.5).vehicle.armed  # at 14.0 s


def test_a_low_voltage_is_no_low_charge_and_latches(flying):
    flying.vehicle.battery, flying.vehicle.voltage_v = 100, 9.0
    flying.command(511, param1=1, param2=1e6)
    for seconds, is_healthy in ((9.5, True), (1.6, False)):
        told = flying.run(seconds).last("SYS_STATUS")
        assert (told["battery_remaining"], told["voltage_battery"]) == (100, 9000)
        assert bool(told["onboard_control_sensors_health"] & 1 << 25) == is_healthy
    assert flying.texts()[-2:] == ["Battery 1 is low 9.00V used 0 mAh", "Battery Failsafe"]
    assert flying.vehicle.mode == GUIDED  # BATT_FS_LOW_ACT 0: the flight goes on


def test_without_gps_it_drifts_unseen_until_it_lands(flying):
    """Recorded: 0.63 m from its place after 8 s."""
    estimator = flying.vehicle.estimator
    true, told = flying.bodies.place(0), estimator.position_ned
    flying.vehicle.lose_receiver()
    flying.command(511, param1=24, param2=2e5)
    message = flying.stream(7.95).last("GPS_RAW_INT")
    assert (message["fix_type"], message["satellites_visible"]) == (1, 3)
    now = flying.bodies.place(0)
    north, east = estimator.ned(now[0] - true[0], now[1] - true[1])
    moved = [after - before for after, before in zip(estimator.position_ned, told)]
    assert math.hypot(north - moved[0], east - moved[1]) == pytest.approx(0.63, abs=0.03)
    assert math.hypot(north, east) > 0.5 and math.hypot(*moved) < 0.1
    assert flying.vehicle.mode == GUIDED
    assert flying.run(0.3).vehicle.mode == ARDUPILOT_LAND


def test_touches_the_walls_of_its_scene():
    desk = Desk(ArduPilot, Bodies(ROOM)).lift(1.5).run(9.0).stream(7.0, vx=0.5)
    assert [contact.other for contact in desk.bodies.contacts] == ["wall"]
    assert desk.bodies.pose(0).x_m < 4.0
    desk.bodies.close()


# PX4.


@pytest.fixture
def px4():
    return Desk(Px4, COM_OBL_RC_ACT=4.0)


def to_hover(desk):
    desk.stream(1.2)
    assert desk.command(176, param1=1, param2=6)[0] == ACCEPTED
    assert desk.command(400, param1=1)[0] == ACCEPTED
    desk.stream(6.0, vz=-0.5).stream(2.0)
    assert desk.vehicle.landed == IN_AIR and 1.5 < desk.vehicle.height_m < 3.0
    return desk


@pytest.mark.parametrize("seconds, hz", [(0.5, 20.0), (5.0, 1.5)])
def test_arms_in_offboard_only_with_a_stream(px4, seconds, hz):
    assert px4.command(176, param1=1, param2=6) == (ACCEPTED, [])  # on the ground any mode is
    result, texts = px4.stream(seconds, hz=hz).command(400, param1=1)
    assert result == REJECTED
    assert texts[-1] == "Arming denied: Resolve system health failures first"
    assert px4.stream(1.1).command(400, param1=1)[0] == ACCEPTED


def test_holds_and_then_lands_when_the_stream_stops(px4):
    to_hover(px4).stream(3.0, vx=0.5)
    assert px4.run(0.9).vehicle.mode == OFFBOARD
    assert px4.run(0.2).vehicle.mode == HOLD  # COM_OF_LOSS_T 1 s
    refused = "Switching to Offboard is currently not available"
    assert px4.command(176, param1=1, param2=6) == (REJECTED, [refused])
    assert px4.run(4.7).vehicle.mode == HOLD
    assert px4.run(0.4).vehicle.mode == LAND  # COM_FAIL_ACT_T 5 s later
    px4.run(8.0)
    assert px4.vehicle.landed == ON_GROUND and not px4.vehicle.armed


def test_whole_numbers_travel_as_their_bits(px4):
    px4.vehicle.receive("PARAM_REQUEST_READ", {"param_id": "COM_OBL_RC_ACT"})
    fields = px4.run(0.05).last("PARAM_VALUE")
    assert fields["param_type"] == INT32
    assert struct.unpack("<i", struct.pack("<f", fields["param_value"])) == (4,)


# With the bridge.


@pytest.mark.parametrize("delay_s, loss_share", [(0.3, 0.0), (0.0, 0.2), (0.1, 0.15)])
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_the_bridge_flies_over_a_bad_link(autopilot, delay_s, loss_share):
    flight = Flight(autopilot, seed=5)
    flight.vehicle.delay_up_s = flight.vehicle.delay_down_s = delay_s
    flight.vehicle.loss_share = loss_share
    flight.to_flight().run(10.0)
    assert flight.state is State.FLYING and flight.speed_mps > 0.45
    flight.machine.land(flight.now_s, "asked")
    flight.until_state(State.LANDED, 15.0)


def test_the_bridge_waits_for_the_position():
    flight = Flight()
    flight.vehicle.boot_s = 30.0
    flight.run(5.0)
    assert flight.state is State.NOT_READY and "no position estimate" in flight.machine.reason
    flight.until_state(State.READY, 15.0)
    assert flight.vehicle.boot_s == pytest.approx(42.4, abs=0.6)


def test_a_stand_in_without_a_receiver_drifts_as_the_recorded_velocity():
    """0.0255 m/s in the body's frame, so that it is off in its own estimate and in place."""
    flight = Flight().to_hover()
    flight.command = Twist2D()
    flight.vehicle.estimator.drifts = True
    flight.run(15.0)  # of which the first seconds build it up
    before, told = flight.bodies.pose(0), flight.adapter.estimate.odom_from_base
    flight.run(20.0)
    after, later = flight.bodies.pose(0), flight.adapter.estimate.odom_from_base
    assert told.to_2d().distance_to(later.to_2d()) < 0.06, "it hovers by its estimate"
    assert before.to_2d().distance_to(after.to_2d()) == pytest.approx(20.0 * 0.0255, abs=0.06)
