"""A navigator that runs for a transcript: its ROS master, its node and its world."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import tempfile
import threading
import time
from pathlib import Path
from typing import Any, Dict, List, Sequence

import dynamic_reconfigure.client
import rosgraph
import rospy
import yaml
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from move_base_msgs.msg import MoveBaseActionGoal
from transcript_world import World, WorldTopics, pose_from_yaw

NODE = "/move_base0"
_ROBOT = "0"
_LAUNCH = Path(__file__).resolve().with_name("transcript.launch")
_STARTS_WITHIN_S = 60.0
_STEP_S = 0.01


class NotStarted(Exception):
    """The navigator did not come up."""


class Session:
    """One navigator in its world; the clock runs as long as the session is open."""

    def __init__(self, nav: str, world: Dict[str, Any], params: Dict[str, Any]) -> None:
        """Prepare it; ``nav`` is the package of the node."""
        self._nav, self._world = nav, World(**world)
        self._params = params
        self._ended = threading.Event()
        self._clock = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Session:
        """Start it, and wait until the node answers."""
        with socket.socket() as free:
            free.bind(("localhost", 0))
            port = free.getsockname()[1]
        os.environ.update(ROS_MASTER_URI=f"http://localhost:{port}", ROS_HOSTNAME="localhost")
        with tempfile.NamedTemporaryFile("w", suffix=".yaml", delete=False) as file:
            file.write(self.named(yaml.safe_dump(self._params)))
        self._file = Path(file.name)
        arguments = [f"nav:={self._nav}", f"params:={file.name}"]
        self._launch = subprocess.Popen(
            ["roslaunch", "-p", str(port), str(_LAUNCH), *arguments], start_new_session=True
        )
        try:
            self._wait_until(rosgraph.is_master_online, "a ROS master")
            rospy.init_node("transcript", disable_signals=True)
            self._topics = WorldTopics(self._world, _ROBOT)
            self._statuses: List[int] = []
            rospy.Subscriber("/move_base/status", GoalStatusArray, self._note_status)
            self._goals = rospy.Publisher("/move_base/goal", MoveBaseActionGoal, queue_size=5)
            self._cancels = rospy.Publisher("/move_base/cancel", GoalID, queue_size=5)
            self._clock.start()
            self._wait_until(self._is_up, f"the service {NODE}/make_plan")
        except BaseException:
            self.__exit__()
            raise
        self.wait(3.0)  # both costmaps have seen the world
        return self

    def __exit__(self, *_: Any) -> None:
        """End the node and the master."""
        self._ended.set()
        if self._clock.is_alive():
            self._clock.join()
        rospy.signal_shutdown("the transcript is written")
        self._launch.send_signal(signal.SIGINT)
        self._launch.wait()
        self._file.unlink()

    def _is_up(self) -> bool:
        try:
            rospy.wait_for_service(f"{NODE}/make_plan", 0.5)
        except rospy.ROSException:
            return False
        return True

    def _wait_until(self, condition: Any, what: str) -> None:
        end_s = time.monotonic() + _STARTS_WITHIN_S
        while not condition():
            if time.monotonic() > end_s or self._launch.poll() is not None:
                raise NotStarted(f"there is no {what}")
            time.sleep(0.05)

    def _run(self) -> None:
        next_s = time.monotonic()
        while not self._ended.is_set():
            self._world.step(_STEP_S)
            self._topics.publish()
            next_s = max(next_s + _STEP_S, time.monotonic() - 1.0)
            time.sleep(max(0.0, next_s - time.monotonic()))

    # -- for the families ----------------------------------------------------------------

    def now(self) -> rospy.Time:
        """Simulated time."""
        return rospy.Time.from_sec(self._world.now_s)

    def wait(self, seconds: float) -> None:
        """Let simulated time pass."""
        end_s = self._world.now_s + seconds
        while self._world.now_s < end_s:
            time.sleep(_STEP_S / 2)

    def send_goal(self, place: Sequence[Any]) -> None:
        """Send a goal, and wait until it is active."""
        goal = MoveBaseActionGoal()
        x, y, turn, frame = place
        goal.goal.target_pose.pose = pose_from_yaw(x, y, turn)
        goal.goal.target_pose.header.frame_id = self.named(frame)
        goal.goal.target_pose.header.stamp = goal.header.stamp = self.now()
        self._goals.publish(goal)
        self._wait_until(lambda: GoalStatus.ACTIVE in self._statuses, "active goal")

    def cancel(self, seconds: float) -> None:
        """Cancel all goals, and wait."""
        self._cancels.publish(GoalID())
        self.wait(seconds)

    def _note_status(self, message: GoalStatusArray) -> None:
        self._statuses = [one.status for one in message.status_list]

    def mark(self, lines: List[List[float]]) -> None:
        """Add marks to the world, and wait until the costmaps have them."""
        self._world.marks = [*self._world.marks, *lines]
        self.wait(1.0)

    def reconfigure(self, changes: Dict[str, Any]) -> None:
        """Change parameters of the node, or of a namespace below it."""
        for name, value in changes.items():
            namespace, _, name = name.rpartition("/")
            client = dynamic_reconfigure.client.Client(self.name(f"~{namespace}").rstrip("/"), 5.0)
            client.update_configuration({name: value})
            client.close()

    def name(self, relative: str) -> str:
        """Whole name of a topic or service; '~' is the node's namespace."""
        return self.named(relative.replace("~", f"{NODE}/", 1))

    def named(self, text: str) -> str:
        """A text of a session with the number of the robot."""
        return text.replace("@", _ROBOT)

    def anonymous(self, text: str) -> str:
        """A text of the navigator, without the number of the robot."""
        for name in (NODE, f"odom{_ROBOT}", f"base_link{_ROBOT}"):
            text = text.replace(name, f"{name[:-1]}@")
        return text
