"""The sequencer's node in this process, on a clock that the test sets, without threads."""

from __future__ import annotations

import json
from unittest import mock

import numpy as np
import rospy
from ros.fake_ros import FakePublisher, FakeRos, FakeService, deliver
from ros.own_messages import state_message
from std_srvs.srv import TriggerRequest, TriggerResponse

from quad_nav.geometry import Pose3D, quaternion_from_yaw
from quad_nav.ros.common.packed_messages import STATES_TOPIC, States, pose_row, states_message
from quad_nav.ros.sequencer.mission import MissionRunner
from quad_nav.ros.sequencer.robot_thread import RobotThread
from quad_nav.scenario.mission_setup import read_setup

TAKE_OFF = "/vehicles/take_off"
STARTS = ((0.0, 0.0), (0.0, 5.0))


class Mission:
    """The sequencer of two robots, each with the goals (10, y) and (20, y).

    Attributes:
        called: Names of the services that it has called.
        sent: (robot, x) of the goals that it has sent.
    """

    def __init__(self, ros, folder, goals=None, **parameters):
        self.ros, self._folder = ros, folder
        for k, (_, y_m) in enumerate(STARTS):
            listed = goals or [[10.0, y_m], [20.0, y_m]]
            content = {"goals": listed, "goal_timeout": 100, "retries": 0}
            (folder / f"quad{k}_goals.json").write_text(json.dumps(content))
        self._parameters = {
            "goals": str(folder),
            "simulation": False,
            "start_service": TAKE_OFF,
            "journal": str(folder / "journal.jsonl"),
            **parameters,
        }
        self.called, self.sent, self.runner = [], [], None
        for patch in (
            mock.patch.object(rospy, "ServiceProxy", self._proxy),
            mock.patch.object(RobotThread, "start"),  # `fly` does the steps
        ):
            patch.start()
            ros.exit_stack.callback(patch.stop)

    def _proxy(self, name, _):
        return lambda: self.called.append(name) or TriggerResponse(True, "")

    def begin(self, respawned=False, states=("flying", "flying"), **parameters):
        """Start a sequencer, in place of the one before, which was killed."""
        if self.runner is not None:
            journal = self.runner._record.journal
            journal.wait(patience_s=10.0)
            journal._journal.close()
        given = {**self._parameters, **parameters}
        setup = read_setup(given, "sequencer", self._folder / "result.json", self._folder)
        self.runner = MissionRunner(setup, respawned)
        for k in range(2):
            publisher = FakePublisher.all[f"/move_base_simple/goal{k}"]
            publisher.publish = lambda goal, k=k: self.sent.append((k, goal.pose.position.x))
        for k, state in enumerate(states if respawned or setup.resume else ()):
            deliver(f"/vehicle{k}/state", state_message(state))
        self.runner.start()
        return self

    def fly(self, now_s, *places):
        """Let the robots be somewhere at a time, and do a step of each."""
        self.ros.set_time(now_s)
        places = places or STARTS
        rows = [pose_row(Pose3D(x_m, y_m, 1.0, quaternion_from_yaw(0.0))) for x_m, y_m in places]
        twists = np.zeros((len(places), 6))
        deliver(
            STATES_TOPIC,
            states_message(States(now_s, "map", np.arange(len(places)), np.array(rows), twists)),
        )
        self.sent = []
        for thread in self.runner._threads:
            thread._step()
        return self.sent

    def summary(self):
        """Return the summary of the flight so far."""
        self.runner._watch_clock(rospy.get_time())
        return self.runner.summary("test")


def call(name, at_s):
    """Call a service of the sequencer at a time; it must succeed."""
    FakeRos.set_time(at_s)
    response = FakeService.all[name].handler(TriggerRequest())
    assert response.success, response.message


def stopped(ros):
    """Return the parameters that say what is stopped: the mission, quad0, quad1."""
    names = ("/mission", "/mission/quad0", "/mission/quad1")
    return [ros._parameters[f"{name}/stopped"] for name in names]
