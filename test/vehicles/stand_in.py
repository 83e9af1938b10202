"""A stand-in for a real vehicle: a MAVLink endpoint around a simulated body.

This module has what autopilots have in common: the link with its delays and losses, heartbeats,
messages at the rates that were asked for, parameters, clocks, acknowledgements. ``ardupilot.py``
and ``px4.py`` have their behaviour. Time is an argument; all randomness comes from a seed.
"""

from __future__ import annotations

import heapq
import math
import random
from types import SimpleNamespace

from vehicles.estimator import Estimator, LocalFrame
from vehicles.stand_in_messages import MESSAGES, Messages

from quad_nav.sim.simulation_params import STEP_S

ACCEPTED, DENIED, UNSUPPORTED, FAILED = 0, 2, 3, 4
ON_GROUND, IN_AIR, TAKING_OFF, LANDING = 1, 2, 3, 4
CRITICAL, WARNING, INFO = 2, 4, 6
ORIGIN = LocalFrame()
FIX_S, GLITCH_S = 10.5, 10.1
_HEARTBEAT_S, _TIMESYNC_S = 1.0, 10.0
_LATENCY_S = (0.0005, 0.007)
_LOST_BEFORE_S = 1.25
"""A rate that is asked for this soon after boot is acknowledged and forgotten."""


class StandIn(Messages):
    """The endpoint; ``receive`` takes messages, ``messages`` returns those that arrive by now.

    Attributes:
        now_s: Time.
        boot_s: Time since boot.
        mode: Custom mode.
        armed: Whether the motors are armed.
        landed: MAV_LANDED_STATE.
        parameters: Values by name.
        setpoints: (time, fields) of all set-points that came.
        battery: Charge in percent.
        voltage_v: Voltage of its battery, with three cells.
        clock_step_s: Fault: how far its clock has stepped.
        sticks: Pulse widths of channels 1 to 4.
        refuses_arming: Fault: reason for which arming is refused.
        loses_down: Fault: nothing that it sends arrives.
        loses_up: Fault: nothing arrives at it.
        delay_down_s: Fault: delay of what it sends.
        delay_up_s: Fault: delay of what it gets.
        loss_share: Fault: share of the messages that are lost, both ways.
        hides_position: Fault: it sends no position.
        has_ended: Its program has crashed.
        has_low_battery: It has told a low battery; latched.
    """

    NUMBER = 0  # MAV_AUTOPILOT
    MESSAGES = MESSAGES
    DEFAULTS = {}
    STATUS_BEFORE_FLIGHT, STATUS_IN_FLIGHT, STATUS_CRITICAL = 3, 4, 5

    def __init__(self, bodies, robot=0, frame=ORIGIN, seed=0, boot_s=60.0, parameters=None):
        self._bodies, self._robot = bodies, robot
        self.estimator = Estimator(bodies, robot, frame, seed)
        self._random = random.Random(f"stand-in {seed}")
        self.parameters = {**self.DEFAULTS, **(parameters or {})}
        self.now_s, self.boot_s = 0.0, boot_s
        self.mode, self.armed, self.landed = 0, False, ON_GROUND
        self.battery, self.voltage_v, self.sticks = 97, 12.6, [1500, 1500, 1500, 1500]
        self.clock_step_s, self._low_s, self._glitch = 0.0, None, None
        self.refuses_arming = ""
        self.loses_down = self.loses_up = self.hides_position = self.has_ended = False
        self.delay_down_s = self.delay_up_s = self.loss_share = 0.0
        self.setpoints, self.received = [], []
        self.is_critical = self.has_low_battery = False
        self._periods, self._due = {}, {"HEARTBEAT": 0.95, "TIMESYNC": 4.0}
        self._queue, self._inbox, self._sequence, self._last_s = [], [], 0, 0.0

    # Messages to it.

    def receive(self, name, fields, sender=(255, 191)):
        """Take a message; it takes effect after the delay of the link."""
        self.received.append(name)
        if self.loses_up or self._random.random() < self.loss_share:
            return
        self._sequence += 1
        due_s = self.now_s + self.delay_up_s
        heapq.heappush(self._inbox, (due_s, self._sequence, name, dict(fields), sender))

    def _take(self, name, fields, sender):
        if self.has_ended or fields.get("target_system", 1) not in (0, 1):
            return
        handler = getattr(self, f"_on_{name.lower()}", None)
        if handler:
            handler(Fields(**fields), sender)

    def _on_timesync(self, message, _):
        if message.tc1 == 0:
            self.send("TIMESYNC", tc1=int(self.clock_s * 1e9), ts1=message.ts1)

    def _on_param_request_read(self, message, _):
        self._send_parameter(text(message.param_id))

    def _on_param_set(self, message, _):
        name = text(message.param_id)
        if name in self.parameters:
            before, self.parameters[name] = self.parameters[name], float(message.param_value)
            self._send_parameter(name)
            self.parameter_changed(name, before)

    def parameter_changed(self, name, before):
        """React to a parameter that was written."""

    def _send_parameter(self, name):
        if name in self.parameters:
            self.send(
                "PARAM_VALUE",
                param_id=name,
                param_value=self.parameters[name],
                param_type=9,
                param_count=1346,
                param_index=65535,
            )

    def _on_command_long(self, message, sender):
        command = int(message.command)
        if command == 511:
            result, texts = self._set_rate(int(message.param1), message.param2)
        else:
            result, texts = self.command(command, message)
        self.acknowledge(command, result, sender)
        for severity, words in texts:
            self.say(severity, words)

    def command(self, number, message):
        """Carry out a command; return the result and the texts (severity, text)."""
        return UNSUPPORTED, []

    def acknowledge(self, command, result, sender):
        self.send(
            "COMMAND_ACK",
            command=command,
            result=result,
            progress=0,
            result_param2=0,
            target_system=sender[0],
            target_component=sender[1],
        )

    def _set_rate(self, number, interval_us):
        name = self.MESSAGES.get(number)
        if name is None:
            return DENIED, [(CRITICAL, f"No ap_message for mavlink id ({number})")]
        if self.boot_s < _LOST_BEFORE_S:
            return ACCEPTED, []  # and forgotten
        if interval_us <= 0:
            self._periods.pop(name, None)
        else:
            self._periods[name] = max(interval_us / 1e6, 0.003)
            self._due[name] = self.boot_s
        return ACCEPTED, []

    # Time.

    def before_step(self):
        """Handle what has arrived, and fly on: called before each step of the bodies."""
        while self._inbox and self._inbox[0][0] <= self.now_s + 1e-9:
            _, _, name, fields, sender = heapq.heappop(self._inbox)
            self._take(name, fields, sender)
        self.now_s += STEP_S
        self.boot_s += STEP_S
        self.estimator.step(STEP_S)
        self._end_glitch()
        if self.has_ended:
            return
        self.fly()
        self._report()

    def fly(self):
        """Watch the failsafes, and let the body do what the mode asks for."""

    def reboot(self, boot_s):
        """Start again; rates and clocks are forgotten."""
        self.boot_s, self._periods = boot_s, {}
        self._due = {"HEARTBEAT": 1.95, "TIMESYNC": 4.0}

    # Messages from it.

    def messages(self):
        """Return (name, fields) of what has arrived on the other side by now."""
        found = []
        while self._queue and self._queue[0][0] <= self.now_s:
            found.append(heapq.heappop(self._queue)[2:])
        return found

    def send(self, name, **fields):
        """Send a message; it arrives after the delay of the link, in order."""
        if self.loses_down or self.has_ended or self._random.random() < self.loss_share:
            return
        low_s, high_s = _LATENCY_S
        share = self._random.random() ** 3  # mostly soon, sometimes late
        due_s = self.now_s + low_s + share * (high_s - low_s) + self.delay_down_s
        self._last_s = max(self._last_s, due_s)
        self._sequence += 1
        heapq.heappush(self._queue, (self._last_s, self._sequence, name, fields))

    def say(self, severity, words):
        """Send a STATUSTEXT."""
        self.send("STATUSTEXT", severity=severity, text=words, id=0, chunk_seq=0)

    @property
    def base_mode(self):
        """MAV_MODE_FLAG bits of the heartbeat."""
        return 209 if self.armed else 81

    @property
    def system_status(self):
        """MAV_STATE of the heartbeat."""
        if self.is_critical:
            return self.STATUS_CRITICAL
        return self.STATUS_BEFORE_FLIGHT if self.landed == ON_GROUND else self.STATUS_IN_FLIGHT

    def heartbeat(self):
        """Send a heartbeat now, beside the periodic ones."""
        self.send(
            "HEARTBEAT",
            type=2,
            autopilot=self.NUMBER,
            base_mode=self.base_mode,
            custom_mode=self.mode,
            system_status=self.system_status,
            mavlink_version=3,
        )

    def set_mode(self, mode):
        """Change the mode, as somebody else can; a heartbeat tells it at once."""
        self.mode = mode
        self.heartbeat()

    def _report(self):
        if self._is_due("HEARTBEAT", _HEARTBEAT_S):
            self.heartbeat()
        if self._is_due("TIMESYNC", _TIMESYNC_S):
            self.send("TIMESYNC", tc1=0, ts1=int(self.clock_s * 1e9))
        for name, period_s in list(self._periods.items()):
            if not self._is_due(name, period_s):
                continue
            if name == "LOCAL_POSITION_NED" and (self.hides_position or not self.has_position):
                continue
            self.send(name, **getattr(self, f"_make_{name.lower()}")())

    @property
    def has_receiver(self):
        """Whether the receiver has a position."""
        return self.boot_s >= FIX_S and not self.estimator.is_dead_reckoning

    @property
    def has_position(self):
        """Whether the estimator knows where it is."""
        return not self.estimator.is_lost

    def _is_due(self, name, period_s):
        due_s = self._due.setdefault(name, self.boot_s)
        if self.boot_s < due_s:
            return False
        self._due[name] = max(due_s + period_s, self.boot_s - period_s)
        return True

    @property
    def clock_s(self):
        """Time of its clock."""
        return self.boot_s + self.clock_step_s

    @property
    def _boot_ms(self):
        return int(self.clock_s * 1e3)

    def is_voltage_low(self, least_v, seconds):
        """Return whether the voltage has been too low for some seconds."""
        if self.voltage_v >= least_v:
            self._low_s = None
        elif self._low_s is None:
            self._low_s = self.now_s
        return self._low_s is not None and self.now_s - self._low_s >= seconds

    # What tests inject, and what they read of the true body.

    def advance(self, seconds):
        """Advance a vehicle that is alone with its bodies; return what arrives."""
        advance(self._bodies, [self], seconds)
        return self.messages()

    def freeze(self):
        """Let the estimate stay what it is."""
        self.estimator.is_frozen = True

    def glitch(self, north_m):
        """Let the receiver's position jump; the estimator takes it after GLITCH_S."""
        self._glitch = (self.now_s + GLITCH_S, north_m)

    def _end_glitch(self):
        if self._glitch is not None and self.now_s >= self._glitch[0]:
            self.jump(north_m=self._glitch[1])
            self._glitch = None

    def jump(self, north_m=0.0, up_m=0.0):
        """Let the estimate jump."""
        self.estimator.jump_m = (north_m, 0.0, up_m)

    def kill_motors(self):
        """Disarm in the air, which the next heartbeat tells."""
        self.armed = False

    @property
    def height_m(self):
        """True height above the floor."""
        return self._bodies.height_m(self._robot)

    @property
    def velocity(self):
        """True velocity (north, east, down)."""
        x, y, z = self._bodies.velocity_mps(self._robot)
        return (*self.estimator.ned(x, y), -z)

    @property
    def speed_mps(self):
        """True horizontal speed."""
        return math.hypot(*self.velocity[:2])


class Fields(SimpleNamespace):
    """Fields of a message; one that is left out is 0."""

    def __getattr__(self, _):
        return 0


def text(value):
    """Return a name that travels as bytes or as a text."""
    return (value.decode() if isinstance(value, bytes) else value).rstrip("\0")


def advance(bodies, vehicles, seconds):
    """Advance bodies and their vehicles by a time, whole steps at a time."""
    for _ in range(max(1, round(seconds / STEP_S))):
        for vehicle in vehicles:
            vehicle.before_step()
        bodies.step()
