"""A clock that stops and goes on: how long it stopped, and which of the waiting scans are used."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

rospy = pytest.importorskip("rospy")

from ros.fake_ros import FakeRos, FakeWall, deliver  # noqa: E402
from sensor_msgs.msg import LaserScan  # noqa: E402

from quad_nav.costmap.layered import CostmapParams, LayeredCostmap  # noqa: E402
from quad_nav.costmap.observation import SourceParams  # noqa: E402
from quad_nav.costmap.obstacle import ObstacleLayerParams  # noqa: E402
from quad_nav.costmap.scan_filter import ScanFilters  # noqa: E402
from quad_nav.costmap.scan_intake import ScanIntake, sinks_of  # noqa: E402
from quad_nav.costmap.scan_validator import ScanValidator, ScanValidatorParams  # noqa: E402
from quad_nav.ros.navigator import loop  # noqa: E402
from quad_nav.ros.navigator.loop import NavigatorLoop  # noqa: E402
from quad_nav.ros.navigator.sensors import Sensor  # noqa: E402


@pytest.fixture
def ros():
    with FakeRos("/stopped_clock") as fake:
        yield fake


@pytest.fixture
def wall(monkeypatch):
    wall = FakeWall()
    monkeypatch.setattr(loop, "time", wall)
    return wall


def sensor_with(**params):
    source = SourceParams("laser", data_type="LaserScan", expected_update_period_s=0.5)
    layer = ObstacleLayerParams(sources=(source,))
    costmap = LayeredCostmap(CostmapParams(layers=(("obstacle_layer", layer),)))
    filters = ScanFilters([ScanValidator(ScanValidatorParams(**params))])
    host = SimpleNamespace(
        configuration=SimpleNamespace(robot=0),
        new_intake=lambda sinks: ScanIntake(sinks, filters, "map"),
    )
    return Sensor(host, "/scan0", "LaserScan", sinks_of([costmap]))


def scan_stamped(stamp_s):
    scan = LaserScan(angle_increment=0.1, range_min=0.1, range_max=10.0, ranges=[1.0, 2.0])
    scan.header.stamp, scan.header.frame_id = rospy.Time.from_sec(stamp_s), "Lidar0"
    return scan


@pytest.mark.parametrize(("reject", "left"), [(True, [1.75, 2.0]), (False, [1.5, 1.75, 2.0])])
def test_late_scans_are_discarded(ros, reject, left):
    sensor = sensor_with(reject_implausible_scans=reject)
    ros.set_time(2.0)
    for stamp_s in (1.5, 1.75, 2.0):
        deliver("/scan0", scan_stamped(stamp_s))
    sensor.discard_late()
    assert [message.header.stamp.to_sec() for message, _ in sensor._waiting] == left


@pytest.mark.parametrize(
    ("has_clock", "stopped", "jumped"),
    [
        (True, "/clock stopped for 2.0 s", "/clock jumped back by 1.00 s"),
        (
            False,
            "the node was stopped or busy for 2.0 s",
            "the system's clock jumped back by 1.00 s",
        ),
    ],
)
def test_a_clock_is_named_where_there_is_one(ros, wall, monkeypatch, has_clock, stopped, jumped):
    steps = [
        (1.1, 30.0),  # the wait for the first step is no stop
        (1.2, 2.0),
        (1.3, 0.1),
        (0.3, 0.1),
        (0.4, 0.1),
    ]  # time of the clock, wall time since

    def sleep(_):
        now_s, since_s = steps.pop(0)
        wall.now_s += since_s
        ros.set_time(now_s)

    robot = SimpleNamespace(
        name="quad0",
        health=None,
        subscribers=[],
        stop=lambda: None,
        due_s=0.0,
        step=lambda _: None,
        restart=lambda _: None,
        discard_late_scans=lambda: None,
        on_request=lambda _: None,
        has_request=False,
    )
    monkeypatch.setattr(loop, "is_wallclock", lambda: not has_clock)
    monkeypatch.setattr(loop, "Alarm", lambda: SimpleNamespace(set=None, sleep=sleep))
    monkeypatch.setattr(rospy, "is_shutdown", lambda: not steps)
    monkeypatch.setattr(loop, "publish_health", lambda _: None)
    NavigatorLoop([robot], [], 0.001).run()
    assert [line for line in ros.log.lines if "behind" not in line] == [
        f"quad0: {stopped}; discarding queued messages",
        f"quad0: {jumped}; restarting all schedules",
    ]
