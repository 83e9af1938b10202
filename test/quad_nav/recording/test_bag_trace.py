"""A trace read from a recording is the one that an observer took of the flight."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from recorded_flight import setup

from quad_nav.control.controller import Control
from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D, Pose3D, Twist2D, quaternion_from_yaw
from quad_nav.mission.actions import SendGoal
from quad_nav.navigator.tick import RecoveryStart, RobotPoses, State, Tick, Trigger
from quad_nav.offline.flight import FlightObserver
from quad_nav.recording import bag_file, messages
from quad_nav.recording.bag_trace import read_trace
from quad_nav.recording.record_file import create
from quad_nav.recording.recorder import Recorder
from quad_nav.sim.contacts import Contact
from quad_nav.topics.contacts import contact_fields
from quad_nav.topics.flight_info import FlightInfo
from quad_nav.topics.mission_events import mission_event

# Stamps are whole nanoseconds; yaws come from quaternions.
TIME_S, YAW_RAD = 1e-9, 1e-12

TOUCH = Contact(0.125, "quad1", "quad0", 9.876543, 2.0)
HERE = Pose2D(1.5, 1.5)
EVENT = mission_event(0, 1.0, SendGoal(0, 1, HERE, 1))


class Troubles(FlightObserver):
    """Lets others believe in a contact and a recovery at the end of the flight."""

    def __init__(self, *others):
        self._others = others

    def on_end(self, flight):
        now_s = flight.now_s
        start = RecoveryStart("conservative_reset", 0, 3, Trigger.CONTROLLING)
        plan = np.array([[1.0, 2.0, 3.0], [1.5, 2.5, -3.0]])
        tick = Tick(
            now_s,
            State.CLEARING,
            command=Twist2D(0.1, -0.2, 0.3),
            plan=plan,
            control=Control(Twist2D(), 0.0, plan, plan),
            recovery=start,
        )
        for other in self._others:
            other.on_contact(dataclasses.replace(TOUCH, time_s=now_s))
            other.on_tick(0, tick, RobotPoses(HERE, HERE), 0.01)


@pytest.fixture(scope="module")
def traces(tmp_path_factory):
    """The trace of the observer and the one that was read."""
    from quad_nav.offline.run import fly
    from quad_nav.recording.trace import TraceObserver

    folder = tmp_path_factory.mktemp("flight")
    path = folder / "flight.bag"
    trace, recorder = TraceObserver("short"), Recorder(path, "short")
    summary = fly(setup(folder, seed=3), [trace, Troubles(trace, recorder), recorder])
    contact = Contact(summary.sim_time_s, "quad1", "quad0", 9.876543, 2.0)
    return trace.trace((contact,), summary.reason), read_trace(path)


def test_the_information_about_the_flight(traces):
    seen, read = traces
    for field in ("title", "scene", "robot_radius_m", "seed", "config_name", "versions", "reason"):
        assert getattr(read, field) == getattr(seen, field), field
    assert read.seed == 3
    (touch,), (contact,) = seen.contacts, read.contacts
    assert (contact.robot, contact.other) == (touch.robot, touch.other) == ("quad1", "quad0")
    place = pytest.approx((touch.time_s, touch.x_m, touch.y_m), abs=TIME_S)
    assert (contact.time_s, contact.x_m, contact.y_m) == place


def test_motion_and_commands_are_the_same_to_the_bit(traces):
    for seen, read in zip(*(trace.robots for trace in traces)):
        assert (read.name, read.parameters) == (seen.name, seen.parameters)
        assert len(read.commands) > 10
        for field in ("positions_m", "quaternions", "velocities", "commands"):
            assert np.array_equal(getattr(read, field), getattr(seen, field)), field
        for field in ("times_s", "command_times_s", "cycle_times_s"):
            assert getattr(read, field) == pytest.approx(getattr(seen, field), abs=TIME_S), field
        assert len(read.cycle_walls_s) == 0  # wall times are not recorded


def test_plans_states_recoveries_and_goals(traces):
    for seen, read in zip(*(trace.robots for trace in traces)):
        for field in ("plans", "states", "recoveries"):
            found, expected = getattr(read, field), getattr(seen, field)
            assert [time_s for time_s, _ in found] == pytest.approx(
                [time_s for time_s, _ in expected], abs=TIME_S
            ), field
        assert [state for _, state in read.states] == [state for _, state in seen.states]
        assert [name for _, name in read.recoveries] == [name for _, name in seen.recoveries]
        assert len(read.plans) > 1
        for (_, plan), (_, expected) in zip(read.plans, seen.plans):
            assert np.array_equal(plan[:, :2], expected[:, :2])
            assert np.cos(plan[:, 2] - expected[:, 2]) == pytest.approx(1.0, abs=YAW_RAD)
        assert len(read.goals) == len(seen.goals) > 0
        for goal, other in zip(read.goals, seen.goals):
            ends = pytest.approx((other.sent_s, other.ended_s), abs=TIME_S)
            assert (goal.sent_s, goal.ended_s) == ends
            assert dataclasses.replace(goal, sent_s=0.0, ended_s=0.0) == dataclasses.replace(
                other, sent_s=0.0, ended_s=0.0
            )
    assert traces[1].robots[0].states[-1][1] is State.CLEARING
    assert traces[1].robots[0].recoveries[0][1] == "conservative_reset"


# Recordings of others, with few topics.


def odometry(stamp, x_m, frame="odom0"):
    return messages.odometry(
        Pose3D(x_m, 0.0, 1.0), (0.5, 0.0, 0.0), (0.0, 0.0, 0.0), (frame, "base_link0"), stamp
    )


def bag(path, *entries):
    """Entries: (topic, stamp of recording, message)."""
    file, topics = create(path), {}
    for topic, stamp, content in entries:
        kind = content.__msgtype__.replace("/msg/", "/")
        if topic not in topics:
            topics[topic] = file.add_topic(topic, kind, False, "/test")
        file.write(topics[topic], stamp, messages.encode(content))
    file.close()
    return path


def test_odometry_alone_makes_a_trace(tmp_path):
    path = bag(
        tmp_path / "walk.bag",
        ("/odom0", 5 * 10**9, odometry(5 * 10**9, 1.0)),
        ("/odom0", 6 * 10**9, odometry(6 * 10**9, 1.5)),
    )
    trace = read_trace(path)
    (robot,) = trace.robots
    assert (trace.title, trace.scene, trace.seed, trace.contacts) == ("walk", None, None, ())
    assert robot.times_s.tolist() == [0.0, 1.0]
    assert robot.positions_m[:, 0].tolist() == [1.0, 1.5]
    assert robot.commands.shape == (0, 3)
    assert len(robot.cycle_times_s) == len(robot.plans) == len(robot.goals) == 0


def test_odometry_is_put_into_the_map(tmp_path):
    """odom0 lies 10 m along x of map and is turned to the left."""
    quarter = Pose3D(10.0, 0.0, 0.0, quaternion_from_yaw(np.pi / 2))
    moved = messages.transform(quarter, "map", "odom0", 10**9)
    path = bag(
        tmp_path / "flight.bag",
        ("/tf", 10**9, messages.message("tf2_msgs/TFMessage", [moved])),
        ("/odom0", 10**9, odometry(10**9, 1.0)),
    )
    assert read_trace(path).robots[0].positions_m == pytest.approx(np.array([[10.0, 1.0, 1.0]]))


def test_a_wall_clock_of_the_recorder_and_repeated_odometry_are_ignored(tmp_path):
    """Recorded at a wall time of 1e9 s, while the simulation's clock was at 2 s and stood."""
    wall = 10**18
    path = bag(
        tmp_path / "flight.bag",
        ("/odom0", wall, odometry(10**9, 0.0)),
        ("/clock", wall + 1, messages.clock(2 * 10**9)),
        ("/cmd_vel0", wall + 2, messages.command(Twist2D(0.3, 0.0, 0.1))),
        *(("/odom0", wall + k, odometry(2 * 10**9, 0.5)) for k in (3, 4)),
    )
    (robot,) = read_trace(path).robots
    assert robot.command_times_s.tolist() == [1.0]
    assert robot.commands.tolist() == [[0.3, 0.0, 0.1]]
    assert robot.times_s.tolist() == [0.0, 1.0]


def test_information_of_several_nodes_is_merged(tmp_path):
    path = bag(
        tmp_path / "flight.bag",
        ("/quad/flight", 1, messages.flight_info(FlightInfo(seed=4, start_s=1.0))),
        ("/quad/flight", 2, messages.flight_info(FlightInfo(robot_radius_m=0.25))),
        ("/odom0", 3 * 10**9, odometry(3 * 10**9, 0.0)),
    )
    trace = read_trace(path)
    assert (trace.seed, trace.robot_radius_m) == (4, 0.25)
    assert trace.robots[0].times_s.tolist() == [2.0]


def test_a_person_who_is_not_in_the_scene_is_refused(tmp_path):
    scene = {
        "name": "room",
        "size": [10.0, 10.0],
        "altitude": 1.0,
        "starts": [[1.0, 1.0, 0.0]],
        "walkers": {"count": 2, "reacting": True},
    }
    path = bag(
        tmp_path / "odd.bag",
        ("/quad/flight", 1, messages.flight_info(FlightInfo(scene=scene))),
        ("/odom0", 10**9, odometry(10**9, 0.0)),
        ("/simulation/obstacle_poses", 10**9, messages.pose_array(np.zeros((3, 3)), 10**9)),
    )
    with pytest.raises(InputError) as error:
        read_trace(path)
    (problem,) = error.value.problems
    assert problem.startswith(f"{path}: /simulation/obstacle_poses: 3 poses; expected 2")


def test_navfn_s_plan_published_twice_is_one(tmp_path):
    plans = [np.array([[float(x), 0.0, 0.0] for x in range(count)]) for count in (2, 3)]
    data = (messages.plan_bytes(plan, "map", 10**9) for plan in plans)
    shown = [messages.decode(one, "nav_msgs/Path") for one in data]
    path = bag(
        tmp_path / "flight.bag",
        ("/odom0", 10**9, odometry(10**9, 0.0)),
        *(("/move_base0/NavfnROS/plan", 10**9, one) for one in shown),
    )
    ((_, plan),) = read_trace(path).robots[0].plans
    assert plan[:, 0].tolist() == [0.0, 1.0, 2.0]


# What is no recording.


def with_a_damaged_chunk(data):
    at = data.index(b"\x04\x22\x4d\x18") + 20
    return data[:at] + bytes([data[at] ^ 0xFF]) + data[at + 1 :]


@pytest.mark.parametrize(
    "damage, problem",
    [
        (None, ".*expected a "),
        (lambda data: b"", ".*expected"),
        (lambda data: b"no bag at all\n" * 50, ".*expected"),
        (lambda data: data[: len(data) // 3], ""),
        (lambda data: data[:-20], ""),
        (with_a_damaged_chunk, "damaged file"),
    ],
)
def test_what_is_no_recording_is_refused_by_name(tmp_path, damage, problem):
    path = tmp_path / "flight.bag"
    if damage is not None:
        bag(path, *(("/odom0", k * 10**9, odometry(k * 10**9, 0.0)) for k in range(1, 100)))
        path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(InputError, match=f"flight.bag: {problem}"):
        read_trace(path)


def test_an_incomplete_bag_is_refused_with_its_remedy(tmp_path):
    file = create(tmp_path / "flight.bag")
    topic = file.add_topic("/odom0", "nav_msgs/Odometry", False, "/test")
    file.write(topic, 10**9, messages.encode(odometry(10**9, 0.0)))
    file._writer.bio.close()  # as a program that is killed
    with pytest.raises(InputError, match="no index.*rosbag reindex"):
        read_trace(tmp_path / "flight.bag.active")


@pytest.mark.parametrize(
    "topic, content",
    [
        ("/quad/events", messages.stamped("quad/MissionEvent", {**EVENT.fields, "event": 0}, 1)),
        ("/quad/events", messages.stamped("quad/MissionEvent", {**EVENT.fields, "robot": 100}, 1)),
        (
            "/simulation/contacts",
            messages.stamped("quad/Contact", {**contact_fields(TOUCH), "x": math.nan}, 1),
        ),
    ],
)
def test_an_invalid_message_is_named(tmp_path, topic, content):
    path = bag(tmp_path / "flight.bag", ("/odom0", 1, odometry(1, 0.0)), (topic, 2, content))
    with pytest.raises(InputError, match=f"flight.bag: {topic}: invalid message: .*expected"):
        read_trace(path)


def test_a_recording_of_an_older_version_or_without_odometry_is_refused(tmp_path):
    text = messages.message("std_msgs/String", "{}")
    path = bag(tmp_path / "flight.bag", ("/quad/flight", 1, text))
    with pytest.raises(InputError, match="/quad/flight: is std_msgs/String, as quad 0.2.0 rec"):
        read_trace(path)
    path = bag(tmp_path / "clock.bag", ("/clock", 10**9, messages.clock(10**9)))
    with pytest.raises(InputError, match="no odometry; expected messages nav_msgs/Odometry on /od"):
        read_trace(path)


def test_a_message_with_another_definition_is_refused(tmp_path, monkeypatch):
    path = bag(tmp_path / "flight.bag", ("/quad/flight", 1, messages.flight_info(FlightInfo())))
    monkeypatch.setattr(bag_file, "definition", lambda kind: ("", "0" * 32))
    with pytest.raises(InputError, match="quad/FlightInfo has another definition"):
        read_trace(path)
