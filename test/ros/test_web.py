#!/usr/bin/env python3
"""The node web: what a page receives of a flight, and what comes of what people do."""

import contextlib
import json
import os
import shutil
import signal
import threading
import time
from pathlib import Path

import rospy
import rostest
from flight_case import PATIENCE_S, FlightCase, pid_of
from quad.msg import MovingObstacle, MovingObstacles
from quad.msg import RightOfWay as RightOfWayMessage
from std_msgs.msg import Header
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.sync.client import connect

from quad_nav.geometry import Pose2D
from quad_nav.topics.right_of_way import Kind, RightOfWay
from quad_web.ros.actions import FlightActions
from quad_web.ros.source import FlightSource
from quad_web.view.actions import GoalChange
from quad_web.view.codec import decode
from quad_web.view.state import LAYERS, FleetState, Wanted

PLANNER = "TrajectoryPlannerROS"


class Page:
    """A page without a browser: the newest of each item that the node web has sent."""

    def __init__(self, port):
        self.items, self.arrays = {}, {}
        origin = f"http://127.0.0.1:{port}"
        self._open = contextlib.ExitStack()
        self._socket = self._open.enter_context(
            connect(f"ws://127.0.0.1:{port}/stream", origin=origin, max_size=None)
        )
        self._socket.send(json.dumps({"want": {"layers": list(LAYERS), "robot": 0}}))
        threading.Thread(target=self._receive, daemon=True).start()

    def _receive(self):
        with contextlib.suppress(ConnectionClosed):
            self._receive_all()

    def _receive_all(self):
        for message in self._socket:
            header, arrays = decode(message)
            for item in header["items"]:
                self.arrays[item["key"]] = arrays[item["key"]]
                self.items[item["key"]] = item["data"]
            for key in header["removed"]:
                self.items.pop(key, None)
            self._socket.send(json.dumps({"ack": header["seq"]}))

    def close(self):
        self._open.close()

    def row(self, robot):
        rows = (self.items.get("status") or {}).get("rows", ())
        return next((row for row in rows if row["robot"] == robot), {})

    def goals(self, robot):
        goals = (self.items.get("goals") or {}).get("goals", ())
        return [goal for goal in goals if goal["robot"] == robot]


def page_of_the_node():
    end_s = time.monotonic() + PATIENCE_S
    while True:
        try:
            return Page(rospy.get_param("/web/port"))
        except (OSError, KeyError, WebSocketException):  # it starts
            if time.monotonic() > end_s:
                raise
            time.sleep(0.1)


class Web(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.folder = Path(rospy.get_param("/sequencer/goals"))
        cls.start()
        state = FleetState()
        state.add_client(Wanted(frozenset(LAYERS), 0))
        source = FlightSource(state, 2, "test")
        cls.actions, cls.health = FlightActions(source, 2, cls.folder), source.health
        source.start()
        cls.page = page_of_the_node()
        cls.wait(lambda: cls.page.row(1).get("goal"), "the missions' progress")

    @classmethod
    def tearDownClass(cls):
        cls.page.close()
        shutil.rmtree(cls.folder)

    def do(self, name, *arguments):
        answer = self.actions.call(name, *arguments)
        self.assertTrue(answer.ok, answer.text)
        return answer.text

    def refuse(self, name, *arguments):
        answer = self.actions.call(name, *arguments)
        self.assertFalse(answer.ok, answer.text)
        return answer.text

    def flight(self, key):
        return self.page.items["flight"][key]

    def test_1_a_page_receives_the_flight(self):
        page = self.page
        layers = {
            f"{layer}/{i}" for layer in ("scan", "plan", "local_plan", "cell") for i in (0, 1)
        }
        layers |= {"trail/0", "global_costmap/0", "local_costmap/0"}
        always = {"flight", "scene", "robots", "poses", "status", "goals", "samples", "diagnostics"}
        self.wait(lambda: layers | always <= page.items.keys(), lambda: f"{sorted(page.items)}")
        self.assertNotIn("global_costmap/1", page.items)
        self.wait(
            lambda: self.distance(0, *page.arrays["poses"]["pose"][0, :2]) < 0.5,
            "robot 0 where its odometry is",
        )
        self.assertEqual(page.arrays["global_costmap/0"]["costs"].shape, (240, 240))
        self.assertEqual(page.arrays["scan/0"]["points"].shape[1], 3)
        self.wait(lambda: page.goals(1)[0]["state"] == "active", "the first goal of a round")
        self.assertEqual(len(page.items["scene"]["walls"]), 4)

    def test_2_a_robot_that_makes_room_is_shown_with_its_holding_point(self):
        topic = rospy.Publisher("/move_base0/right_of_way", RightOfWayMessage, queue_size=1)
        self.addCleanup(topic.unregister)
        self.wait(lambda: topic.get_num_connections() > 0, "a subscriber")
        makes_room = RightOfWay(Kind.MAKES_ROOM, "quad1", (2.5, 3.5))
        row = {"robot": 0, "peer": 1, "kind": "makes room", "hold": [2.5, 3.5]}

        def is_shown():  # the navigator publishes on the topic, too
            topic.publish(RightOfWayMessage(**makes_room.fields))
            return (self.page.items.get("yields") or {}).get("yields") == [row]

        self.wait(is_shown, lambda: f"{self.page.items.get('yields')}")
        topic.publish(RightOfWayMessage(**RightOfWay().fields))

    def test_3_pause_start_and_rate(self):
        self.assertIn("paused", self.do("pause"))
        self.wait(lambda: self.flight("state") == "paused", "a pause")
        self.do("start")
        self.wait(lambda: self.flight("state") == "running", "a flight")
        self.assertIn("3", self.do("set_rate", 3.0))
        self.wait(lambda: self.flight("wanted_rate") == 3.0, "the rate")
        self.do("set_rate", 2.0)
        self.assertIn("expected", self.refuse("set_rate", -1.0))

    def test_4_parameters_lidar_and_costmaps(self):
        for robot in (0, 1):  # in the simulator's process, and in one of its own
            with self.subTest(robot=robot):
                self.change_parameters(robot)
        self.do("enable_lidar", 1, False)
        self.wait(lambda: self.page.row(1)["lidar"] is False, "a LIDAR that is off")
        self.wait(lambda: "scan/1" not in self.page.items, "no scan")
        self.do("enable_lidar", 1, True)
        self.wait(lambda: self.page.row(1)["lidar"] and "scan/1" in self.page.items, "a scan again")
        self.assertIn("cleared", self.do("clear_costmaps", 1))

    def parameter(self, robot, namespace, name):
        views = []
        self.wait(lambda: views.extend(self.actions.parameters(robot)) or views, "parameters")
        return next(one for one in views if (one.namespace, one.name) == (namespace, name))

    def change_parameters(self, robot):
        before = self.parameter(robot, PLANNER, "max_vel_x")
        self.assertEqual((before.kind, before.minimum), ("double", 0.0))
        self.assertIn("velocity", before.doc)
        self.do("set_parameters", robot, PLANNER, {"max_vel_x": 0.25})
        after = self.parameter(robot, PLANNER, "max_vel_x")
        self.assertEqual((after.value, after.file_value), (0.25, before.file_value))
        self.do("set_parameters", robot, PLANNER, {"max_vel_x": before.file_value})
        text = self.refuse("set_parameters", robot, PLANNER, {"max_vel_x": "fast"})
        self.assertIn("expected a finite number", text)
        text = self.refuse("set_parameters", robot, PLANNER, {"max_vel_x": -1.0})
        self.assertIn("expected at least 0", text)
        self.assertEqual(self.parameter(robot, PLANNER, "max_vel_x").value, before.value)
        self.assertIn(
            "is not a parameter", self.refuse("set_parameters", robot, "", {"nothing": 1})
        )
        choice = self.parameter(robot, "local_costmap/obstacle_layer", "combination_method")
        self.assertIn(("Maximum", 1), choice.choices)

    def test_5_stop_all_send_a_goal_and_resume(self):
        self.wait(lambda: min(self.speed(0), self.speed(1)) > 0.2, "both flying")
        self.do("stop_all")
        self.assertIn("resumed", self.do("start"))  # before the diagnostics tell of a stop
        self.assertIn("every quadcopter hovers", self.do("stop_all"))
        self.wait(lambda: max(self.speed(0), self.speed(1)) < 0.05, "both hovering")
        self.wait(lambda: self.flight("state") == "stopped", "a stopped flight")
        self.wait(lambda: self.page.row(0)["state"] == "stopped", "the state")
        x, y = self.position(0)
        to = x, y + (1.2 if y < 5.0 else -1.2)
        self.assertIn("quad0: goal", self.do("send_goal", None, Pose2D(*to, 0.0)))
        self.wait(lambda: self.distance(0, *to) < 0.4, "quad0 at the goal")
        self.assertLess(self.speed(1), 0.05)
        self.assertIn("arena", self.refuse("send_goal", 0, Pose2D(100.0, 3.0, 0.0)))
        self.assertIn("quad7", self.refuse("send_goal", 7, Pose2D(3.0, 3.0, 0.0)))
        self.assertIn("resumed", self.do("start"))
        self.wait(lambda: self.flight("state") == "running", "a flight")
        self.wait(lambda: min(self.speed(0), self.speed(1)) > 0.2, "both flying again")
        self.cancel_and_reset()

    def cancel_and_reset(self):
        """A cancelled goal has failed; a reset begins with the first one again."""
        self.wait(lambda: self.page.row(1)["reason"] == "", "a mission that is not stopped")
        self.wait(self.goal_under_way, "a goal under way that is not the last")
        goal = self.page.row(1)["goal"]
        self.assertIn(f"mission goes on with goal {goal + 1}", self.do("cancel", 1))
        self.wait(lambda: self.page.goals(1)[goal - 1]["state"] == "failed", "a failed goal")
        self.wait(lambda: self.page.row(1)["goal"] == goal + 1, "the next goal")
        self.do("reset")
        self.wait(lambda: self.page.goals(1)[0]["state"] == "active", "the first goal again")

    def goal_under_way(self):
        """Whether quad1 is over 1.5 m from a goal, not its last; page and actions agree on it."""
        number, goals = self.health.progress(1).goal, self.page.goals(1)
        if self.page.row(1)["goal"] != number or number not in range(1, len(goals)):
            return False
        goal = goals[number - 1]
        return goal["state"] == "active" and self.distance(1, goal["x"], goal["y"]) > 1.5

    def test_6_saved_goals_are_flown(self):
        view = self.actions.goal_files()[1]
        goals = [GoalChange(k, *goal) for k, goal in enumerate(view.goals)]
        goals[-1] = GoalChange(len(goals) - 1, 10.5, 8.25, 1.5)
        self.assertEqual(self.actions.check_goals(1, view.version, goals), [""] * len(goals))
        self.assertIn("saved", self.do("save_goals", 1, view.version, goals))
        self.wait(lambda: self.page.goals(1)[-1]["y"] == 8.25, "the edited goal")
        self.assertIn("has changed", self.refuse("save_goals", 1, view.version, goals))

    def test_7_a_dead_navigator_is_lost_and_comes_back(self):
        self.show_a_track()
        pid = pid_of("/move_base1")
        os.kill(pid, signal.SIGSTOP)
        self.wait(lambda: self.page.row(1)["state"] == "lost", "a robot that is lost")
        self.assertIn("no message of its navigator", self.page.row(1)["reason"])
        self.wait(lambda: self.page.row(0)["state"] != "lost", "the other one, which is not")
        self.wait(lambda: "track/1" not in self.page.items, "no tracks of a lost navigator")
        os.kill(pid, signal.SIGKILL)
        self.wait(lambda: self.page.row(1)["state"] == "flying", "another navigator")

    def show_a_track(self):
        """Publish a track as the navigator of robot 1 does where something moves."""
        name = "/move_base1/moving_obstacle_tracks"
        topic = rospy.Publisher(name, MovingObstacles, queue_size=1)
        self.addCleanup(topic.unregister)
        message = MovingObstacles(Header(frame_id="map"), [MovingObstacle(x=3.0, y=2.0)], [])

        def is_shown():  # once the node web is connected
            topic.publish(message)
            return "track/1" in self.page.items

        self.wait(is_shown, "the track on the page")
        ((x, y, *_),) = self.page.arrays["track/1"]["rows"].tolist()
        self.assertEqual((x, y), (3.0, 2.0))

    def test_8_the_page_comes_back_at_its_address(self):
        port = rospy.get_param("/web/port")
        os.kill(pid_of("/web"), signal.SIGKILL)
        page = page_of_the_node()
        self.addCleanup(page.close)
        self.assertEqual(rospy.get_param("/web/port"), port)
        self.wait(lambda: "poses" in page.items and page.row(1), "poses and rows")


if __name__ == "__main__":
    rostest.rosrun("quad", "web_page", Web)
