#!/usr/bin/env python3
"""Compare dynamic_reconfigure with recordings of C++ move_base: names, types, values, effects."""

import ast

import rospy
import rostest
from dynamic_reconfigure.msg import Config, ConfigDescription
from flight_case import PATIENCE_S, goal_pose
from geometry_msgs.msg import Point32, Polygon, PolygonStamped, Twist
from move_base_msgs.msg import MoveBaseActionFeedback
from upstream_case import ROBOTS, UpstreamCase, recorded_yaml

KINDS = ("bools", "ints", "strs", "doubles")
GOALS = ((3.0, 6.5), (10.5, 10.0))


def values(config):
    """Name -> value of a Config message."""
    return {entry.name: entry.value for kind in KINDS for entry in getattr(config, kind)}


class UpstreamReconfigure(UpstreamCase):
    def namespaces(self):
        """Robot, absolute namespace, and what was recorded of it."""
        for i in ROBOTS:
            for name, recorded in recorded_yaml("reconfigure.yaml", i).items():
                yield i, f"/move_base{i}" + ("" if name == "." else f"/{name}"), recorded

    def latched(self, topic, message_type):
        return rospy.wait_for_message(topic, message_type, PATIENCE_S)

    # -- descriptions and values ---------------------------------------------------

    def test_descriptions(self):
        """In the recorded order; the recordings end early, and ours has more parameters."""
        for _, namespace, recorded in self.namespaces():
            message = self.latched(f"{namespace}/parameter_descriptions", ConfigDescription)
            (group,) = message.groups
            self.assertEqual(
                (group.name, group.type, group.id, group.parent), ("Default", "", 0, 0)
            )
            ours = [(p.name, p.type) for p in group.parameters]
            expected = [(name, type_) for name, (type_, _) in recorded["parameters"].items()]
            self.assertEqual(ours[: len(expected)], expected, namespace)
            self.assertEqual({p.level for p in group.parameters}, {0})
            for bound in ("min", "max"):
                config = getattr(message, bound)
                bounds = values(config)
                self.assertEqual(set(bounds), {p.name for p in group.parameters}, namespace)
                for name, value in recorded.get(bound, {}).items():
                    self.assertEqual(bounds[name], value, f"{namespace}/{name} {bound}")
                (state,) = config.groups
                self.assertEqual(
                    (state.name, state.state, state.id, state.parent), ("Default", True, 0, 0)
                )

    def test_enumeration_is_what_rqt_reconfigure_parses(self):
        for i in ROBOTS:
            client = self.client(f"/move_base{i}/local_costmap/obstacle_layer")
            group = client.get_group_descriptions(PATIENCE_S)
            (method,) = [
                parameter["edit_method"]
                for parameter in group["parameters"]
                if parameter["name"] == "combination_method"
            ]
            choices = ast.literal_eval(method)
            self.assertEqual(choices["enum_description"], "Method for combining layers enum")
            self.assertEqual(
                [(choice["name"], choice["value"], choice["type"]) for choice in choices["enum"]],
                [("Overwrite", 0, "int"), ("Maximum", 1, "int"), ("Nothing", 99, "int")],
            )

    def test_values(self):
        for _, namespace, recorded in self.namespaces():
            ours = values(self.latched(f"{namespace}/parameter_updates", Config))
            for name, value in recorded["values"].items():
                self.assertEqual(ours[name], value, f"{namespace}/{name}")

    def test_change_is_seen_everywhere(self):
        """By the caller, the topic and the parameter server; of one robot only."""
        updates = self.record("/move_base0/TrajectoryPlannerROS/parameter_updates", Config)
        self.wait(lambda: updates.messages, "the latched values")
        answer = self.reconfigure("/move_base0/TrajectoryPlannerROS", sim_time=2.0)
        self.assertEqual(answer["sim_time"], 2.0)
        self.wait(lambda: values(updates.messages[-1])["sim_time"] == 2.0, "the new value")
        for i, sim_time_s in ((0, 2.0), (1, 1.7)):
            self.assertEqual(
                rospy.get_param(f"/move_base{i}/TrajectoryPlannerROS/sim_time"), sim_time_s
            )

    # -- out of range --------------------------------------------------------------

    def test_out_of_range_is_clamped(self):
        for namespace, name, value, clamped in (
            ("TrajectoryPlannerROS", "max_vel_x", 100.0, 20.0),
            ("TrajectoryPlannerROS", "max_vel_x", -1.0, 0.0),
            ("TrajectoryPlannerROS", "vx_samples", 0, 1),
            ("global_costmap/inflation_layer", "inflation_radius", 60.0, 50.0),
            ("", "planner_patience", 1000.0, 100.0),
        ):
            namespace = f"/move_base0/{namespace}".rstrip("/")
            answer = self.reconfigure(namespace, **{name: value})
            self.assertEqual(answer[name], clamped, f"{namespace}/{name}")
            self.assertEqual(rospy.get_param(f"{namespace}/{name}"), clamped)
            self.doCleanups()

    def test_refused_values_leave_those_in_force(self):
        """A size that no machine has memory for: rqt_reconfigure's slider reaches so far."""
        namespace = "/move_base0/global_costmap"
        in_force = rospy.get_param(f"{namespace}/width")
        self.assertEqual(self.reconfigure(namespace, width=21474836)["width"], in_force)
        self.assertEqual(rospy.get_param(f"{namespace}/width"), in_force)
        self.assertEqual(self.reconfigure(namespace, publish_frequency=3.0)["width"], in_force)

    # -- effects -------------------------------------------------------------------

    def test_max_vel_x_limits_the_next_commands(self):
        commands = self.record("/cmd_vel0", Twist)
        self.send(0, goal_pose(*GOALS[0]))
        self.wait(lambda: any(c.linear.x > 0.25 for c in commands.messages), "more than 0.25 m/s")
        self.reconfigure("/move_base0/TrajectoryPlannerROS", max_vel_x=0.15)
        self.simulated_seconds(2.0)  # commands may have been on their way
        count = len(commands.messages)
        self.wait(lambda: len(commands.messages) >= count + 4, "four commands")
        speeds = [command.linear.x for command in commands.messages[count:]]
        self.assertLessEqual(max(speeds), 0.15 + 1e-9)
        self.assertGreater(max(speeds), 0.05)
        self.rest(0)

    def test_controller_frequency_changes_in_flight(self):
        self.send(1, goal_pose(*GOALS[1]))
        self.next_feedback(1)
        self.reconfigure("/move_base1", controller_frequency=5.0)
        self.next_feedback(1)
        feedback = self.record("/move_base1/feedback", MoveBaseActionFeedback)
        self.wait(lambda: len(feedback.messages) > 20, "twenty cycles")
        self.assertAlmostEqual(feedback.rate_hz(), 5.0, delta=0.6)
        self.rest(1)

    def test_inflation_radius_changes_the_costmap(self):
        def inflated():
            return sum(cost > 0 for cost in self.global_costmap(0).data)

        self.wait(lambda: inflated() > 0, "obstacles")
        before = inflated()
        self.reconfigure("/move_base0/global_costmap/inflation_layer", inflation_radius=1.0)
        self.wait(lambda: inflated() > 1.3 * before, "wider inflation")
        self.doCleanups()
        self.wait(lambda: inflated() < 1.1 * before, "the old inflation")

    def test_update_frequency_changes_the_footprints_rate(self):
        self.reconfigure("/move_base1/local_costmap", update_frequency=8.0)
        footprints = self.record("/move_base1/local_costmap/footprint", PolygonStamped)
        self.wait(lambda: len(footprints.messages) > 40, "forty footprints")
        self.assertAlmostEqual(footprints.rate_hz(), 8.0, delta=0.8)

    def test_footprint_comes_from_its_topic_until_its_parameters_change(self):
        topic = "/move_base1/local_costmap/footprint"
        footprints = self.record(topic, PolygonStamped)

        def corners():
            return len(footprints.messages[-1].polygon.points) if footprints.messages else 0

        self.wait(lambda: corners() == 16, "the circle")
        arm = rospy.Publisher(topic, Polygon, queue_size=1)
        self.addCleanup(arm.unregister)
        self.wait(lambda: arm.get_num_connections() > 0, "the navigator listens")
        arm.publish(Polygon([Point32(0.5, 0.3, 0), Point32(-0.3, 0.3, 0), Point32(0.0, -0.3, 0)]))
        self.wait(lambda: corners() == 3, "the triangle")
        self.reconfigure("/move_base1/local_costmap", footprint_padding=0.1)
        count = len(footprints.messages)
        self.wait(lambda: len(footprints.messages) > count + 1, "two footprints")
        self.assertEqual(corners(), 3)
        self.reconfigure("/move_base1/local_costmap", robot_radius=0.4)
        self.wait(lambda: corners() == 16, "the circle again")


if __name__ == "__main__":
    rostest.rosrun("quad", "upstream_reconfigure", UpstreamReconfigure)
