"""Two vehicles on a mission: pilots, links, batteries and nodes fail in any combination."""

from __future__ import annotations

import math
from functools import lru_cache

import pytest

pytest.importorskip("rospy")
pytest.importorskip("greenlet")

from hypothesis import strategies as st  # noqa: E402
from hypothesis.stateful import (  # noqa: E402
    RuleBasedStateMachine,
    initialize,
    invariant,
    rule,
)
from interaction.known_vehicles import Known, Request  # noqa: E402
from interaction.machines import assert_sound, machine_settings  # noqa: E402
from interaction.vehicle_world import EPOCH_S, STEP_S, VEHICLES, VehicleWorld  # noqa: E402

from quad_nav.topics.vehicle_states import IN_FLIGHT, State  # noqa: E402

NUMBER = st.integers(0, VEHICLES - 1)
CHANGES_MODE, RETURNS_MODE, MOVES_STICK, FREES_STICK, DISARMS = (
    "changes the mode",
    "gives the mode back",
    "moves a stick",
    "frees the stick",
    "disarms",
)
FAULTS = {
    "charge 12 %": lambda vehicle: setattr(vehicle, "battery", 12),
    "9.0 V": lambda vehicle: setattr(vehicle, "voltage_v", 9.0),
    "no GPS": lambda vehicle: vehicle.lose_receiver(),
    "no position": lambda vehicle: setattr(vehicle, "hides_position", True),
}
BROKEN = (
    ("ATTITUDE", {"roll": math.inf}),
    ("LOCAL_POSITION_NED", {"x": math.nan}),
    ("PARAM_VALUE", {"param_id": "RTL_ALT", "param_value": math.nan, "param_type": 9}),
    ("HEARTBEAT", {"autopilot": 3}),
)
OF_ONE = ("/vehicle{}/take_off", "/vehicle{}/land", "/vehicle{}/resume")
OF_ONE += ("/mission/quad{}/stop", "/mission/quad{}/resume")
OF_ALL = ("/vehicles/take_off", "/vehicles/land", "/mission/stop", "/mission/resume")
ARM, TAKE_OFF = 400, 22
ON_GROUND_S, IN_FLIGHT_S = 1.5, 12.0
"""Where both vehicles are so long after the begin."""
COMMAND_S = 0.5 + 3.0 * STEP_S
"""A velocity command counts for so long; its set-point is sent again meanwhile."""
TOLD_S = 1.3
"""The bridge knows of a pilot by then: heartbeats come once a second."""
PAUSED_S = 5.0
"""The mission of a vehicle that is taken over is stopped by then."""
LANDS_S = 6.0
"""A vehicle with a low battery, or without a position, begins to land by then."""
FAILSAFE_S = 8.0
"""The autopilot does not wait longer for a bridge that is dead."""
STAMP_S, STEPPED_S = 0.3, 3.0
"""Odometry is not older, so soon after a step of a clock."""


@lru_cache(maxsize=None)
def undisturbed(autopilot):
    """Return the places of vehicle 1 by the time, while nothing happens to vehicle 0."""
    world, places = VehicleWorld(autopilot), {}
    world.on_step = lambda: places.setdefault(world.bodies.count, world.bodies.place(1))
    world.graph.run(22.0)  # then both have flown their missions
    world.close()
    return places


class VehicleMachine(RuleBasedStateMachine):
    """What happens to the vehicles.

    Attributes:
        world: The vehicles and all nodes.
        known: What is known of each vehicle.
        requests: Those that have no response yet.
        faults: What has gone wrong so far.
        is_alone: Whether nothing has happened yet that concerns vehicle 1, too.
    """

    @initialize(
        autopilot=st.sampled_from(["ardupilot", "px4"]),
        seconds=st.sampled_from([ON_GROUND_S, IN_FLIGHT_S]),
    )
    def begin(self, autopilot, seconds):
        self.autopilot, self.is_alone = autopilot, True
        self.requests, self.faults = [], []
        undisturbed(autopilot)
        self.world = VehicleWorld(autopilot)
        self.known = [Known(self.now_s) for _ in range(VEHICLES)]
        self.world.on_step = self.take_step
        self.run(seconds)

    def teardown(self):
        if hasattr(self, "world"):
            self.world.close()

    @property
    def now_s(self):
        return self.world.graph.threads.now_s

    def run(self, seconds):
        self.world.graph.run(seconds)

    def touch(self, number):
        """Note that something happens to a vehicle; return it and what is known of it."""
        both_fly = all(self.world.is_flying(one) for one in range(VEHICLES))
        self.is_alone &= number == 0 and both_fly  # the begin of the mission waits for all
        return self.world.vehicles[number], self.known[number]

    # What is known of the flight.

    def take_step(self):
        """Compare a step of the vehicles with what is known."""
        for number, known in enumerate(self.known):
            vehicle, radio = self.world.vehicles[number], self.world.radios[number]
            if vehicle.armed and not known.is_armed and not known.may_take_off:
                self.faults.append(f"{self.now_s:.2f}: vehicle {number} is armed without an order")
            if known.is_armed and not vehicle.armed:
                known.disarmed_s = self.now_s
                known.may_take_off, known.taken_s = self.is_asked_to_take_off(number), None
            known.is_armed = vehicle.armed
            self.check_sent(number, known, radio)
            radio.orders.clear()
            radio.setpoints.clear()
        for request in [request for request in self.requests if request.responses]:
            self.requests.remove(request)
            self.take_response(request, request.responses[0])

    def is_asked_to_take_off(self, number):
        return any(request.takes_off and number in request.before for request in self.requests)

    def take_response(self, request, response):
        """Note what follows from the response to a request."""
        is_done = response is not None and response.success
        for number, might_take_off in request.before.items():
            known = self.known[number]
            known.changed_s = self.now_s
            is_left_out = not is_done or f"quad{number}: " in response.message
            if not is_done and request.takes_off and not known.is_armed:
                known.may_take_off = might_take_off or self.is_asked_to_take_off(number)
            if not request.takes_control and known.taken_s is not None:
                known.taken_s = self.now_s  # it lands, unless its pilot still moves the sticks
            if is_left_out or not request.takes_control:
                continue
            is_down = not known.is_armed and request.asked_s - known.disarmed_s > TOLD_S
            if is_down and not request.takes_off:
                self.faults.append(f"{self.now_s:.2f}: vehicle {number} resumes on the ground")
            if known.taken_s is None or known.taken_s < request.asked_s:
                known.taken_s = None
                known.is_stopped &= request.takes_off

    def check_sent(self, number, known, radio):
        """Check what a bridge has sent since the last step."""
        asked = [one for one in self.requests if number in one.before]
        is_taken = known.taken_s is not None and self.now_s - known.taken_s > TOLD_S
        if is_taken and not any(one.takes_control for one in asked):
            wrong = [fields for _, fields in radio.orders if fields["command"] in (ARM, TAKE_OFF)]
            if wrong or (radio.setpoints and not asked):
                self.faults.append(f"{self.now_s:.2f}: vehicle {number} is not its bridge's")
        for at_s, fields in radio.setpoints:
            late_s = at_s - self.world.commanded_s[number]
            if math.hypot(fields["vx"], fields["vy"]) > 0.0 and late_s > COMMAND_S:
                self.faults.append(f"{at_s:.2f}: vehicle {number} moves {late_s:.2f} s later")

    # What happens.

    @rule(seconds=st.sampled_from([0.1, 0.6, 2.0, 6.0]))
    def time_passes(self, seconds):
        self.run(seconds)

    @rule(
        number=NUMBER,
        does=st.sampled_from([CHANGES_MODE, RETURNS_MODE, MOVES_STICK, FREES_STICK, DISARMS]),
    )
    def the_pilot(self, number, does):
        vehicle, known = self.touch(number)
        machine = self.world.machines.get(number)
        if does == RETURNS_MODE and machine is None:
            return  # a pilot gives the mode to no bridge that is dead
        state, was_ours = machine and machine.state, vehicle.mode == vehicle.kind["control"]
        is_ours = state in (State.FLYING, State.HOLDING)
        if does in (CHANGES_MODE, MOVES_STICK) and is_ours and self.world.radios[number].hears:
            known.taken_s, known.is_stopped = known.taken_s or self.now_s, True
            known.changed_s = self.now_s
        if does == DISARMS:
            vehicle.kill_motors()
        elif does in (MOVES_STICK, FREES_STICK):
            vehicle.sticks[0] = 1750 if does == MOVES_STICK else 1500
        else:
            vehicle.set_mode(vehicle.kind["other" if does == CHANGES_MODE else "control"])
        self.run(0.3)
        if does == CHANGES_MODE and was_ours and state is State.ARMING and not vehicle.armed:
            known.may_take_off = False

    @rule(number=NUMBER, fault=st.sampled_from(sorted(FAULTS)))
    def the_vehicle_has(self, number, fault):
        vehicle, known = self.touch(number)
        known.poor_s = known.poor_s or self.now_s
        FAULTS[fault](vehicle)
        self.run(0.3)

    @rule(number=NUMBER, hears=st.booleans(), is_heard=st.booleans())
    def the_link_changes(self, number, hears, is_heard):
        _, known = self.touch(number)
        radio, known.changed_s = self.world.radios[number], self.now_s
        radio.hears, radio.is_heard = hears, is_heard
        self.run(0.6)

    @rule(number=NUMBER)
    def a_ground_station_connects(self, number):
        self.touch(number)
        self.world.radios[number].has_station = True
        self.run(0.1)

    @rule(number=NUMBER, message=st.sampled_from(BROKEN))
    def a_broken_message_comes(self, number, message):
        self.touch(number)
        self.world.radios[number].inbox.append(message)
        self.run(0.1)

    @rule(number=st.none() | NUMBER, seconds=st.sampled_from([-2.5, 2.5]))
    def a_clock_steps(self, number, seconds):
        """The clock of a vehicle, or of this machine."""
        self.is_alone &= number is not None
        if number is None:
            self.world.offset_s += seconds
        else:
            self.touch(number)[0].clock_step_s += seconds
        for known in self.known if number is None else [self.known[number]]:
            known.stepped_s = self.now_s
        self.run(0.3)

    @rule(number=NUMBER, is_soon=st.booleans())
    def the_bridge_is_killed_or_started_again(self, number, is_soon):
        _, known = self.touch(number)
        known.changed_s = self.now_s
        was_dead = number not in self.world.machines
        if not was_dead:
            self.world.kill_bridge(number)
            self.run(0.6)
        if was_dead or is_soon:
            if self.world.is_flying(number):
                known.taken_s, known.is_stopped = known.taken_s or self.now_s, True
            self.world.start_bridge(number, True)
            self.run(0.6)

    @rule(number=NUMBER)
    def the_navigator_is_killed_or_started_again(self, number):
        _, known = self.touch(number)
        known.changed_s = self.now_s
        is_alive = number in self.world.pilots
        (self.world.kill_pilot if is_alive else self.world.start_pilot)(number)
        self.run(0.6)

    @rule(is_soon=st.booleans())
    def the_sequencer_is_killed_or_started_again(self, is_soon):
        self.is_alone = False
        for known in self.known:
            known.changed_s = self.now_s
        was_dead = self.world.sequencer is None
        if not was_dead:
            self.world.kill_sequencer()
            self.run(0.6)
        if was_dead or is_soon:
            self.world.start_sequencer(True)
            self.run(0.6)

    @rule(number=NUMBER, what=st.sampled_from(OF_ONE))
    def somebody_asks_one(self, number, what):
        self.touch(number)
        self.ask(what.format(number), [number])

    @rule(what=st.sampled_from(OF_ALL))
    def somebody_asks_all(self, what):
        self.is_alone = False
        self.ask(what, range(VEHICLES))

    def ask(self, service, numbers):
        """Call a service; what follows from it follows when it responds."""
        asked = [self.known[number] for number in numbers]
        for known in asked:
            known.changed_s = self.now_s
        if service.startswith("/mission"):  # it responds at once, or not at all
            response = self.world.call(service)
            for known in asked if response is not None and response.success else ():
                known.is_stopped = service.endswith("stop") or known.taken_s is not None
        else:
            before = {number: self.known[number].may_take_off for number in numbers}
            responses = self.world.ask(service)
            self.requests.append(Request(service, self.now_s, before, responses))
            for known in asked if self.requests[-1].takes_off else ():
                known.may_take_off = True
        self.run(0.3)

    # What must hold.

    @invariant()
    def no_node_crashes(self):
        assert_sound(self.world.graph)

    @invariant()
    def nothing_moves_or_arms_unasked(self):
        assert not self.faults, self.faults

    @invariant()
    def a_stopped_mission_has_no_goal(self):
        for number, known in enumerate(self.known):
            has_nodes = self.world.sequencer is not None and number in self.world.machines
            is_told = has_nodes and self.world.radios[number].hears
            is_settled = is_told and self.now_s - known.changed_s > PAUSED_S
            if known.is_stopped and is_settled and number in self.world.pilots:
                assert self.world.pilots[number].goal is None, number

    @invariant()
    def every_stop_has_a_reason(self):
        for machine in self.world.machines.values():
            if machine.state in (State.HOLDING, State.LANDING, State.TAKEN_OVER, State.NO_LINK):
                assert machine.reason, machine.state

    @invariant()
    def a_vehicle_without_battery_or_position_lands(self):
        for number, known in enumerate(self.known):
            machine, radio = self.world.machines.get(number), self.world.radios[number]
            if machine is None or known.poor_s is None or self.now_s - known.poor_s < LANDS_S:
                continue
            if machine.state in IN_FLIGHT and radio.hears and radio.is_heard:
                settled_s = self.now_s - known.changed_s
                assert machine.state is State.LANDING or settled_s < LANDS_S, number

    @invariant()
    def a_vehicle_does_not_wait_for_a_dead_bridge(self):
        for number, known in enumerate(self.known):
            vehicle = self.world.vehicles[number]
            is_dead = number not in self.world.machines
            if is_dead and self.now_s - known.changed_s > FAILSAFE_S and vehicle.armed:
                assert vehicle.mode != vehicle.kind["control"] or not self.world.is_flying(number)

    @invariant()
    def stamps_are_right_soon_after_a_step(self):
        for number, known in enumerate(self.known):
            radio, vehicle = self.world.radios[number], self.world.vehicles[number]
            is_told = radio.hears and radio.is_heard and number in self.world.machines
            is_known = vehicle.has_position and not vehicle.hides_position
            if is_told and is_known and self.now_s - known.stepped_s > STEPPED_S:
                now_s = EPOCH_S + self.now_s + self.world.offset_s
                late_s = now_s - self.world.odometry_s[number]
                assert abs(late_s) < STAMP_S or self.now_s - known.changed_s < STEPPED_S, late_s

    @invariant()
    def the_other_vehicle_flies_as_it_would_have(self):
        place = undisturbed(self.autopilot).get(self.world.bodies.count)
        if self.is_alone and place is not None:
            assert math.dist(self.world.bodies.place(1), place) < 0.02


TestVehicleMachine = VehicleMachine.TestCase
TestVehicleMachine.settings = machine_settings(few=20, share=0.1)
