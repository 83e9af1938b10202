"""Stop and resume a mission: the sequencer's node on a clock that the test sets."""

from __future__ import annotations

import threading

import pytest

rospy = pytest.importorskip("rospy")

from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray  # noqa: E402
from ros.fake_mission import STARTS, Mission, call, stopped  # noqa: E402
from ros.fake_ros import FakePublisher, FakeRos, deliver  # noqa: E402

from quad_nav.mission.sequencer import NavigatorReport, Verdict  # noqa: E402


@pytest.fixture
def ros():
    with FakeRos("/sequencer") as fake:
        yield fake


@pytest.fixture
def mission(ros, tmp_path):
    return Mission(ros, tmp_path)


def test_a_resumption_of_all_leaves_alone_what_was_not_stopped(mission):
    mission.begin()
    assert mission.fly(100.0) == [(0, 10.0), (1, 10.0)]
    call("/mission/quad1/stop", 100.0)
    mission.fly(150.0)
    call("/mission/resume", 160.0)
    assert mission.fly(160.0) == [(1, 10.0)]
    robot, other = (robot.sequencer for robot in mission.runner.robots)
    assert (robot.active_goal.sent_s, other.active_goal.sent_s) == (100.0, 160.0)
    assert mission.fly(199.9) == []
    assert mission.fly(200.0) == [(0, 20.0)]
    (leg,) = mission.runner._record.log.robots["quad0"].legs
    assert (leg.reason, leg.time_s) == ("not reached in 100 s", 100.0)


def test_a_second_stop_keeps_the_time_of_the_first(mission):
    mission.begin()
    mission.fly(100.0)
    call("/mission/stop", 110.0)
    call("/mission/quad0/stop", 200.0)
    call("/mission/stop", 200.0)
    call("/mission/resume", 290.0)
    mission.fly(290.0)
    mission.fly(295.0, (10.0, 0.0), (10.0, 5.0))
    for robot in mission.runner._record.log.robots.values():
        assert [(leg.reached, leg.time_s) for leg in robot.legs] == [(True, 15.0)]


def test_a_summary_counts_no_time_of_a_stop(mission):
    mission.begin()
    mission.fly(100.0)
    call("/mission/quad0/stop", 110.0)
    mission.fly(150.0)
    first, second = (robot.legs[0].time_s for robot in mission.summary().robots)
    assert (first, second) == (10.0, 50.0)


def test_a_resumed_robot_stays_resumed_when_the_sequencer_restarts(mission):
    mission.begin()
    mission.fly(100.0)
    call("/mission/stop", 110.0)
    mission.fly(110.0)
    assert stopped(mission.ros) == [True, True, True]
    call("/mission/quad0/resume", 120.0)
    mission.fly(120.0)
    assert stopped(mission.ros) == [False, False, True]
    mission.begin(respawned=True)
    assert mission.fly(130.0) == [(0, 10.0)]
    assert [robot.is_stopped for robot in mission.runner.robots] == [False, True]
    assert stopped(mission.ros) == [False, False, True]
    # Each flew 10 s of its 100 s before the stop; quad0 goes on at 120 s, quad1 at 200 s.
    call("/mission/resume", 200.0)
    assert mission.fly(200.0) == [(1, 10.0)]
    assert mission.fly(209.9) == []
    assert mission.fly(210.0) == [(0, 20.0)]
    assert mission.fly(289.9) == []
    assert mission.fly(290.0) == [(1, 20.0)]


@pytest.mark.parametrize("place", [STARTS, ((10.0, 0.0), (10.0, 5.0))], ids=["flying", "staying"])
def test_the_journal_knows_who_is_stopped(mission, place):
    """Without the parameters, after the ROS master has died too."""
    goals = [{"x": 10.0, "y": y_m, "wait_s": 60.0} for y_m in (0.0, 5.0)]
    mission = Mission(mission.ros, mission._folder, goals)
    mission.begin()
    mission.fly(100.0)
    mission.fly(101.0, *place)
    call("/mission/stop", 110.0)
    mission.fly(110.0, *place)
    call("/mission/quad1/resume", 120.0)
    mission.fly(120.0, *place)
    mission.ros._parameters.clear()
    mission.begin(resume=True)
    mission.fly(130.0, *place)
    assert [robot.is_stopped for robot in mission.runner.robots] == [True, False]
    assert stopped(mission.ros) == [False, True, False]
    assert any("/mission/quad0/resume" in line for line in mission.ros.log.lines)


def test_a_stop_that_a_person_sets_for_a_dead_sequencer(mission):
    mission.begin()
    mission.fly(100.0)
    mission.ros._parameters["/mission/stopped"] = True
    mission.begin(respawned=True)
    assert mission.fly(110.0) == []
    call("/mission/quad0/resume", 110.0)
    mission.begin(respawned=True)
    assert mission.fly(120.0) == [(0, 10.0)]


def test_a_new_mission_forgets_stops(mission):
    mission.begin()
    mission.fly(100.0)
    call("/mission/stop", 100.0)
    mission.begin()
    assert mission.fly(110.0) == [(0, 10.0), (1, 10.0)]
    assert stopped(mission.ros) == [False, False, False]


def test_what_was_reported_on_a_cancelled_goal_does_not_skip_it(mission):
    """The navigator reports the cancellation; no step takes the report before the resumption."""
    mission.begin()
    mission.fly(100.0)
    call("/mission/stop", 100.0)
    for robot in mission.runner.robots:
        robot.link._inbox.reports.append(NavigatorReport(Verdict.CANCELLED))
    call("/mission/resume", 110.0)
    assert mission.fly(110.0) == [(0, 10.0), (1, 10.0)]
    assert [robot.sequencer.index for robot in mission.runner.robots] == [0, 0]


def test_a_step_that_a_stop_meets_sends_no_goal(mission, monkeypatch):
    mission.begin()
    record = mission.runner._record
    add_actions = record.add_actions

    def slow(*arguments):
        for robot in mission.runner.robots:
            robot.is_stopped = True  # `/mission/stop` waits for the step, but not for long
        return add_actions(*arguments)

    monkeypatch.setattr(record, "add_actions", slow)
    assert mission.fly(100.0) == []
    monkeypatch.setattr(record, "add_actions", add_actions)
    call("/mission/resume", 110.0)
    assert mission.fly(110.0) == [(0, 10.0), (1, 10.0)]


def test_a_stop_during_a_resumption_cancels_at_once_and_lasts(mission):
    mission.begin()
    mission.fly(100.0)
    cancelled = threading.Event()
    FakePublisher.all["/move_base0/cancel"].publish = lambda _: cancelled.set()
    robot = mission.runner.robots[0]
    with mission.runner._stop._lock:  # a resumption is under way
        thread = threading.Thread(target=call, args=("/mission/quad0/stop", 110.0))
        thread.start()
        assert cancelled.wait(10.0)
        cancelled.clear()
        robot.release(110.0)
    thread.join()
    assert robot.is_stopped and cancelled.is_set()
    assert mission.fly(120.0) == []


def test_a_goal_that_a_stop_overtakes_is_cancelled_by_its_id(mission):
    """It reaches the navigator after the cancel of all; a goal of a person is left alone."""
    mission.begin()
    mission.fly(100.0)
    call("/mission/stop", 100.0)
    cancels = FakePublisher.all["/move_base0/cancel"]
    assert cancels.last == GoalID()
    late, persons = (
        GoalID(rospy.Time.from_sec(s), name) for s, name in ((100.1, "a"), (100.2, "b"))
    )
    for unfinished in ([late], [late, persons], [persons]):
        statuses = [GoalStatus(one, GoalStatus.ACTIVE, "") for one in unfinished]
        deliver("/move_base0/status", GoalStatusArray(status_list=statuses))
        cancels.last = None
        mission.fly(100.3)
        assert cancels.last == (late if late in unfinished else None)
