"""Messages received by the node of the page."""

from __future__ import annotations

import io
import json
import math

import numpy as np
import pytest

rospy = pytest.importorskip("rospy")

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus  # noqa: E402
from geometry_msgs.msg import PoseWithCovariance, PoseWithCovarianceStamped  # noqa: E402
from quad import msg  # noqa: E402
from std_msgs.msg import Header, String  # noqa: E402

from quad_nav.costmap.tracks import Tracks  # noqa: E402
from quad_nav.geometry import Pose3D, quaternion_from_yaw  # noqa: E402
from quad_nav.mission.flight_log import Leg  # noqa: E402
from quad_nav.mission.goal import Goal  # noqa: E402
from quad_nav.mission.summary import MissionSummary, RobotSummary, to_json  # noqa: E402
from quad_nav.ros.common.conversions import pose_message  # noqa: E402
from quad_nav.ros.common.packed_messages import (  # noqa: E402
    STATES_TOPIC,
    States,
    pose_array_message,
    pose_row,
    states_message,
)
from quad_nav.sim.motion import Motion, Walkers  # noqa: E402
from quad_nav.sim.movers import Movers  # noqa: E402
from quad_nav.sim.obstacles import Box  # noqa: E402
from quad_nav.sim.scene import MovingObstacle, Scene, Walls  # noqa: E402
from quad_nav.topics.estimates import TRUTH_TOPIC  # noqa: E402
from quad_nav.topics.mission_events import SUMMARY_TOPIC  # noqa: E402
from quad_nav.topics.obstacle_poses import POSES_TOPIC  # noqa: E402
from quad_nav.topics.tracked_obstacles import obstacle_fields  # noqa: E402
from quad_web.ros.health import FleetHealth  # noqa: E402
from quad_web.ros.layers import Layers  # noqa: E402
from quad_web.ros.localizations import Localizations, cloud_places  # noqa: E402
from quad_web.ros.obstacles import Obstacles  # noqa: E402
from quad_web.ros.poses import Bodies  # noqa: E402
from quad_web.ros.reports import FlightReports  # noqa: E402
from quad_web.view.rows import sample_items  # noqa: E402
from quad_web.view.state import LAYERS, FleetState  # noqa: E402

CART = MovingObstacle(
    Box("cart", 1.0, 6.0, 1.0, 0.5, 2.0), Motion((0.0, 10.0), ((1.0, 6.0, -3.0), (5.0, 6.0, -3.0)))
)
STREET = Scene("street", 10.0, 8.0, 1.0, Walls(), (), (), moving=(CART,), walkers=Walkers(2))
EMPTY = Scene("empty", 10.0, 8.0, 1.0, Walls(), (), ())


TRACKS = Tracks(
    3.0,
    np.array([7]),
    np.array([(1.0, 0.0, 0.5, 0.0)]),
    np.eye(4)[None],
    np.array([0.3]),
    np.zeros(1),
)


class FakeFrames:
    """Knows where ``odom0`` is in ``map`` once it is told."""

    def __init__(self) -> None:
        self.map_from_odom = None

    def find(self, to_frame, from_frame):
        assert (to_frame, from_frame) in (("map", "odom0"), ("map", "map"))
        return Pose3D(0.0, 0.0, 0.0) if from_frame == "map" else self.map_from_odom


def hear(obstacles: Obstacles, message) -> None:
    """Give it a message as rospy does, which has its bytes only."""
    deliver(obstacles.topics(STREET)[POSES_TOPIC], message)


def deliver(topic, message) -> None:
    buffer = io.BytesIO()
    message.serialize(buffer)
    topic.callback(topic.message_type().deserialize(buffer.getvalue()))


def test_nothing_is_subscribed_to_where_nothing_moves():
    obstacles = Obstacles()
    assert obstacles.topics(None) == obstacles.topics(EMPTY) == {}
    assert list(obstacles.topics(STREET)) == [POSES_TOPIC]


def test_the_item_is_put_once_for_each_move():
    obstacles, movers = Obstacles(), Movers(STREET, 1)
    assert obstacles.items(STREET) == []
    for now_s, x_m in ((2.5, 2.0), (5.0, 3.0)):
        message = pose_array_message(movers.poses(now_s), now_s)
        hear(obstacles, message)
        (item,) = obstacles.items(STREET)
        assert item.arrays["poses"][0].tolist() == pytest.approx([x_m, 6.0, -3.0])
        hear(obstacles, message)
        assert obstacles.items(STREET) == []
    obstacles.start()  # another client has come
    hear(obstacles, message)
    assert len(obstacles.items(STREET)) == 1


@pytest.mark.parametrize("count, x_m", [(2, 1.0), (4, 1.0), (3, math.nan)])
def test_poses_that_are_not_of_the_scene_are_dropped(count, x_m):
    obstacles = Obstacles()
    hear(obstacles, pose_array_message(np.full((count, 3), x_m), 2.5))
    assert obstacles.items(STREET) == []


def test_distances_are_those_to_what_moves_at_their_times():
    """The cart, 0.25 m to each side in y, is at x 2 m at 2.5 s, and at 3 m at 5 s."""
    cart = Scene("cart", 10.0, 8.0, 1.0, Walls(), (), (), moving=(replace_yaw(CART),))
    obstacles, movers = Obstacles(), Movers(cart, 1)
    places = np.array([(2.0, 7.0), (2.0, 7.0), (3.0, 7.0)])
    at_wall = obstacles.distances_m(cart, places, np.array([2.5, 5.0, 5.1]))
    assert at_wall == pytest.approx([1.0, 1.0, 1.0])  # before the first message
    for now_s in (2.5, 5.0):
        deliver(obstacles.topics(cart)[POSES_TOPIC], pose_array_message(movers.poses(now_s), now_s))
    obstacles.items(cart)
    distances_m = obstacles.distances_m(cart, places, np.array([2.5, 5.0, 5.1]))
    assert distances_m == pytest.approx([0.75, math.hypot(0.5, 0.75), 0.75])


def replace_yaw(obstacle: MovingObstacle) -> MovingObstacle:
    motion = Motion((0.0, 10.0), ((1.0, 6.0, 0.0), (5.0, 6.0, 0.0)))
    return MovingObstacle(obstacle.shape, motion)


def test_samples_are_a_tenth_of_a_second_apart_at_any_rate(monkeypatch):
    """Between two looks at the states the robots come as near as 1 m, for 0.1 s."""
    bodies = Bodies(2, FakeFrames())
    topic = bodies.topics()[STATES_TOPIC]
    for tick in range(40):  # 1 s of 40 Hz
        x_m = 1.0 if 20 <= tick < 24 else 3.0
        poses = np.array([(0.0, 0.0, 1.0, 0, 0, 0, 1), (x_m, 0.0, 1.0, 0, 0, 0, 1)])
        states = States(tick / 40, "map", np.array([0, 1]), poses, np.zeros((2, 6)))
        deliver(topic, states_message(states))
    samples = bodies.samples()
    assert [stamp_s for stamp_s, _ in samples] == pytest.approx(np.arange(10) / 10)
    assert min(rows[1, 0] for _, rows in samples) == 1.0
    monkeypatch.setattr(rospy, "get_time", lambda: 39 / 40)
    assert bodies.refresh()
    ((stamp_s, rows),) = bodies.samples()  # without news they are where they are
    assert (stamp_s, rows[1, 0]) == (39 / 40, 3.0)
    items = sample_items(samples, 0.3, lambda places, _: np.hypot(*places.T), np.zeros(2))
    gaps = [item.arrays["values"][0, 0] for item in items]
    assert min(gaps) == pytest.approx(0.4) and np.median(gaps) == pytest.approx(2.4)


def test_a_robot_is_localized_as_amcl_or_slam_tell():
    """The particles are a line of 1000; a page gets each fourth, and nothing twice."""
    health = FleetHealth(2)
    localizations = Localizations(2, health)
    shown = frozenset((0, 1))
    assert localizations.topics(shown) == {} and localizations.items(shown) == []
    hear_health = health.topics()["/diagnostics"].callback
    hear_health(DiagnosticArray(status=[DiagnosticStatus(name="amcl0: Standard deviation")]))
    lost = DiagnosticStatus(name="quad1: localization", level=2, message="lost: scans do not fit")
    hear_health(DiagnosticArray(status=[lost]))
    topics = localizations.topics(shown)
    assert set(topics) == {"/amcl_pose0", "/particlecloud0", "/slam_pose1", TRUTH_TOPIC}
    pose = PoseWithCovariance(pose_message(Pose3D(2.0, 3.0, 1.0)), [float(i) for i in range(36)])
    deliver(topics["/amcl_pose0"], PoseWithCovarianceStamped(Header(frame_id="map"), pose))
    places = np.column_stack((np.arange(1000.0), np.zeros(1000), np.zeros(1000)))
    deliver(topics["/particlecloud0"], pose_array_message(places, 1.0))
    first, second = localizations.items(shown)
    assert first.arrays["pose"].tolist() == [2.0, 3.0, 0.0, 0.0, 1.0, 7.0, 35.0]
    assert first.arrays["points"][:, 0].tolist() == list(range(0, 1000, 4))
    assert (first.data["is_lost"], second.data["is_lost"]) == (False, True)
    assert localizations.items(shown) == []
    assert localizations.located(0).row() == {
        "is_lost": False,
        "searches": True,
        "yaw": 0.0,
        "deviation_m": pytest.approx(math.sqrt(7.0)),
    }
    assert localizations.located(1).row() == {"is_lost": True, "searches": False}
    deliver(topics["/amcl_pose0"], PoseWithCovarianceStamped(Header(frame_id="odom0"), pose))
    assert localizations.items(shown) == []  # dropped, with a warning


def test_the_error_is_the_distance_from_where_the_robot_was_at_the_stamp():
    """It believes to be at (2, 3) at 1.5 s, when it was at (2.3, 3.4) and turned by 0.1 rad."""
    health = FleetHealth(1)
    localizations, shown = Localizations(1, health), frozenset((0,))
    hear_health = health.topics()["/diagnostics"].callback
    hear_health(DiagnosticArray(status=[DiagnosticStatus(name="quad0: localization")]))
    topics = localizations.topics(shown)
    for stamp_s, x_m in ((1.25, 9.0), (1.5, 2.3), (1.75, 9.0)):
        row = [pose_row(Pose3D(x_m, 3.4, 1.0, quaternion_from_yaw(0.1)))]
        true = States(stamp_s, "map", np.array([0]), np.array(row), np.zeros((1, 6)))
        deliver(topics[TRUTH_TOPIC], states_message(true))
    pose = PoseWithCovariance(pose_message(Pose3D(2.0, 3.0, 1.0)), [0.0] * 36)
    for stamp_s in (1.51, 1.6):
        header = Header(0, rospy.Time(stamp_s), "map")
        deliver(topics["/slam_pose0"], PoseWithCovarianceStamped(header, pose))
        localizations.items(shown)
        row = localizations.located(0).row()
        error = (row.get("error_m"), row.get("error_rad"))
        assert error == (pytest.approx((0.5, 0.1)) if stamp_s == 1.51 else (None, None))
    row = [pose_row(Pose3D(2.3, 3.4, 1.0, quaternion_from_yaw(0.1)))]
    late = States(1.6, "map", np.array([0]), np.array(row), np.zeros((1, 6)))
    deliver(topics[TRUTH_TOPIC], states_message(late))
    localizations.items(shown)
    assert localizations.located(0).row()["error_m"] == pytest.approx(0.5)


@pytest.mark.parametrize("cut", [0, 10, 20, 30, 90])
def test_a_particle_cloud_that_is_cut_is_refused(cut):
    buffer = io.BytesIO()
    pose_array_message(np.ones((3, 3)), 1.0).serialize(buffer)
    assert cloud_places(buffer.getvalue()).tolist() == [[1.0, 1.0]] * 3
    with pytest.raises(ValueError, match="."):
        cloud_places(buffer.getvalue()[:cut])


LEG = Leg(0, 1, Goal(1.0, 2.0), True, "", 1, 70.0)
ENDED = MissionSummary((RobotSummary("quad0", (LEG, LEG), 9.0, 0.41, 1.54),), sim_time_s=70.0)


def test_the_result_of_a_mission_comes_and_goes():
    reports = FlightReports(1, FleetState())
    hear_summary = reports.topics(False)[SUMMARY_TOPIC].callback
    hear_summary(String(""))
    assert reports.result is None
    summary = to_json(ENDED)
    hear_summary(String(json.dumps(summary)))
    data = reports.result.data
    assert (data["is_success"], data["reached"], data["goals"]) == (True, 2, 2)
    assert (data["min_clearance_m"], data["min_separation_m"]) == (0.41, 1.54)
    assert (data["summary"], data["report"]) == (summary, "")
    for text in ("{", "[]", "7", json.dumps({**summary, "sim_time_s": math.nan}), "[" * 100000):
        hear_summary(String(text))  # dropped, with a warning
        assert reports.result.data is data
    hear_summary(String(""))  # after a reset
    assert reports.result is None


def message_of(tracks: Tracks, frame: str) -> msg.MovingObstacles:
    fields = obstacle_fields(tracks)
    each = {name: [msg.MovingObstacle(**one) for one in rows] for name, rows in fields.items()}
    return msg.MovingObstacles(header=Header(frame_id=frame), **each)


def test_tracks_are_shown_in_map_until_the_last_one_has_ended():
    """odom0 is at (2, 1) in map and turned by 90 degrees."""
    frames = FakeFrames()
    layers = Layers(None, frames, lambda robot: {})
    shown_layers = {layer: {0} if layer == "track" else set() for layer in LAYERS}
    ((name, topic),) = layers.topics(shown_layers).items()
    assert name == "/move_base0/moving_obstacle_tracks" and layers.items() == []
    shown = message_of(TRACKS, "odom0")
    deliver(topic, shown)
    assert layers.items() == []  # the transform of odom0 is not known yet
    frames.map_from_odom = Pose3D(2.0, 1.0, 0.0, quaternion_from_yaw(math.pi / 2))
    deliver(topic, shown)
    (item,) = layers.items()
    assert item.key == "track/0"
    (row,) = item.arrays["rows"].tolist()
    assert row == pytest.approx([2.0, 2.0, 0.0, 0.5, 0.3, 0.0])
    assert layers.items() == []
    deliver(topic, message_of(Tracks.none(4.0), "odom0"))
    (item,) = layers.items()
    assert item.arrays["rows"].shape == (0, 6)
    shown.obstacles[0].radius = math.inf
    deliver(topic, shown)
    assert layers.items() == []
