"""Restart a sequencer: on a clock that the test sets; and what its threads do at the same time."""

from __future__ import annotations

import json
import threading
from dataclasses import replace

import pytest

rospy = pytest.importorskip("rospy")

from ros.fake_mission import TAKE_OFF, Mission, call  # noqa: E402
from ros.fake_ros import FakePublisher, FakeRos  # noqa: E402

from quad_nav.mission.sequencer import Sequencer  # noqa: E402
from quad_nav.ros.sequencer.mission import _pop_change  # noqa: E402
from quad_nav.sim.contacts import Contact  # noqa: E402


@pytest.fixture
def ros():
    with FakeRos("/sequencer") as fake:
        yield fake


@pytest.fixture
def mission(ros, tmp_path):
    return Mission(ros, tmp_path)


@pytest.mark.parametrize("restart", [{"respawned": True}, {"resume": True}], ids=str)
@pytest.mark.parametrize("state", ["not ready", "ready", "landed", "landing"])
def test_a_restart_takes_nothing_off(mission, restart, state):
    mission.begin()
    assert mission.called == [TAKE_OFF]
    mission.fly(100.0)
    mission.called = []
    mission.begin(states=(state, "flying"), **restart)
    assert mission.called == []
    assert mission.fly(110.0) == [(1, 10.0)]
    assert [robot.is_stopped for robot in mission.runner.robots] == [True, False]
    (line,) = [line for line in mission.ros.log.lines if "/vehicle0/take_off" in line]
    assert line.startswith("quad0: ") and "/vehicle0/resume" in line
    call("/mission/quad0/resume", 300.0)  # as that of the vehicle does
    assert mission.fly(300.0) == [(0, 10.0), (1, 20.0)]


def test_a_restart_during_the_take_off_takes_nothing_off(mission):
    """The first sequencer was killed while it waited for the vehicles: no goal was sent."""
    mission.begin()
    mission.called = []
    mission.begin(respawned=True, states=("ready", "taking off"))
    assert mission.called == []
    assert mission.fly(100.0) == [(1, 10.0)]


def test_a_restart_after_the_last_goal_ends_the_mission(mission):
    """The first sequencer was killed while the vehicles landed."""
    mission.begin()
    mission.fly(100.0)
    for now_s, x_m in ((110.0, 10.0), (120.0, 20.0)):
        mission.fly(now_s, (x_m, 0.0), (x_m, 5.0))
    assert mission.runner.is_done
    mission.called = []
    mission.begin(respawned=True, states=("landing", "landed"))
    mission.fly(130.0)
    assert mission.runner.is_done
    assert [robot.is_stopped for robot in mission.runner.robots] == [False, False]
    assert mission.called == []


def test_a_stopped_mission_that_has_ended_stays_ended(mission):
    mission.begin()
    mission.fly(100.0)
    for now_s, x_m in ((110.0, 10.0), (120.0, 20.0)):
        mission.fly(now_s, (x_m, 0.0), (x_m, 5.0))
    call("/mission/stop", 130.0)
    mission.fly(130.0)
    mission.begin(respawned=True)
    mission.fly(140.0)
    assert mission.runner.is_done


def test_a_clock_that_goes_back_takes_nothing_off(mission):
    mission.begin()
    mission.fly(100.0)
    mission.called = []
    mission.runner._watch_clock(100.0)
    mission.ros.set_time(50.0)
    mission.runner._watch_clock(50.0)
    assert mission.called == []
    assert mission.fly(50.0) == [(0, 10.0), (1, 10.0)]


@pytest.mark.parametrize(("stopped_s", "resumed_s"), [(50.0, 50.0), (50.0, 70.0), (110.0, 50.0)])
def test_a_clock_that_goes_back_at_a_stop_keeps_the_times(mission, stopped_s, resumed_s):
    mission.begin()
    mission.fly(100.0)
    mission.fly(110.0)
    mission.runner._watch_clock(110.0)
    call("/mission/stop", stopped_s)  # the main thread has not noticed yet
    if resumed_s == 50.0:
        call("/mission/resume", 50.0)
    mission.runner._watch_clock(50.0)
    if resumed_s > 50.0:
        call("/mission/resume", resumed_s)
    mission.fly(resumed_s)
    mission.fly(resumed_s + 5.0, (10.0, 0.0), (10.0, 5.0))
    for robot in mission.runner._record.log.robots.values():
        assert [leg.time_s for leg in robot.legs] == [15.0]


def test_the_journal_knows_of_a_stop_while_the_clock_goes_back(mission):
    mission.begin()
    mission.fly(100.0)
    mission.fly(110.0)
    mission.runner._watch_clock(110.0)
    call("/mission/stop", 50.0)
    mission.runner._watch_clock(50.0)
    mission.fly(60.0)
    mission.begin(respawned=True)
    call("/mission/resume", 70.0)
    mission.fly(75.0, (10.0, 0.0), (10.0, 5.0))
    for robot in mission.runner._record.log.robots.values():
        assert [leg.time_s for leg in robot.legs] == [15.0]


def test_a_restart_does_not_wait_for_what_is_stopped(mission):
    """Such as a vehicle that its pilot has landed and switched off."""
    mission.begin()
    mission.fly(100.0)
    every = len(mission.runner.needs())
    call("/mission/quad1/stop", 100.0)
    mission.begin(respawned=True)
    needs = mission.runner.needs()
    assert len(needs) == 1 + (every - 1) / 2  # the service, and what quad0 needs
    assert mission.fly(110.0) == [(0, 10.0)]


def test_a_simulation_that_is_resumed_is_started(mission):
    mission = Mission(mission.ros, mission._folder, simulation=True, start_service="")
    mission.begin()
    mission.fly(100.0)
    mission.begin(respawned=True, states=())
    assert mission.called == ["/simulation/start"] * 2


class ChangesMeanwhile:
    """A robot's thread whose goals change just after the main thread has looked for a change."""

    def __init__(self):
        self._looks, self._is_changed = 0, False

    @property
    def goals_changed(self):
        found, self._looks = self._is_changed, self._looks + 1
        self._is_changed |= self._looks == 1
        return found

    @goals_changed.setter
    def goals_changed(self, is_changed):
        self._is_changed = is_changed


def test_no_change_of_the_goals_is_lost():
    thread = ChangesMeanwhile()
    assert [_pop_change(thread) for _ in range(3)] == [False, True, False]


def test_an_edited_file_is_compared_with_the_planner_again(ros, tmp_path):
    mission = Mission(ros, tmp_path, [[1.0, 1.0]], config="default").begin()
    (tmp_path / "quad0_goals.json").write_text('{"goals": [[1, 1]], "goal_tolerance": 0.001}')
    robot = mission.runner.robots[0]
    for _ in range(2):  # an editor may be writing it at the first time
        robot._next_poll_s = 0.0
        robot.poll_file()
    (line,) = [line for line in ros.log.lines if "xy_goal_tolerance" in line]
    assert "quad0_goals.json: a tolerance of 0.001 m is below the local planner's" in line


def test_goals_are_published_while_a_file_with_fewer_goals_is_read(mission):
    mission.begin()
    robot = mission.runner.robots[0]
    whole = robot.sequencer.sequence

    class Edited(Sequencer):
        """A sequencer whose goals are replaced after its thread has looked at them once."""

        @property
        def sequence(self):
            self._sequence = replace(whole, goals=whole.goals[:1]) if self._looked else whole
            self._looked = True
            return self._sequence

        _looked = False

    robot.sequencer = Edited(whole)
    robot.sequencer._looked = False
    mission.runner._publish_goals()


def test_the_diagnostics_of_a_stay_that_ends_meanwhile(mission):
    goals = [{"x": 0.0, "y": y_m, "wait_s": 60.0} for y_m in (0.0, 5.0)]
    mission = Mission(mission.ros, mission._folder, goals)
    mission.begin()
    mission.fly(100.0)
    mission.fly(101.0)

    class Leaving(Sequencer):
        """A sequencer whose stay ends after the main thread has looked at it once."""

        @property
        def dwell(self):
            found, self._dwell = self._dwell, None
            return found

    robot = mission.runner.robots[0]
    robot.sequencer.__class__ = Leaving
    mission.runner.publish_progress()
    statuses = FakePublisher.all["/diagnostics"].last.status
    assert statuses[0].message == "staying at goal 1 of 2 for 60 s"


def test_a_contact_at_the_begin_of_a_mission_is_in_log_and_journal_or_in_neither(mission):
    mission.begin()
    mission.fly(100.0)
    record, contact = mission.runner._record, Contact(100.0, "quad0", "wall", 1.0, 2.0)
    begin, threads = record.journal.begin, []

    def begin_slowly(now_s):
        threads.append(threading.Thread(target=record.add_contact, args=(contact, 100.0)))
        threads[0].start()
        threads[0].join(0.2)  # it waits for the lock, or is done before
        return begin(now_s)

    record.journal.begin = begin_slowly
    record.begin(100.0)
    threads[0].join()
    record.journal.wait(patience_s=10.0)
    lines = (mission._folder / "journal.jsonl").read_text().splitlines()
    in_journal = [json.loads(line)["contact"] for line in lines if "contact" in json.loads(line)]
    assert len(in_journal) == len(record.log.contacts) == 1


def test_times_are_not_negative_after_the_clock_has_gone_back(mission):
    """The steps of the robots may be later than the main thread's last look at the clock."""
    mission.begin()
    mission.runner._watch_clock(99.8)
    mission.fly(100.0)
    mission.ros.set_time(50.0)
    mission.runner._watch_clock(50.0)
    mission.fly(50.0, (10.0, 0.0), (10.0, 5.0))
    for robot in mission.runner._record.log.robots.values():
        assert [leg.time_s for leg in robot.legs] == [0.0]
