"""Node `simulator`: owns the bodies and the clock.

Callbacks store messages; one loop advances the simulation and publishes. Simulated time starts at
1 s, because rospy treats a time of 0 as a clock that has not started. It never decreases, not even
at a reset.
"""

from __future__ import annotations

import collections
import functools
import os
import signal
import sys
import time
import traceback
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError
from typing import Callable, Deque, List, Tuple

import rospy
from geometry_msgs.msg import Twist
from std_srvs.srv import (
    SetBool,
    SetBoolRequest,
    SetBoolResponse,
    Trigger,
    TriggerRequest,
    TriggerResponse,
)
from visualization_msgs.msg import Marker, MarkerArray

from quad_nav.errors import InputError, excerpt, printable
from quad_nav.kernels.jit import cache_warnings
from quad_nav.ros.common.conversions import twist_from_message
from quad_nav.ros.common.readiness import (
    escape_log_messages,
    log_without_master,
    server_parameters,
)
from quad_nav.ros.simulator.topics import SimulatorTopics
from quad_nav.scenario.simulator_setup import (
    DEFAULTS,
    SimulatorSetup,
    asked_for_by_navigators,
    read_setup,
)
from quad_nav.sim.body import GoalSphere
from quad_nav.sim.pacing import Pacer, RateMeter
from quad_nav.sim.simulation import STEP_S, STEPS_PER_S, Simulation
from quad_nav.topics.validation import MAX_MAGNITUDE, CommandLease, twist_problem

_STEPS_PER_ODOMETRY = STEPS_PER_S // 40
_STEPS_PER_CLOCK = STEPS_PER_S // 120
_START_STEP = STEPS_PER_S
_COMMANDS_PER_ROBOT = 20
_HEALTH_PERIOD_S = 1.0  # wall time, as the next two
_PAUSED_PERIOD_S = 0.5
_PAUSED_SLEEP_S = 0.02
_RESPONSE_TIMEOUT_S = 10.0
_MAX_MARKERS = 10_000


class SimulatorNode:
    """Topics and services of one simulation."""

    def __init__(self, setup: SimulatorSetup) -> None:
        self._setup = setup
        self._simulation = Simulation(
            setup.scene, setup.robots, setup.params, setup.seed, setup.gui, _START_STEP
        )
        self._topics = SimulatorTopics(self._simulation, setup.map_resolution_m)
        self._pacer = Pacer(setup.rate, STEP_S)
        self._meter = RateMeter()
        # Faster than real time, the clock is published with the odometry, which is often enough.
        self._steps_per_clock = _STEPS_PER_CLOCK if setup.rate <= 1.0 else _STEPS_PER_ODOMETRY
        self._paused, self._stopping = True, False
        self._next_health_s = self._next_republish_s = 0.0
        # Bounds the cost of a node that floods a topic.
        self._commands: Deque[Tuple[int, Twist]] = collections.deque(
            maxlen=_COMMANDS_PER_ROBOT * setup.robots
        )
        self._lease = CommandLease(
            setup.params.command_timeout_s + setup.params.controller_period_s
        )
        self._requests: Deque[Tuple[Callable[[], str], Future]] = collections.deque()
        self._goals, self._goals_are_shown = MarkerArray(), True
        self._subscribe()
        self._advertise_services()

    def run(self) -> None:
        """Run until `stop` is called, ROS shuts down or the window is closed."""
        self._publish_all()
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
        self._simulation.close()

    def stop(self) -> None:
        """End `run` after the present step."""
        self._stopping = True

    def _subscribe(self) -> None:
        for i in range(self._setup.robots):
            rospy.Subscriber(
                f"/cmd_vel{i}",
                Twist,
                functools.partial(self._store_command, i),
                queue_size=10,
                tcp_nodelay=True,
            )
        if self._setup.gui:
            rospy.Subscriber("/goals", MarkerArray, self._store_goals, queue_size=1)

    def _advertise_services(self) -> None:
        for name, action in (
            ("start", self._start),
            ("pause", self._pause),
            ("reset", self._reset),
        ):
            rospy.Service(f"/simulation/{name}", Trigger, self._trigger_handler(action))
        for i in range(self._setup.robots):
            rospy.Service(
                f"/simulation/lidar{i}/enable", SetBool, functools.partial(self._enable_lidar, i)
            )

    # Callbacks, in threads of their own.

    def _store_command(self, robot: int, message: Twist) -> None:
        self._commands.append((robot, message))

    def _store_goals(self, message: MarkerArray) -> None:
        self._goals, self._goals_are_shown = message, False

    def _trigger_handler(self, action: Callable[[], str]) -> Callable:
        """Return a service handler that responds after the loop has carried out the action."""

        def handle(_: TriggerRequest) -> TriggerResponse:
            done: Future = Future()
            self._requests.append((action, done))
            try:
                return TriggerResponse(True, done.result(_RESPONSE_TIMEOUT_S))
            except FutureTimeoutError:
                return TriggerResponse(
                    False, f"the simulator did not respond within {_RESPONSE_TIMEOUT_S:g} s"
                )

        return handle

    def _enable_lidar(self, robot: int, request: SetBoolRequest) -> SetBoolResponse:
        self._topics.lidar_enabled[robot] = request.data
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

    def _pause(self) -> str:
        if not self._paused:
            self._paused = True
            self._topics.publish_clock()
            rospy.loginfo("simulator: paused at %.2f s", self._simulation.now_s)
        return "the simulation is paused"

    def _reset(self) -> str:
        """Reset all poses; one step gives the new poses another stamp."""
        self._simulation.reset()
        self._simulation.step()
        self._commands.clear()
        self._lease.clear()
        self._goals_are_shown = False
        self._topics.publish_reset()
        self._publish_all()
        rospy.loginfo("simulator: reset")
        return "the quadcopters are at their start poses; the clock continues"

    def _advance(self) -> None:
        """Do the steps that are due, then sleep until the clock's next tick."""
        for _ in range(self._pacer.pop_due(time.monotonic())):
            self._step()
        steps = self._steps_per_clock - self._simulation.step_count % self._steps_per_clock
        time.sleep(self._pacer.wait_s(time.monotonic(), steps))

    def _step(self) -> None:
        self._take_commands()
        for contact in self._simulation.step():
            self._topics.publish_contact(contact)
        count = self._simulation.step_count
        if count % self._steps_per_clock == 0:
            self._topics.publish_clock()
        if count % _STEPS_PER_ODOMETRY == 0:
            self._topics.publish_poses()
        if count % self._setup.steps_per_scan == 0:
            self._topics.publish_scans()

    def _take_commands(self) -> None:
        while self._commands:
            robot, message = self._commands.popleft()
            twist = twist_from_message(message)
            problem = twist_problem(twist)
            if problem:
                rospy.logwarn_throttle(5.0, "quad%d: command dropped: %s", robot, problem)
                continue
            node = excerpt(message._connection_header.get("callerid", "an unnamed node"))
            holder = self._lease.holder(robot, node, self._simulation.now_s)
            if holder == node:
                self._simulation.set_command(robot, twist)
            else:
                rospy.logwarn_throttle(
                    5.0,
                    "quad%d: command of %s dropped: %s controls this quadcopter, expected one node"
                    " at a time",
                    robot,
                    node,
                    holder,
                )

    def _wait_paused(self) -> None:
        """Republish the state for new subscribers, except tf, which is latched."""
        if time.monotonic() >= self._next_republish_s:
            self._next_republish_s = time.monotonic() + _PAUSED_PERIOD_S
            self._topics.publish_clock()
            self._topics.publish_poses(with_transforms=False)
            self._topics.publish_scans()
        time.sleep(_PAUSED_SLEEP_S)

    def _publish_all(self) -> None:
        self._topics.publish_clock()
        self._topics.publish_poses()
        self._topics.publish_scans()

    def _report(self) -> None:
        now_s = time.monotonic()
        if now_s >= self._next_health_s:
            self._next_health_s = now_s + _HEALTH_PERIOD_S
            factor = self._meter.read(now_s, self._simulation.now_s)
            self._topics.publish_health(self._paused, self._setup.rate, factor)

    def _show_goals(self) -> None:
        if not self._goals_are_shown:
            self._goals_are_shown = True
            self._simulation.show_goals(_goal_spheres(self._goals))


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
    rospy.init_node("simulator", disable_signals=True)
    escape_log_messages()
    log_without_master()
    name = rospy.get_name().lstrip("/")
    try:
        parameters = rospy.get_param("~", {})
        if not parameters.get("config"):
            robots = parameters.get("robots", DEFAULTS["robots"])
            asked_for = asked_for_by_navigators(server_parameters(), robots)
            parameters = {**asked_for, **parameters}
        setup = read_setup(parameters, name)
        node = SimulatorNode(setup)
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
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: node.stop())
    _run(node)
    return 0


def _run(node: SimulatorNode) -> None:
    try:
        node.run()
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)  # keeps the services: by them the sequencer knows a dead simulator
    rospy.signal_shutdown("the simulation is closed")
