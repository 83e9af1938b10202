#!/usr/bin/env python3
"""A flight of ROS nodes on the page in chromium: goal, stop all, result, a killed node."""

import json
import re
import sys
from pathlib import Path

import psutil
import rospy
import rostest
from flight_case import FlightCase, pid_of, trigger
from playwright.sync_api import expect
from std_msgs.msg import String

from quad_nav.mission.flight_log import Leg
from quad_nav.mission.goal import Goal
from quad_nav.mission.summary import MissionSummary, RobotSummary, to_json

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test" / "web"))

from browser import DESKTOP, Watch, chromium  # noqa: E402
from driver import Driver  # noqa: E402

PATIENCE_MS = 120000
NOTICE = ".quad-link-notice"
SILENT = re.compile("No data for [1-9]")
GONE = r"ERR_CONNECTION_REFUSED|ERR_EMPTY_RESPONSE|ERR_CONNECTION_RESET|WebSocket|Failed to load"


class WebBrowser(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        expect.set_options(timeout=PATIENCE_MS)
        cls.start()
        cls.wait(lambda: rospy.get_param("/web/port", 0), "a page")  # 0: it starts
        browser = chromium(draws_3d=False)
        cls.addClassCleanup(browser.__exit__, None, None, None)
        cls.context = browser.__enter__().new_context(**DESKTOP)
        cls.watch = Watch(cls.context)
        cls.driver = Driver(cls.context.new_page())
        cls.driver.page.set_default_timeout(PATIENCE_MS)
        cls.driver.page.goto(cls.url())

    @staticmethod
    def url():
        """Return the address that the node prints to steer."""
        token = rospy.get_param("/web/steer_token")
        return f"http://127.0.0.1:{rospy.get_param('/web/port')}/?token={token}"

    def restart_node(self):
        """Kill the node, and have it restarted once the page has noticed."""
        self.wait(lambda: pid_of("/web"), "the node's own address after the last restart")
        node = psutil.Process(pid_of("/web"))
        supervisor = node.parent()
        supervisor.suspend()  # or the node could be back before the page is looked at
        try:
            node.kill()
            expect(self.driver.page.locator(NOTICE)).to_contain_text(SILENT)
            expect(self.driver.page.locator("body")).to_have_class(re.compile("quad-link-dead"))
        finally:
            supervisor.resume()

    def tearDown(self):
        self.assertEqual(self.watch.faults, [])

    def test_1_the_page_shows_both_quadcopters_where_they_are(self):
        driver = self.driver.is_ready()
        expect(driver.at("role")).to_have_text("Steering")
        expect(driver.at("flight-state")).to_have_text("running")
        expect(driver.rows()).to_have_count(2)
        driver.wait_for_arena("arena.fleet.robots.length === 2", PATIENCE_MS / 1e3)
        for robot in (0, 1):
            with self.subTest(robot=robot):
                self.wait(lambda k=robot: self.is_shown(k), "a robot where it is")

    def is_shown(self, robot):
        shown = self.driver.arena(f"fleet.robots[{robot}]")
        return self.distance(robot, shown["x"], shown["y"]) < 1.0

    def test_2_a_goal_that_is_dragged_is_flown_to(self):
        driver = self.driver
        # A goal of the mission would replace this one, on a busy machine soon after it is sent.
        self.wait(lambda: self.speed(0) > 0.2, "quad0 flying to its first goal")
        trigger("/mission/stop")
        expect(driver.at("flight-state")).to_have_text("stopped")
        goal = 3.0, 9.0
        driver.select(0)
        driver.use_goal_tool()
        driver.fit()
        driver.drag_arena(goal, (goal[0] + 1.0, goal[1]))
        driver.says(f"quad0: goal ({goal[0]:.2f}")
        self.wait(lambda: self.distance(0, *goal) < 0.5, lambda: f"{self.position(0)}, not {goal}")
        robot = "arena.fleet.robots[0]"
        driver.wait_for_arena(f"Math.hypot({robot}.x - {goal[0]}, {robot}.y - {goal[1]}) < 1.0")
        trigger("/mission/resume")
        self.wait(lambda: self.speed(0) > 0.2, "quad0 flying to its first goal again")
        # Diagnostics, which the page goes by, come once a second: until then its button resumes.
        expect(driver.at("flight-state")).to_have_text("running")

    def test_3_a_flight_by_keyboard_alone(self):
        self.driver.fly_by_keyboard()
        self.wait(lambda: min(self.speed(0), self.speed(1)) > 0.2, "both flying again")

    def test_4_stop_all_stops_all(self):
        self.driver.at("stop-all").click()
        self.driver.says("every quadcopter hovers")
        self.wait(lambda: max(self.speed(0), self.speed(1)) < 0.05, "both hovering")
        for robot in (0, 1):
            row = self.driver.at(f"robots-row-{robot}")
            expect(row).to_contain_text("stopped")

    def test_5_a_mission_that_has_ended_shows_its_result(self):
        """The sequencer's flies in rounds: its summary is made up."""
        legs = tuple(Leg(k, 1, Goal(1.0, 2.0), True, "", 1, 70.0) for k in (0, 1))
        robot = RobotSummary("quad0", legs, 9.0, 0.41, 1.54)
        summary = to_json(MissionSummary((robot,), sim_time_s=70.0, wall_time_s=5.0))
        topic = rospy.Publisher("/quad/summary", String, queue_size=1, latch=True)
        topic.publish(json.dumps(summary))
        expect(self.driver.at("flight-state")).to_have_text("stopped")
        self.driver.at("play").click()  # resumes what the last test has stopped
        expect(self.driver.at("flight-state")).to_have_text("ended")
        card = self.driver.at("result")
        for text in ("Mission succeeded", "2 of 2", "70.0 s", "0.41 m", "1.54 m"):
            expect(card).to_contain_text(text)
        self.assertEqual(self.driver.at("result-report").count(), 0)
        url = f"http://127.0.0.1:{rospy.get_param('/web/port')}/summary.json"
        self.assertEqual(self.context.request.get(url).json(), summary)
        topic.publish("")
        expect(card).to_be_hidden()
        expect(self.driver.at("flight-state")).to_have_text("running")

    def test_6_a_killed_node_is_noticed_and_the_page_comes_back(self):
        self.watch.forgive(GONE)
        self.restart_node()
        expect(self.driver.page.locator(NOTICE)).to_be_hidden()
        expect(self.driver.rows()).to_have_count(2)
        self.driver.is_ready()

    def test_7_a_page_with_an_old_token_says_what_to_do(self):
        rospy.set_param("/web/steer_token", "the-second-to-steer")
        self.restart_node()
        notice = self.driver.page.locator(NOTICE)
        expect(notice).to_contain_text("open the address that it has printed")
        other = self.context.new_page()
        other.goto(self.url())
        expect(Driver(other).at("role")).to_have_text("Steering")
        expect(notice).to_be_hidden()  # the cookie is the browser's
        self.driver.is_ready()


if __name__ == "__main__":
    rostest.rosrun("quad", "web_browser", WebBrowser)
