"""Node `simulator`: owns the bodies and the clock.

Callbacks store messages; one loop advances the simulation and publishes. Simulated time starts at
1 s, because rospy treats a time of 0 as a clock that has not started. It never decreases, not even
at a reset.
"""

from __future__ import annotations

import collections
import os
import signal
import sys
import time
import traceback
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError
from functools import partial
from typing import Any, Callable, Deque, List, Optional, Tuple

import rospy
from std_srvs.srv import (
    SetBool,
    SetBoolRequest,
    SetBoolResponse,
    Trigger,
    TriggerRequest,
    TriggerResponse,
)
from visualization_msgs.msg import Marker, MarkerArray

from quad_nav.errors import InputError, printable
from quad_nav.files.kernel_cache import COMPILING, announced, cache_warnings
from quad_nav.files.values import is_number
from quad_nav.parameter import Parameter
from quad_nav.ros.common.conversions import time_message
from quad_nav.ros.common.readiness import server_parameters, start_node
from quad_nav.ros.common.rospy_repairs import refuse_second, set_time
from quad_nav.ros.composed.fleet import ComposedFleet
from quad_nav.ros.composed.own_nodes import OwnNodes, hear_others_only
from quad_nav.ros.navigator.nodes import log_invalid, prepare
from quad_nav.ros.navigator.reconfigure import ParameterServer, config_type
from quad_nav.ros.simulator.commands import Commands
from quad_nav.ros.simulator.topics import SimulatorTopics
from quad_nav.scenario.rules import SIMULATOR
from quad_nav.scenario.simulator_setup import (
    DEFAULTS,
    SimulatorSetup,
    asked_for_by_navigators,
    read_setup,
)
from quad_nav.scenario.warm_up import simulate
from quad_nav.sim.body import GoalSphere
from quad_nav.sim.pacing import Pacer, RateMeter
from quad_nav.sim.simulation_params import (
    FASTEST_RATE,
    STEP_S,
    STEPS_PER_ODOMETRY,
    STEPS_PER_S,
)
from quad_nav.topics.validation import MAX_MAGNITUDE

_START_STEP = STEPS_PER_S
_HEALTH_PERIOD_S = 1.0  # wall time, as the next two
_PAUSED_PERIOD_S = 0.5
_PAUSED_SLEEP_S = 0.02
_MAX_SLEEP_S = 0.1  # at a low rate, to answer requests
_RESPONSE_TIMEOUT_S = 10.0
_MAX_MARKERS = 10_000


class SimulatorNode:
    """Topics and services of one simulation, with the navigators that share its process."""

    def __init__(self, setup: SimulatorSetup, own: OwnNodes) -> None:
        """Start the navigators' processes and advertise topics and services.

        Args:
            setup: The simulation.
            own: Gets the names of the processes' nodes.
        """
        self._setup = setup
        self._fleet = ComposedFleet(setup, _START_STEP, own)
        self._loop = self._fleet.loop
        self._simulation = self._loop.simulation
        others = [i for i in range(setup.robots) if i not in self._fleet.hosted]
        self._topics = SimulatorTopics(
            self._simulation, setup.map_resolution_m, setup.localization == SIMULATOR, others
        )
        self._commands = Commands(self._simulation)
        self._meter = RateMeter()
        self._set_rate(setup.rate)
        self._paused, self._stopping = True, False
        self._next_health_s = self._next_republish_s = 0.0
        self._requests: Deque[Tuple[Callable[[], str], Future]] = collections.deque()
        self._goals, self._goals_are_shown = MarkerArray(), True
        if setup.gui:
            rospy.Subscriber("/goals", MarkerArray, self._store_goals, queue_size=1)
        self._loop.start()
        self._advertise_services()

    def run(self) -> None:
        """Run until `stop` is called, ROS shuts down or the window is closed."""
        self._publish_all()
        self._navigate()
        if not self._setup.start_paused:
            self._start()
        while not (self._stopping or rospy.is_shutdown()) and self._simulation.is_open:
            self._handle_requests()
            self._show_goals()
            self._report()
            if self._paused:
                self._wait_paused()
            else:
                self._advance()

    def close(self) -> None:
        """End the navigators' processes."""
        self._loop.close()

    def stop(self) -> None:
        """End `run` after the present step."""
        self._stopping = True

    def _advertise_services(self) -> None:
        """Advertise what starts the simulation last: then everything else is there."""
        rospy.set_param("~rate", self._rate)
        type_ = config_type("Simulator", [_rate_parameter(self._rate)])
        self._parameters = ParameterServer(type_, self._reconfigure, "~", {"rate": self._rate})
        for i in range(self._setup.robots):
            rospy.Service(f"/simulation/lidar{i}/enable", SetBool, partial(self._enable_lidar, i))
        for name, action in (
            ("reset", self._reset),
            ("pause", self._pause),
            ("start", self._start),
        ):
            rospy.Service(f"/simulation/{name}", Trigger, partial(self._trigger, action))

    # Callbacks, in threads of their own.

    def _store_goals(self, message: MarkerArray) -> None:
        self._goals, self._goals_are_shown = message, False

    def _in_loop(self, action: Callable[[], str]) -> Optional[str]:
        """Let the loop carry out an action; return its text, None if it does not respond."""
        done: Future = Future()
        self._requests.append((action, done))
        try:
            text: str = done.result(_RESPONSE_TIMEOUT_S)
        except FutureTimeoutError:
            return None
        return text

    def _trigger(self, action: Callable[[], str], _: TriggerRequest) -> TriggerResponse:
        text = self._in_loop(action)
        late = f"the simulator did not respond within {_RESPONSE_TIMEOUT_S:g} s"
        return TriggerResponse(text is not None, late if text is None else text)

    def _reconfigure(self, requested: Any, _level: int) -> Any:
        """Let the loop take another rate, and return the values in force."""
        rate = requested["rate"]
        if rate != self._rate and is_number(rate) and rate > 0.0:
            if self._in_loop(partial(self._set_rate, rate)) is None:
                rospy.logerr("simulator: rate not changed: the loop did not respond")
        requested["rate"] = self._rate
        return requested

    def _enable_lidar(self, robot: int, request: SetBoolRequest) -> SetBoolResponse:
        self._topics.lidar_enabled[robot] = request.data
        self._loop.enable_lidar(robot, request.data)
        return SetBoolResponse(True, f"LIDAR {robot} is {'on' if request.data else 'off'}")

    # The loop.

    def _handle_requests(self) -> None:
        while self._requests:
            action, done = self._requests.popleft()
            done.set_result(action())

    def _start(self) -> str:
        if self._paused:
            self._paused = False
            self._pacer.start(time.monotonic())
            self._meter.start(time.monotonic(), self._simulation.now_s)
            self._next_health_s = time.monotonic() + _HEALTH_PERIOD_S
            rospy.loginfo("simulator: running")
        return "the simulation is running"

    def _set_rate(self, rate: float) -> str:
        """Set the simulated seconds per second."""
        self._rate = rate
        self._pacer = Pacer(rate, STEP_S)
        self._pacer.start(time.monotonic())
        return f"the rate is {rate:g}"

    def _pause(self) -> str:
        if not self._paused:
            self._paused = True
            self._publish_clock()
            rospy.loginfo("simulator: paused at %.2f s", self._simulation.now_s)
        return "the simulation is paused"

    def _reset(self) -> str:
        """Reset all poses; one step gives the new poses another stamp."""
        self._loop.reset()
        self._loop.advance(1)
        self._commands.clear()
        self._goals_are_shown = False
        self._topics.publish_reset()
        self._publish_all()
        rospy.loginfo("simulator: reset")
        return "the quadcopters are at their start poses; the clock continues"

    def _advance(self) -> None:
        """Do the steps that are due, then sleep until the clock's next tick."""
        end = self._simulation.step_count + self._pacer.pop_due(time.monotonic())
        while self._simulation.step_count < end:
            self._commands.take()
            self._step(min(end - self._simulation.step_count, self._steps_to_clock()))
        wait_s = self._pacer.wait_s(time.monotonic(), self._steps_to_clock())
        time.sleep(min(wait_s, _MAX_SLEEP_S))

    def _steps_to_clock(self) -> int:
        """Return the number of steps until clock, poses and states are published."""
        return STEPS_PER_ODOMETRY - self._simulation.step_count % STEPS_PER_ODOMETRY

    def _step(self, steps: int) -> None:
        """Do at most so many steps, up to the next scan or odometry, and publish."""
        progress = self._loop.advance(steps)
        for contact in progress.contacts:
            self._topics.publish_contact(contact)
        count = self._simulation.step_count
        if progress.is_odometry:
            self._publish_clock()
            self._topics.publish_poses()
        if count % self._setup.steps_per_scan == 0:
            self._topics.publish_scans()
        if progress.is_odometry:
            self._navigate()

    def _navigate(self) -> None:
        for command in self._fleet.navigate():
            self._commands.give(*command)

    def _wait_paused(self) -> None:
        """Republish the state for new subscribers, except tf, which they get."""
        if time.monotonic() >= self._next_republish_s:
            self._next_republish_s = time.monotonic() + _PAUSED_PERIOD_S
            self._publish_clock()
            self._topics.publish_poses(with_transforms=False)
            self._topics.publish_scans()
        time.sleep(_PAUSED_SLEEP_S)

    def _publish_clock(self) -> None:
        set_time(time_message(self._simulation.now_s))
        self._topics.publish_clock()

    def _publish_all(self) -> None:
        self._publish_clock()
        self._topics.publish_poses()
        self._topics.publish_scans()

    def _report(self) -> None:
        now_s = time.monotonic()
        if now_s >= self._next_health_s:
            self._next_health_s = now_s + _HEALTH_PERIOD_S
            factor = self._meter.read(now_s, self._simulation.now_s)
            self._topics.publish_health(self._paused, self._rate, factor)

    def _show_goals(self) -> None:
        if not self._goals_are_shown:
            self._goals_are_shown = True
            self._simulation.show_goals(_goal_spheres(self._goals))


def _rate_parameter(rate: float) -> Parameter:
    """Describe the rate; the range includes the present one, which the server would clamp."""
    return Parameter(
        "rate",
        "double",
        1.0,
        description=f"Simulated seconds per second; {FASTEST_RATE:g} is as fast as it goes.",
        low=min(0.01, rate),
        high=max(FASTEST_RATE, rate),
    )


def _goal_spheres(message: MarkerArray) -> List[GoalSphere]:
    """Return the valid spheres among markers in `map`: centre, radius and colour."""
    spheres = [
        (
            (m.pose.position.x, m.pose.position.y, m.pose.position.z),
            m.scale.x / 2,
            (m.color.r, m.color.g, m.color.b, m.color.a),
        )
        for m in message.markers[:_MAX_MARKERS]
        if m.type == Marker.SPHERE and m.action == Marker.ADD
    ]
    valid = [
        one
        for one in spheres
        if all(abs(value) <= MAX_MAGNITUDE for value in (*one[0], *one[2])) and 0.0 < one[1] <= 1e3
    ]
    if len(valid) < len(spheres):
        rospy.logwarn_throttle(
            5.0,
            "simulator: /goals: markers dropped: %d of %d have an invalid position, size or colour",
            len(spheres) - len(valid),
            len(spheres),
        )
    return valid


def main() -> int:
    """Run the node.

    rospy's own signal handler closes the publishers in the thread that it interrupts. It deadlocks
    if this thread is publishing.

    Returns:
        0 after a shutdown, 2 if the parameters or the scene are not valid.
    """
    own = OwnNodes()
    hear_others_only(own)
    refuse_second("simulator", is_simulator=True)
    try:
        start_node("simulator", hears_clock=False)
        name = rospy.get_name().lstrip("/")
        setup = _read_setup(name)
    except InputError as error:
        print(printable(error, "\n"), file=sys.stderr)
        return 2
    for remark in (*setup.scene.remarks, *cache_warnings()):
        rospy.logwarn("%s", remark)
    if not rospy.get_param("/use_sim_time", False):
        rospy.logwarn(
            "simulator: /use_sim_time is not set, expected true before other nodes start; they"
            " use the wall clock"
        )
    try:
        with announced(lambda: rospy.loginfo("%s", COMPILING)):
            simulate()
        prepare(setup.configurations.values())
        node = SimulatorNode(setup, own)
    except InputError as error:
        log_invalid(name, error)
        return 2
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: node.stop())
    _run(node)
    node.close()
    rospy.signal_shutdown("the simulation is closed")
    return 0


def _read_setup(name: str) -> SimulatorSetup:
    parameters, tree = rospy.get_param("~", {}), server_parameters()
    if not parameters.get("config"):
        robots = parameters.get("robots", DEFAULTS["robots"])
        parameters = {**asked_for_by_navigators(tree, robots), **parameters}
    return read_setup(parameters, name, tree)


def _run(node: SimulatorNode) -> None:
    try:
        node.run()
    except BaseException as error:
        if isinstance(error, rospy.ROSException) and rospy.core.is_shutdown_requested():
            return  # `rosnode kill` closes the topics while the loop publishes
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)  # keeps the services: by them the sequencer knows a dead simulator
