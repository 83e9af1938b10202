"""Measure the processor time of the sequencer with many stub quadcopters.

    scripts/ros_env python3 bench/sequencer.py --robots 50 --seconds 20

The stubs publish their states at 40 Hz, the action's status at 5 Hz and one transform each, and fly
straight to each goal that they receive. States are one message for all, as those of the simulator;
with --odometry each stub has its own topic, as real quadcopters with C++ move_base have. The stubs
run in this process; the sequencer is a node of its own, under a roscore of its own. Its goals come
about every `LEG_M / SPEED_MPS` seconds.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, List, Optional

from figures import JSON_HELP, Figures
from launched import answers, free_port, wait_for

PERIOD_S, STATUS_TICKS = 1 / 40, 8
SPEED_MPS, LEG_M, SPACING_M = 1.0, 4.0, 3.0
START_S = 1.0
ROOT = Path(__file__).resolve().parents[1]


class Stub:
    """Odometry and action topics of one quadcopter that flies without dynamics."""

    def __init__(self, number: int, has_odometry: bool) -> None:
        import rospy
        from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
        from geometry_msgs.msg import PoseStamped
        from move_base_msgs.msg import MoveBaseActionResult
        from nav_msgs.msg import Odometry

        self._number, self.x_m, self.y_m = number, SPACING_M * number, 0.0
        self._goal: Optional[Any] = None
        self._id = self._status = None
        self._goals = 0
        self._make = GoalID, GoalStatus, GoalStatusArray, MoveBaseActionResult
        action = f"/move_base{number}"
        self._odometry = (
            rospy.Publisher(f"/odom{number}", Odometry, queue_size=10) if has_odometry else None
        )
        self._result = rospy.Publisher(f"{action}/result", MoveBaseActionResult, queue_size=10)
        self._statuses = rospy.Publisher(f"{action}/status", GoalStatusArray, queue_size=10)
        self._subscriber = rospy.Subscriber(
            f"/move_base_simple/goal{number}", PoseStamped, self._on_goal
        )
        self._message = Odometry()
        self._message.header.frame_id = f"odom{number}"
        self._message.child_frame_id = f"base_link{number}"
        self._message.pose.pose.orientation.w = 1.0

    def _on_goal(self, message: Any) -> None:
        self._goal = message

    def step(self, stamp: Any, tick: int) -> None:
        """Fly for one period and publish."""
        make_id, make_status, make_array, make_result = self._make
        goal, self._goal = self._goal, None
        if goal is not None:
            self._goals += 1
            name = f"/move_base{self._number}-{self._goals}-{stamp.to_sec()}"
            self._status = make_status(make_id(stamp, name), make_status.ACTIVE, "")
            self._to = goal.pose.position
        if self._status is not None and self._status.status == make_status.ACTIVE:
            dx_m, dy_m = self._to.x - self.x_m, self._to.y - self.y_m
            away_m = math.hypot(dx_m, dy_m)
            part = min(SPEED_MPS * PERIOD_S / max(away_m, 1e-9), 1.0)
            self.x_m, self.y_m = self.x_m + part * dx_m, self.y_m + part * dy_m
            if part == 1.0:
                self._status.status, self._status.text = make_status.SUCCEEDED, "Goal reached."
                self._result.publish(make_result(status=self._status))
        if self._odometry is not None:
            message = self._message
            message.header.stamp = stamp
            message.pose.pose.position.x, message.pose.pose.position.y = self.x_m, self.y_m
            self._odometry.publish(message)
        if tick % STATUS_TICKS == self._number % STATUS_TICKS:
            self._statuses.publish(make_array(status_list=[self._status] if self._status else []))


class States:
    """States of all stubs in one message."""

    def __init__(self, stubs: List[Stub]) -> None:
        import rospy
        from geometry_msgs.msg import Transform, Twist
        from sensor_msgs.msg import MultiDOFJointState

        self._stubs = stubs
        self._publisher = rospy.Publisher("/quad/states", MultiDOFJointState, queue_size=10)
        self._message = MultiDOFJointState()
        self._message.header.frame_id = "map"
        self._message.joint_names = [f"quad{number}" for number in range(len(stubs))]
        self._message.transforms = [Transform() for _ in stubs]
        self._message.twist = [Twist() for _ in stubs]

    def publish(self, stamp: Any) -> None:
        """Publish the present states."""
        self._message.header.stamp = stamp
        for stub, transform in zip(self._stubs, self._message.transforms):
            transform.translation.x, transform.translation.y = stub.x_m, stub.y_m
            transform.rotation.w = 1.0
        self._publisher.publish(self._message)


def goal_files(folder: Path, robots: int, seconds: float) -> None:
    legs = max(int(seconds * SPEED_MPS / LEG_M), 1)
    for number in range(robots):
        goals = [[SPACING_M * number, LEG_M * ((leg + 1) % 2)] for leg in range(legs)]
        (folder / f"quad{number}_goals.json").write_text(json.dumps({"goals": goals}))


def cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def fly(robots: int, has_odometry: bool, sequencer: subprocess.Popen) -> List[float]:
    """Publish until the sequencer ends; return its processor time at each second of flight."""
    import rospy
    from geometry_msgs.msg import TransformStamped
    from rosgraph_msgs.msg import Clock
    from std_srvs.srv import Trigger, TriggerResponse
    from tf2_msgs.msg import TFMessage

    rospy.init_node("stubs", disable_signals=True)
    clock = rospy.Publisher("/clock", Clock, queue_size=10, latch=True)
    transforms = rospy.Publisher("/tf", TFMessage, queue_size=10, latch=True)
    stubs = [Stub(number, has_odometry) for number in range(robots)]
    states = None if has_odometry else States(stubs)
    begun: List[bool] = []
    rospy.Service(
        "/simulation/start", Trigger, lambda _: begun.append(True) or TriggerResponse(True, "")
    )
    samples: List[float] = []
    tick, due_s = 0, time.monotonic()
    while sequencer.poll() is None:
        stamp = rospy.Time.from_sec(START_S + tick * PERIOD_S)
        clock.publish(Clock(stamp))
        if tick % 40 == 0:
            tf = [TransformStamped() for _ in range(robots)]
            for number, one in enumerate(tf):
                one.header.frame_id, one.child_frame_id = "map", f"odom{number}"
                one.header.stamp, one.transform.rotation.w = stamp, 1.0
            transforms.publish(TFMessage(tf))
            if begun:
                samples.append(cpu_s(sequencer.pid))
        for stub in stubs:
            stub.step(stamp, tick)
        if states is not None:
            states.publish(stamp)
        tick, due_s = tick + 1, due_s + PERIOD_S
        time.sleep(max(due_s - time.monotonic(), 0.0))
    return samples


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", type=int, default=50)
    parser.add_argument("--seconds", type=float, default=20.0, help="flight of each quadcopter")
    parser.add_argument("--json", type=Path, help=JSON_HELP)
    parser.add_argument("--odometry", action="store_true", help="states on topics of their own")
    given = parser.parse_args()
    folder, port = Path(tempfile.mkdtemp(prefix="quad_sequencer_")), free_port()
    goal_files(folder, given.robots, given.seconds)
    os.environ.update(
        ROS_MASTER_URI=f"http://localhost:{port}", ROS_HOSTNAME="localhost", ROS_HOME=str(folder)
    )
    log = (folder / "output.txt").open("w")
    core = subprocess.Popen(["rosmaster", "--core", "-p", str(port)], stdout=log, stderr=log)
    try:
        wait_for(lambda: answers(port), "the roscore")
        subprocess.run(["rosparam", "set", "/use_sim_time", "true"], check=True)
        names = {"robots": given.robots, "goals": folder, "exit_when_done": "true"}
        parameters = [f"_{name}:={value}" for name, value in names.items()]
        parameters += [f"_result:={folder}/result.json", f"_journal:={folder}/journal"]
        command = [sys.executable, str(ROOT / "nodes" / "sequencer"), *parameters]
        sequencer = subprocess.Popen(command, stdout=log, stderr=log)
        samples = fly(given.robots, given.odometry, sequencer)
    finally:
        core.send_signal(signal.SIGINT)
        core.wait(20)
    summary = json.loads((folder / "result.json").read_text())
    print(
        f"{given.robots} robots, success {summary['success']}, {summary['sim_time_s']:.1f} s: "
        f"{samples[-1] - samples[0]:.2f} s of processor time in {len(samples) - 1} s, "
        f"logs in {folder}"
    )
    figures = Figures(f"sequencer {given.robots}")
    used_ms = [1e3 * (after - before) for before, after in zip(samples, samples[1:])]
    figures.add("CPU in each second", "ms", used_ms)
    figures.write(given.json)
    sys.stdout.flush()
    os._exit(0 if summary["success"] else 1)  # rospy's threads wait for the dead master


if __name__ == "__main__":
    sys.exit(main())
