"""Simulated quadcopters that take off and land: the bodies of stand-in vehicles.

The bodies, their guard, the floor, the walls and the obstacles are the simulator's, and so are the
flight controller and the horizontal response of ArduCopter (``sim.autopilot``). The simulator holds
one altitude; here each body gets a vertical acceleration of its own, or has its motors off.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from quad_nav.geometry import Pose2D, Pose3D, rotate
from quad_nav.sim.autopilot import Autopilot, flight_params
from quad_nav.sim.body import World
from quad_nav.sim.contacts import ContactLog
from quad_nav.sim.flight import Airframe, AutopilotResponse, BodyState, FlightLaw, FlightParams
from quad_nav.sim.scene import GUARD_HEIGHT_M, MOUNT_HEIGHT_M, Scene, Walls
from quad_nav.sim.simulation_params import STEP_S

REST_M = GUARD_HEIGHT_M / 2.0 - MOUNT_HEIGHT_M
"""Height of a body that stands on the floor."""
AIRFRAME = Airframe(response=AutopilotResponse())
"""With the autopilot alone: the bridge in front of it is the real one."""
_TOUCHING_M = 0.015
_MOST_MPS2 = 8.0
EMPTY = Scene("empty", 400.0, 400.0, 1.0, Walls(), (), (Pose2D(200.0, 200.0, 0.0),))


class Bodies:
    """The bodies of all stand-ins in one scene, which stand on the floor at first.

    Attributes:
        state: State of all bodies in ``map``.
        count: Steps since the start.
        contacts: Contacts since the start, without those with the floor.
        lift_mps2: Vertical acceleration of each body; None with the motors off.
        drift_mps: Velocity (x, y) in ``map`` of each body that its estimator does not know.
    """

    def __init__(self, scene=EMPTY, starts=None, airframes=(AIRFRAME,)):
        """Put bodies on the floor.

        Args:
            scene: The room.
            starts: Start poses; the scene's first one by default.
            airframes: Of each body, or of all.
        """
        starts = list(starts or scene.starts[:1])
        airframes = list(airframes) * (len(starts) if len(airframes) == 1 else 1)
        self._world = World(replace(scene, altitude_m=REST_M), starts, airframes[0], STEP_S)
        self._laws = [FlightLaw(one, flight_params(one, FlightParams())) for one in airframes]
        self._autopilots = [
            Autopilot(one.response, law, 1, STEP_S) for one, law in zip(airframes, self._laws)
        ]
        self._log = ContactLog()
        self.contacts = []
        self.state, self.count = self._world.state(), 0
        self.lift_mps2 = [None] * len(starts)
        self.drift_mps = [(0.0, 0.0)] * len(starts)

    @property
    def now_s(self):
        return self.count * STEP_S

    def __len__(self):
        return len(self.lift_mps2)

    def set_velocity(self, robot, forward_mps, left_mps, yaw_radps):
        """Give a set-point in the body's frame; it takes effect with the autopilot's delay."""
        command = np.array([forward_mps, left_mps, yaw_radps])
        self._autopilots[robot].receive(0, command, self._one(robot), self.count)

    def _one(self, robot):
        """Return the state of one body alone, as its autopilot estimates it."""
        rows = self.state.rows[robot : robot + 1].copy()
        rows[0, 7:9] -= self.drift_mps[robot]
        return BodyState(rows)

    def step(self):
        """Advance all bodies by one step of the simulation."""
        forces, torques = np.zeros((len(self), 3)), np.zeros((len(self), 3))
        for robot, lift in enumerate(self.lift_mps2):
            if lift is not None:
                found = self._push(robot, min(max(lift, -_MOST_MPS2), _MOST_MPS2))
                forces[robot], torques[robot] = found[0][0], found[1][0]
        self.state = self._world.step(self.state, forces, torques)
        self.count += 1
        touches = [touch for touch in self._world.touches() if touch.other != "floor"]
        self.contacts += self._log.update(self.now_s, touches)

    def _push(self, robot, lift_mps2):
        """Return force and torque of a body in flight."""
        law, state = self._laws[robot], self._one(robot)
        commands = self._autopilots[robot].commands(state, self.count)
        bandwidth, row = law.gains.altitude_bandwidth_radps, state.rows[0]
        # The altitude for which the flight law accelerates like this.
        lead_m = (lift_mps2 + 2.0 * bandwidth * float(row[9])) / bandwidth**2
        return law.thrust_and_torque(state, commands, float(row[2]) + lead_m)

    def height_m(self, robot):
        """Return the height above the floor on which it stood."""
        return float(self.state.rows[robot, 2]) - REST_M

    def is_touching(self, robot):
        """Return whether it stands on the floor."""
        return self.height_m(robot) < _TOUCHING_M

    def pose(self, robot):
        """Return the pose in ``map``."""
        x, y, z, *quaternion = self.state.rows[robot, :7].tolist()
        return Pose3D(x, y, z - REST_M, tuple(quaternion))

    def place(self, robot):
        """Return the position (x, y, z) in ``map``."""
        return tuple(self.state.rows[robot, :3].tolist())

    def velocity_mps(self, robot):
        """Return the velocity (x, y, z) in ``map``."""
        return tuple(self.state.rows[robot, 7:10].tolist())

    def turn_radps(self, robot):
        """Return the angular velocity (forward, left, up) in the body's frame."""
        x, y, z, w = self.state.rows[robot, 3:7].tolist()
        return rotate((-x, -y, -z, w), self.state.rows[robot, 10:13].tolist())

    def body_velocity_mps(self, robot):
        """Return the horizontal velocity (forward, left) along the heading."""
        vx, vy, _ = self.velocity_mps(robot)
        yaw = self.pose(robot).yaw_rad
        return (
            math.cos(yaw) * vx + math.sin(yaw) * vy,
            math.cos(yaw) * vy - math.sin(yaw) * vx,
        )

    def close(self):
        self._world.close()


def warm_up():
    """Fly a body for some steps, so that nothing is compiled in flight."""
    bodies = Bodies()
    bodies.lift_mps2[0] = 1.0
    for _ in range(5):
        bodies.set_velocity(0, 0.1, 0.0, 0.0)
        bodies.step()
    bodies.close()
