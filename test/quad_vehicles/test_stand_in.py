"""The stand-in for ArduCopter behaves as recorded; numbers are those of the recordings."""

from __future__ import annotations

import math

import pytest
from vehicles import failures
from vehicles.ardupilot import GUIDED, LAND, LOITER, RTL, ArduPilot
from vehicles.bodies import Bodies
from vehicles.estimator import LocalFrame
from vehicles.stand_in import ACCEPTED, DENIED, FAILED, IN_AIR, ON_GROUND, TAKING_OFF
from vehicles.virtual_flight import StandInFlight

from quad_nav.geometry import Pose2D
from quad_nav.sim.obstacles import Box
from quad_nav.sim.scene import Scene, Walls
from quad_nav.topics.vehicle_states import State

HEADING_RAD = 0.5
WALL = Box("wall", 4.0, 2.0, 0.2, 4.0, 2.0)
ROOM = Scene("room", 8.0, 4.0, 1.0, Walls(), (WALL,), (Pose2D(1.0, 2.0, 0.0),))


class Desk:
    """A stand-in, and the messages that have come from it."""

    def __init__(self, scene=None, boot_s=60.0, **parameters):
        self.bodies = Bodies(scene) if scene else Bodies()
        frame = LocalFrame(5.0, -3.0, HEADING_RAD)
        self.vehicle = ArduPilot(self.bodies, 0, frame, 1, boot_s, parameters)
        self.got = []  # (time, name, fields)

    def run(self, seconds):
        end_s = self.vehicle.now_s + seconds - 1e-9
        while self.vehicle.now_s < end_s:
            found = self.vehicle.advance(0.004)
            self.got += [(self.vehicle.now_s, name, fields) for name, fields in found]
        return self

    def command(self, number, **parameters):
        """Send a command; return its result and the texts that came with it."""
        before = len(self.got)
        self.vehicle.receive("COMMAND_LONG", {"command": number, **parameters})
        self.run(0.05)
        found = self.got[before:]
        (result,) = [f["result"] for _, name, f in found if name == "COMMAND_ACK"]
        return result, [f["text"] for _, name, f in found if name == "STATUSTEXT"]

    def stream(self, seconds, frame=8, mask=1479, **fields):
        """Send set-points at 20 Hz."""
        values = dict.fromkeys(("x", "y", "z", "vx", "vy", "vz", "yaw", "yaw_rate"), 0.0)
        fields = {**values, "coordinate_frame": frame, "type_mask": mask, **fields}
        for _ in range(round(seconds / 0.05)):
            self.vehicle.receive("SET_POSITION_TARGET_LOCAL_NED", fields)
            self.run(0.05)
        return self

    def to_hover(self):
        assert self.command(176, param1=1, param2=GUIDED)[0] == ACCEPTED
        assert self.command(400, param1=1) == (ACCEPTED, ["Arming motors"])
        assert self.command(22, param7=1.5)[0] == ACCEPTED
        return self.run(9.0)

    def texts(self):
        return [fields["text"] for _, name, fields in self.got if name == "STATUSTEXT"]


@pytest.fixture
def desk():
    desk = Desk()
    yield desk
    desk.bodies.close()


@pytest.fixture
def flying(desk):
    return desk.to_hover()


def test_takes_off_as_recorded(desk):
    desk.command(176, param1=1, param2=GUIDED)
    desk.command(400, param1=1)
    desk.run(0.2)
    start_s = desk.vehicle.now_s
    desk.command(22, param7=1.5)
    heights, landed = {}, {}
    while desk.vehicle.now_s < start_s + 8.0:
        desk.run(0.01)
        k = round((desk.vehicle.now_s - start_s) / 0.05)
        heights[k] = -desk.vehicle.estimator.position_ned[2]
        landed[k] = desk.vehicle.landed
    # Recorded after the acknowledgement: 0.15 m at 3.72 s, 0.75 m at 4.28 s, 1.42 m at 5.21 s.
    assert [heights[k] for k in (74, 86, 104)] == pytest.approx([0.15, 0.75, 1.42], abs=0.08)
    assert max(heights.values()) == pytest.approx(1.534, abs=0.01)
    assert heights[159] == pytest.approx(1.457, abs=0.01)
    assert landed[56] == ON_GROUND and landed[72] == TAKING_OFF and landed[116] == IN_AIR


def test_one_set_point_cancels_the_take_off_without_a_word(desk):
    desk.command(176, param1=1, param2=GUIDED)
    desk.command(400, param1=1)
    desk.command(22, param7=1.5)
    desk.run(0.9)
    desk.got.clear()
    desk.stream(0.05).run(7.0)
    assert desk.vehicle.height_m < 0.01 and desk.vehicle.armed
    assert desk.texts() == []
    desk.command(22, param7=1.5)
    desk.run(6.0)
    assert desk.vehicle.height_m > 1.4


@pytest.mark.parametrize(
    "boot_s, reasons",
    [
        (9.0, ["Arm: Accels inconsistent", "Arm: AHRS: waiting for home"]),
        (17.0, ["Arm: Gyros inconsistent", "Arm: AHRS: waiting for home"]),
        (23.0, ["Arm: Gyros inconsistent", "Arm: Need Position Estimate"]),
        (35.0, ["Arm: Need Position Estimate"]),
    ],
)
def test_refuses_to_arm_while_it_boots(boot_s, reasons):
    desk = Desk(boot_s=boot_s)
    assert desk.command(400, param1=1) == (FAILED, reasons)
    desk.bodies.close()


def test_refusals(flying):
    assert flying.command(22, param7=1.5) == (FAILED, [])
    assert flying.command(400, param1=0) == (FAILED, [])
    assert flying.command(511, param1=9999, param2=1e5) == (
        DENIED,
        ["No ap_message for mavlink id (9999)"],
    )
    assert flying.command(176, param1=1, param2=LAND)[0] == ACCEPTED
    flying.run(8.0)
    assert not flying.vehicle.armed
    assert flying.command(400, param1=1) == (FAILED, ["Arm: LAND mode not armable"])


@pytest.mark.parametrize(
    "frame, mask, north_east_mps",
    [
        (8, 1479, (0.5 * math.cos(HEADING_RAD), 0.5 * math.sin(HEADING_RAD))),
        (9, 1479, (0.5 * math.cos(HEADING_RAD), 0.5 * math.sin(HEADING_RAD))),
        (1, 1479, (0.5, 0.0)),
        (12, 1479, (0.0, 0.0)),
        (8, 1511, (0.0, 0.0)),
        (8, 4095, (0.0, 0.0)),
    ],
)
def test_which_set_points_it_takes(flying, frame, mask, north_east_mps):
    before = len(flying.texts())
    flying.stream(3.0, frame, mask, vx=0.5)
    assert flying.vehicle.velocity[:2] == pytest.approx(north_east_mps, abs=0.02)
    assert len(flying.texts()) == before


def test_flies_blind_until_the_time_out(flying):
    flying.stream(4.0, vx=0.5)
    speeds = []
    for _ in range(46):
        flying.run(0.1)
        speeds.append(flying.vehicle.speed_mps)
    assert speeds[30] > 0.45  # 3 s later; below 90 % after 3.26 s, below 10 % after 4.39 s
    assert speeds[34] < 0.40 and speeds[45] < 0.05


def test_a_nan_makes_it_swing_and_a_zero_stops_it(flying):
    flying.stream(3.0, vx=0.5)
    flying.stream(3.0, vx=math.nan)
    speeds = []
    for _ in range(12):
        flying.stream(0.1, vx=math.nan)
        speeds.append(flying.vehicle.speed_mps)
    assert max(speeds) == pytest.approx(0.2, abs=0.04)
    assert flying.stream(3.0).vehicle.speed_mps < 0.02


def test_a_nan_as_yaw_rate_is_taken_and_a_nan_as_yaw_ends_the_program(flying):
    flying.stream(3.0, vx=0.5, yaw_rate=math.nan)
    assert flying.vehicle.speed_mps == pytest.approx(0.5, abs=0.02)
    assert flying.texts()[-1] == "Internal Errors 0x400"
    assert flying.vehicle.system_status == 5
    flying.stream(0.1, 1, 2503, yaw=math.nan)
    flying.got.clear()
    assert flying.run(3.0).got == []


def test_kicked_out_with_the_stick_down_it_falls(flying):
    flying.vehicle.sticks[2] = 1000
    flying.got.clear()
    flying.vehicle.set_mode(LOITER)
    flying.run(1.6)
    at_s, _, told = next(row for row in flying.got if row[1] == "HEARTBEAT")
    assert told["custom_mode"] == LOITER
    assert flying.vehicle.height_m < 0.01
    assert any(text.startswith("SIM Hit ground at 2.") for text in flying.texts())


def test_kicked_out_with_the_stick_in_the_middle_it_stays(flying):
    flying.stream(3.0, vx=0.5)
    flying.vehicle.set_mode(LOITER)
    flying.stream(4.0, vx=0.5)  # ignored
    assert flying.vehicle.speed_mps < 0.03
    assert flying.vehicle.height_m == pytest.approx(1.49, abs=0.03)


def test_without_a_radio_it_climbs(flying):
    flying.vehicle.receive("PARAM_SET", {"param_id": "SIM_RC_FAIL", "param_value": 1.0})
    flying.run(0.9)
    assert flying.vehicle.mode == GUIDED
    flying.run(3.1)
    assert flying.vehicle.mode == RTL and flying.texts()[-3] == "Radio Failsafe"
    assert flying.vehicle.height_m == pytest.approx(3.7, abs=0.2)
    heights = [flying.run(0.5).vehicle.height_m for _ in range(30)]
    assert max(heights) == pytest.approx(15.0, abs=0.5)


def moments(desk, seconds):
    """Run; return the times since now of texts, modes and states of landing, each once."""
    vehicle, start_s, found = desk.vehicle, desk.vehicle.now_s, {}
    desk.got.clear()
    while vehicle.now_s < start_s + seconds:
        before = len(desk.got)
        desk.run(0.01)
        now_s = vehicle.now_s - start_s
        found.setdefault(("landed", vehicle.landed), now_s)
        found.setdefault(("mode", vehicle.mode), now_s)
        for _, name, fields in desk.got[before:]:
            if name == "STATUSTEXT":
                found.setdefault(fields["text"].split(" at ")[0], now_s)
            elif name == "HEARTBEAT":
                found.setdefault(("armed", fields["base_mode"] >= 128), now_s)
    return found


def test_a_flight_at_one_metre_takes_as_long_as_recorded(desk):
    desk.command(176, param1=1, param2=GUIDED)
    desk.command(400, param1=1)
    desk.run(0.2)
    desk.vehicle.receive("COMMAND_LONG", {"command": 22, "param7": 1.0})
    rises = moments(desk, 4.95)
    assert rises["landed", TAKING_OFF] == pytest.approx(2.9, abs=0.15)
    assert -desk.vehicle.estimator.position_ned[2] == pytest.approx(0.97, abs=0.03)
    desk.run(4.0)
    desk.vehicle.receive("COMMAND_LONG", {"command": 176, "param2": LAND})
    lands = moments(desk, 6.0)
    assert lands["SIM Hit ground"] == pytest.approx(2.3, abs=0.15)
    (hit,) = [words for words in desk.texts() if words.startswith("SIM Hit ground at ")]
    assert float(hit.split()[4]) == pytest.approx(0.49, abs=0.005)
    # A heartbeat tells it, up to 1 s after the motors have stopped.
    assert lands["Disarming motors"] < 5.2 < lands["Disarming motors"] + 1.0
    assert lands["armed", False] < lands["Disarming motors"] + 1.0


def test_after_the_bridge_has_died_it_comes_down_as_recorded(desk):
    desk.vehicle.parameters["FS_GCS_ENABLE"] = 5.0
    desk.command(176, param1=1, param2=GUIDED)
    desk.command(400, param1=1)
    desk.command(22, param7=1.0)
    desk.run(9.0)
    desk.vehicle.receive("HEARTBEAT", {"type": 6})
    desk.run(0.5)  # then the bridge dies, in the middle between two heartbeats
    height_m = desk.vehicle.height_m
    comes = moments(desk, 9.3)  # 4.8 s, and 4.5 s
    assert comes["mode", LAND] == pytest.approx(4.8, abs=0.1)
    assert height_m - desk.vehicle.height_m == pytest.approx(0.05, abs=0.04)
    comes = moments(desk, 6.0)
    assert 9.3 + comes["SIM Hit ground"] == pytest.approx(11.3, abs=0.2)
    assert 9.3 + comes["armed", False] == pytest.approx(14.0, abs=0.7)


def test_a_low_voltage_is_no_low_charge_and_latches_until_a_reboot(flying):
    flying.vehicle.battery, flying.vehicle.voltage_v = 100, 9.0
    flying.command(511, param1=1, param2=1e6)
    flying.run(9.5)
    health = [f for _, name, f in flying.got if name == "SYS_STATUS"][-1]
    assert (health["battery_remaining"], health["voltage_battery"]) == (100, 9000)
    assert health["onboard_control_sensors_health"] & 1 << 25
    flying.run(1.6)
    health = [f for _, name, f in flying.got if name == "SYS_STATUS"][-1]
    assert not health["onboard_control_sensors_health"] & 1 << 25
    assert flying.texts()[-2:] == ["Battery 1 is low 9.00V used 0 mAh", "Battery Failsafe"]
    assert flying.vehicle.mode == GUIDED  # BATT_FS_LOW_ACT 0: the flight goes on
    flying.vehicle.voltage_v = 12.6
    flying.command(176, param1=1, param2=LAND)
    flying.run(8.0)
    flying.command(176, param1=1, param2=GUIDED)
    assert flying.command(400, param1=1) == (FAILED, ["Arm: Battery failsafe"])
    flying.command(246, param1=1)
    assert not flying.vehicle.has_low_battery


def test_it_lands_by_itself_for_a_low_battery_if_it_was_told_to(desk):
    desk.vehicle.parameters["BATT_FS_LOW_ACT"] = 1.0
    desk.to_hover().vehicle.voltage_v = 9.0
    assert desk.run(9.9).vehicle.mode == GUIDED
    assert desk.run(0.3).vehicle.mode == LAND


def test_without_gps_it_drifts_unseen_until_it_lands(flying):
    """Recorded: 0.63 m from its place after 8 s."""
    estimator = flying.vehicle.estimator
    true, told = flying.bodies.place(0), estimator.position_ned
    flying.vehicle.lose_receiver()
    flying.command(511, param1=24, param2=2e5)
    flying.stream(7.95)
    message = [f for _, name, f in flying.got if name == "GPS_RAW_INT"][-1]
    assert (message["fix_type"], message["satellites_visible"]) == (1, 3)
    now = flying.bodies.place(0)
    north, east = estimator.ned(now[0] - true[0], now[1] - true[1])
    moved = [after - before for after, before in zip(estimator.position_ned, told)]
    assert math.hypot(north - moved[0], east - moved[1]) == pytest.approx(0.63, abs=0.03)
    assert math.hypot(north, east) > 0.5 and math.hypot(*moved) < 0.1
    assert flying.vehicle.mode == GUIDED
    assert flying.run(0.3).vehicle.mode == LAND


def test_after_a_glitch_the_estimate_jumps_to_the_receiver(flying):
    north_m = flying.vehicle.estimator.position_ned[0]
    flying.vehicle.glitch(north_m=3.0)
    flying.command(511, param1=193, param2=2e5)
    flying.run(9.9)
    report = [f for _, name, f in flying.got if name == "EKF_STATUS_REPORT"][-1]
    assert report["pos_horiz_variance"] > 1.0
    assert flying.vehicle.estimator.position_ned[0] == pytest.approx(north_m, abs=0.05)
    flying.run(0.3)
    assert flying.vehicle.estimator.position_ned[0] == pytest.approx(north_m + 3.0, abs=0.05)


def test_its_clock_steps(flying):
    flying.command(511, param1=30, param2=1e5)
    flying.run(1.0)
    before = flying.got[-1][2]["time_boot_ms"]
    flying.vehicle.clock_step_s = -2.5
    flying.run(0.2)
    assert flying.got[-1][2]["time_boot_ms"] == pytest.approx(before + 200 - 2500, abs=110)
    flying.vehicle.receive("TIMESYNC", {"tc1": 0, "ts1": 7})
    flying.run(0.05)
    (answer,) = [f for _, name, f in flying.got if name == "TIMESYNC" and f["ts1"] == 7]
    assert answer["tc1"] / 1e9 == pytest.approx(flying.vehicle.boot_s - 2.5, abs=0.06)


def test_the_pilots_transmitter_is_missed_after_a_second(flying):
    flying.vehicle.lose_radio()
    assert moments(flying, 1.5)["Radio Failsafe"] == pytest.approx(0.99, abs=0.03)


def test_without_our_heartbeats_it_lands_if_it_was_told_to(desk):
    desk.vehicle.parameters["FS_GCS_ENABLE"] = 5.0
    desk.to_hover()
    desk.vehicle.receive("HEARTBEAT", {"type": 6})
    desk.vehicle.receive("HEARTBEAT", {"type": 6}, sender=(254, 190))
    desk.run(5.0)
    assert desk.vehicle.mode == GUIDED
    desk.vehicle.receive("HEARTBEAT", {"type": 6}, sender=(254, 190))  # another station's
    desk.run(0.5)
    assert desk.vehicle.mode == LAND and desk.texts()[-1] == "GCS Failsafe"


def test_sends_nothing_periodic_unasked_and_forgets_early_requests():
    desk = Desk(boot_s=1.0)
    desk.command(511, param1=32, param2=20000.0)
    desk.run(0.5)
    desk.command(511, param1=30, param2=20000.0)
    desk.run(1.0)
    names = {name for _, name, _ in desk.got}
    assert names == {"COMMAND_ACK", "ATTITUDE", "STATUSTEXT", "HEARTBEAT"}
    desk.bodies.close()


def test_sends_at_the_rate_that_was_asked_for(flying):
    flying.command(511, param1=32, param2=20000.0)
    flying.got.clear()
    flying.run(10.0)
    times = [at_s for at_s, name, _ in flying.got if name == "LOCAL_POSITION_NED"]
    stamps = [f["time_boot_ms"] for _, name, f in flying.got if name == "LOCAL_POSITION_NED"]
    assert len(times) == pytest.approx(500, abs=1)
    gaps = [b - a for a, b in zip(stamps, stamps[1:])]
    assert 15 <= min(gaps) and max(gaps) <= 25


def test_the_local_frame_begins_elsewhere(flying):
    assert flying.vehicle.estimator.position_ned[:2] == pytest.approx((5.0, -3.0), abs=0.05)
    flying.stream(4.0, vy=0.5)  # to the right of a heading of 0.5 rad
    north, east, _ = flying.vehicle.estimator.position_ned
    assert math.atan2(east + 3.0, north - 5.0) == pytest.approx(HEADING_RAD + math.pi / 2, abs=0.05)
    _, _, yaw = flying.bodies.pose(0).to_2d().x_m, 0.0, flying.bodies.pose(0).yaw_rad
    assert yaw == pytest.approx(0.0, abs=0.02)


def test_an_error_of_the_barometer_puts_it_on_the_ground(flying):
    flying.vehicle.estimator.baro_error_m = 3.0
    flying.stream(4.0)
    assert flying.vehicle.height_m < 0.02


def test_losses_and_delays_of_the_link(flying):
    flying.vehicle.loses_down = True
    flying.got.clear()
    assert flying.run(2.0).got == []
    flying.vehicle.loses_down, flying.vehicle.delay_down_s = False, 0.5
    start_s = flying.vehicle.now_s
    flying.vehicle.set_mode(LOITER)
    flying.run(0.6)
    assert flying.got[0][0] == pytest.approx(start_s + 0.5, abs=0.02)
    flying.vehicle.delay_up_s = 1.0
    flying.vehicle.receive("COMMAND_LONG", {"command": 176, "param2": GUIDED})
    assert flying.run(0.9).vehicle.mode == LOITER
    assert flying.run(0.2).vehicle.mode == GUIDED


def test_a_reboot_forgets_the_rates(desk):
    desk.command(511, param1=30, param2=20000.0)
    desk.command(246, param1=1)
    desk.got.clear()
    desk.run(1.2)
    assert desk.got == []
    desk.run(3.0)
    assert "ATTITUDE" not in {name for _, name, _ in desk.got}
    assert "ArduPilot Ready" in desk.texts() and desk.vehicle.boot_s < 6.0


def test_touches_the_walls_of_its_scene():
    desk = Desk(ROOM).to_hover()
    assert desk.bodies.contacts == []
    desk.stream(7.0, vx=0.5)
    assert [contact.other for contact in desk.bodies.contacts] == ["wall"]
    assert desk.bodies.pose(0).x_m < 4.0
    desk.bodies.close()


def test_the_bridge_flies_it_to_a_hover_and_lands_it():
    flight = StandInFlight(seed=3).to_flight()
    assert flight.height_m == pytest.approx(1.2, abs=0.05)
    assert flight.speed_mps == pytest.approx(0.5, abs=0.03)
    flight.machine.land(flight.now_s, "asked")
    assert flight.run(15.0, lambda: flight.state is State.LANDED)
    assert not flight.vehicle.armed and flight.height_m < 0.02
    flight.end()


def test_a_ground_station_does_not_hide_that_the_bridge_has_died():
    """Its heartbeats have the number 255; the autopilot counts those of its bridge."""
    flight = StandInFlight(seed=3)
    flight.has_station = True
    flight.to_flight()
    flight.is_alive = False
    assert flight.run(6.0, lambda: flight.vehicle.mode == LAND)
    assert flight.run(10.0, lambda: not flight.vehicle.armed)
    flight.end()


def test_stamps_are_right_again_1_s_after_a_step_of_the_clock():
    """The vehicle flies on, and its scans are not too old for the navigator."""
    flight, wrong_s = failures.fly_clock_row("ardupilot", 0.7, seed=2)
    assert wrong_s < 1.2
    flight.end()


def test_the_bridge_waits_for_the_position():
    flight = StandInFlight()
    flight.vehicle.boot_s = 30.0
    flight.run(5.0)
    assert flight.state is State.NOT_READY and "no position estimate" in flight.machine.reason
    assert flight.run(15.0, lambda: flight.state is State.READY)
    assert flight.vehicle.boot_s == pytest.approx(42.4, abs=0.6)
    flight.end()
