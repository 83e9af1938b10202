#!/usr/bin/env python3
"""Fly the tutorial's mission with stand-ins and the bridge, on a virtual clock.

    PYTHONPATH=src:test python3 test/vehicles/missions.py [FLIGHTS] [AUTOPILOT ...] [amcl | slam]

The navigators and the sequencers are those of offline flights. Their commands go through the
bridge, as MAVLink's messages or a Crazyflie's set-points, to two stand-ins, from take-off to
landing. Navigators and LIDARs see the bridge's estimate; contacts are those of the bodies. Each
flight is compared with one of the simulator with the same seed, start poses and limits of speed,
with the airframe `arducopter` and with the default one.

With `amcl` or `slam` the estimates drift as recorded, LIDARs are on the bodies, and navigators see
what it says: amcl on the map of the arena, slam without a map. A goal counts where the body is.

Exit status: 0 if all flights reach all goals without a contact, hold the altitude within 0.10 m,
and, without a localization, take at most 10 % longer than the simulator's.
"""

from __future__ import annotations

import math
import statistics
import sys
from dataclasses import dataclass, replace

import numpy as np
from vehicles.bodies import REST_M, Bodies
from vehicles.estimator import LocalFrame
from vehicles.stand_in import advance
from vehicles.virtual_flight import AIRFRAMES as BARE_AIRFRAMES
from vehicles.virtual_flight import STAND_INS, bridge_of

import quad_nav.api as quad
from quad_localization.offline import MAKERS, LocalizationErrors
from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.mission.summary import summarize
from quad_nav.offline.flight import Flight
from quad_nav.sim.flight import AIRFRAMES, BodyState
from quad_nav.sim.odometry import OdomFrames
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import STEP_S
from quad_nav.topics.vehicle_states import State
from quad_vehicles.telemetry import Limits
from quad_vehicles.vehicle_file import FIXED, Vehicle

TICK_STEPS = 6  # 25 ms, as in the node
TIME_LIMIT_S, GROUND_LIMIT_S = 400.0, 60.0
MOST_M, MOST_SHARE = 0.10, 1.10
LIMITS = Limits(speed_mps=1.0)
JITTER_M = 0.3


class MissionBridge:
    """The bridge of one vehicle, and where its odometry frame is in `map`."""

    def __init__(self, number, autopilot, bodies, seed, altitude_m, localization):
        self.start, self._bodies, self._number = bodies.pose(number), bodies, number
        kind = "crazyflie" if autopilot == "crazyflie" else "mavlink"
        kinds = {} if kind == "crazyflie" else {"autopilot": autopilot, "has_radio": False}
        kinds["localization"] = localization
        file = Vehicle(number, kind, altitude_m=altitude_m, limits=LIMITS, **kinds)
        heading_rad = math.remainder(0.7 * seed + 2.0 * number, math.tau)
        frame = LocalFrame(3.0 * number, -2.0 * number, heading_rad)
        self._bridge = bridge_of(file, bodies, number, 100 * seed + number, frame=frame)
        self.vehicle, self.machine = self._bridge.vehicle, self._bridge.machine
        if localization != FIXED:
            self.vehicle.estimator.drifts = True
        self.receive = self._bridge.receive
        self.map_from_odom = Pose2D(0.0, 0.0).to_3d()

    @property
    def estimate(self):
        return self._bridge.adapter.estimate

    def tick(self, now_s):
        self._deliver(self._bridge.adapter.tick(now_s)[1])

    def follow(self, twist, now_s):
        self._deliver(self._bridge.adapter.follow(twist, now_s)[1])

    def _deliver(self, messages):
        for message in messages:
            self._bridge.deliver(*message)

    def begin(self):
        """Fix the odometry frame in `map`: it stood at its start when it took off."""
        frame = self.start.to_2d().compose(self.machine.odom_from_start.inverse()).to_3d()
        self.map_from_odom = Pose3D(frame.x_m, frame.y_m, -self.machine.ground_m, frame.quaternion)

    @property
    def true_frame(self):
        """Where the odometry frame is, which drifts."""
        odom_from_base = self.estimate.odom_from_base.to_2d()
        return self._bodies.pose(self._number).to_2d().compose(odom_from_base.inverse())

    def row(self):
        """Return the estimated state in `map`, float64[13]."""
        estimate = self.estimate
        pose = self.map_from_odom.compose(estimate.odom_from_base)
        velocity = pose.rotation @ np.array(estimate.linear_mps)
        turn = pose.rotation @ np.array(estimate.angular_radps)
        return np.array([pose.x_m, pose.y_m, pose.z_m, *pose.quaternion, *velocity, *turn])


class VehicleSimulation(Simulation):
    """The simulation's calls, answered by stand-ins and their bridges in the air."""

    def fly_with(self, autopilot, seed, localization=FIXED, is_told=True):
        """Take off with all vehicles.

        Args:
            autopilot: Kind of the vehicles.
            seed: Seed of their errors.
            localization: As in the file of the vehicles.
            is_told: Whether the bridges are told where they are, until the localization does.

        Raises:
            AssertionError: One does not.
        """
        self.bodies = Bodies(self.scene, self._starts, [BARE_AIRFRAMES[autopilot]])
        altitude_m = self.scene.altitude_m
        self.bridges = [
            MissionBridge(k, autopilot, self.bodies, seed, altitude_m, localization)
            for k in range(self.n_robots)
        ]
        self.altitudes_m, self._is_localized = [], localization != FIXED
        self._is_told = is_told and self._is_localized
        self._until(lambda machine: machine.state is State.READY)
        for bridge in self.bridges:
            assert bridge.machine.take_off(self.bodies.now_s).is_accepted
            bridge.begin()
        # A hover of a second, in which the height settles.
        self._until(lambda machine: machine.state in (State.HOLDING, State.FLYING))
        for _ in range(round(2.0 / STEP_S)):
            for bridge in self.bridges:
                bridge.machine.inputs.take_idle(self.bodies.now_s)
            self._step()
        self._take_over()
        self._is_told = False
        return self

    def _until(self, condition):
        end_s = self.bodies.now_s + GROUND_LIMIT_S
        while not all(condition(bridge.machine) for bridge in self.bridges):
            machines = [bridge.machine for bridge in self.bridges]
            assert self.bodies.now_s < end_s, [(one.state, one.reason) for one in machines]
            self._step()

    def _step(self):
        vehicles = [bridge.vehicle for bridge in self.bridges]
        advance(self.bodies, vehicles, STEP_S)
        now_s = self.bodies.now_s
        for bridge in self.bridges:
            bridge.receive(now_s)
            if self._is_told and bridge.estimate is not None:
                bridge.machine.inputs.take_frame(bridge.true_frame, now_s)
            if self.bodies.count % TICK_STEPS == 0:
                bridge.tick(now_s)

    def _take_over(self):
        if self._is_localized:
            rows = self.bodies.state.rows.copy()
            rows[:, 2] -= REST_M
        else:
            rows = np.array([bridge.row() for bridge in self.bridges])
        self._state = BodyState(rows)

    @property
    def odom_frames(self):
        if not self._is_localized:
            return super().odom_frames
        frames = [bridge.true_frame for bridge in self.bridges]
        return OdomFrames(np.array([(one.x_m, one.y_m, one.yaw_rad) for one in frames]))

    def set_command(self, robot, twist):
        self.bridges[robot].follow(twist, self.bodies.now_s)

    def advance(self, steps):
        before = len(self.bodies.contacts)
        for _ in range(steps):
            self._step()
            self.step_count += 1
        self.altitudes_m.append([self.bodies.height_m(k) for k in range(self.n_robots)])
        self._take_over()
        return [replace(contact, time_s=self.now_s) for contact in self.bodies.contacts[before:]]

    def land(self):
        """Land all; the localization, whose loop has ended, is not needed any more."""
        self._is_told = self._is_localized
        for bridge in self.bridges:
            bridge.machine.land(self.bodies.now_s, "the mission has ended")
        self._until(lambda machine: machine.state is State.LANDED)

    def keep_idle(self, robot):
        """Tell a bridge that its navigator has no goal."""
        self.bridges[robot].machine.inputs.take_idle(self.bodies.now_s)

    def close(self):
        super().close()
        self.bodies.close()


class VehicleFlight(Flight):
    """A mission whose commands go to vehicles."""

    def __init__(self, setup, autopilot, localization=FIXED, observers=()):
        self._autopilot, self._localization = autopilot, localization
        super().__init__(setup, observers)

    def _new_loop(self, hosted, processes):
        loop = super()._new_loop(hosted, 1)
        loop.simulation.close()
        params, seed = self.setup.simulation, self.setup.seed
        loop.simulation = VehicleSimulation(
            self.setup.scene, len(self.setup.robots), params, seed
        ).fly_with(self._autopilot, seed, self._localization)
        if self._localization == "slam":
            frames = [bridge.true_frame for bridge in loop.simulation.bridges]
            loop.group.localization.slam.frames.update(enumerate(frames))
        return loop

    def advance(self):
        for robot, one in enumerate(self.robots):
            if not one.has_navigator_goal:
                self.simulation.keep_idle(robot)
        super().advance()
        places = self.loop.group.localization
        for robot, bridge in enumerate(self.simulation.bridges):
            if places is not None and not places.is_lost(robot):
                frame, now_s = places.map_from_odom(robot), self.simulation.bodies.now_s
                bridge.machine.inputs.take_frame(frame, now_s)


@dataclass(frozen=True)
class Result:
    """Figures of one flight."""

    reached: int
    goals: int
    contacts: int
    time_s: float
    altitude_m: float = 0.0
    trouble: str = ""
    error_m: float = 0.0


def result_of(summary, altitude_m=0.0, trouble="", error_m=0.0):
    legs = [leg for robot in summary.robots for leg in robot.legs]
    time_s = max(sum(leg.time_s for leg in robot.legs) for robot in summary.robots)
    reached = sum(leg.reached for leg in legs)
    return Result(reached, len(legs), len(summary.contacts), time_s, altitude_m, trouble, error_m)


def fly_vehicles(setup, autopilot, localization=FIXED):
    """Fly a set-up with vehicles, from take-off to landing."""
    errors = LocalizationErrors()
    setup = replace(setup, localization=MAKERS.get(localization))
    flight = VehicleFlight(setup, autopilot, localization, [errors])
    simulation, trouble = flight.simulation, ""
    flying = (State.FLYING, State.HOLDING)
    while not flight.is_done and flight.now_s < TIME_LIMIT_S and not trouble:
        flight.advance()
        lost = [one.machine for one in simulation.bridges if one.machine.state not in flying]
        trouble = "; ".join(f"{one.state.value}: {one.reason}" for one in lost)
    sequencers = {robot.name: robot.sequencer for robot in flight.robots}
    summary = summarize(
        flight.log, sequencers, flight.now_s, sim_time_s=flight.now_s, wall_time_s=0.0
    )
    error_m = np.abs(np.array(simulation.altitudes_m) - setup.scene.altitude_m).max()
    simulation.land()
    flight.end()
    far_m = errors.figures()["position_error_m"]["p95"]
    return result_of(summary, float(error_m), trouble, far_m)


def prepare(seed, airframe, jitter_m=JITTER_M):
    """Return the set-up of a seed; the speeds are the shipped configuration's."""
    simulation = replace(quad.lidar_simulation(jitter_m=jitter_m), airframe=AIRFRAMES[airframe])
    return quad.prepare(seed=seed, simulation=simulation, time_limit_s=TIME_LIMIT_S)


def fly_simulated(seed, airframe, jitter_m):
    """Return the figures of the simulator's flight."""
    return result_of(quad.fly(prepare(seed, airframe, jitter_m), processes=1).summary)


def main():
    flights = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    localization = next((one for one in MAKERS if one in sys.argv), FIXED)
    jitter_m = JITTER_M if localization == FIXED else 0.0  # others begin where the file says
    every = BARE_AIRFRAMES if localization == FIXED else STAND_INS
    autopilots = [one for one in every if one in sys.argv] or list(every)
    failed = 0
    for autopilot in autopilots:
        shares, good = {"arducopter": [], "default": []}, 0
        for seed in range(1, flights + 1):
            setup = prepare(seed, "default", jitter_m)
            flown = fly_vehicles(setup, autopilot, localization)
            times = {name: fly_simulated(seed, name, jitter_m).time_s for name in shares}
            for name, time_s in times.items():
                shares[name].append(flown.time_s / time_s)
            is_good = flown.reached == flown.goals and not flown.contacts and not flown.trouble
            is_good = is_good and flown.altitude_m <= MOST_M
            good += is_good
            print(
                f"{autopilot} seed {seed}: {flown.reached} of {flown.goals} goals,"
                f" {flown.contacts} contacts, altitude within {flown.altitude_m:.3f} m,"
                f" {flown.time_s:.1f} s, simulator "
                + ", ".join(f"{time_s:.1f} s ({name})" for name, time_s in times.items())
                + (f", {flown.error_m:.3f} m from the truth (95 %)" if flown.error_m else "")
                + (f"; {flown.trouble}" if flown.trouble else ""),
                flush=True,
            )
        late = sum(share > MOST_SHARE and localization == FIXED for share in shares["arducopter"])
        failed += flights - good + late
        print(
            f"{autopilot}: {good} of {flights} flights without fault; time x "
            + ", ".join(
                f"{statistics.median(found):.3f} (median) {max(found):.3f} (most) of {name}"
                for name, found in shares.items()
            ),
            flush=True,
        )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
