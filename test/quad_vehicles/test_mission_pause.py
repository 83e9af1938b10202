"""A vehicle's bridge stops and resumes the mission of its robot, again until it is done."""

from __future__ import annotations

import pytest

rospy = pytest.importorskip("rospy")

from ros.fake_ros import FakeRos  # noqa: E402
from std_srvs.srv import TriggerResponse  # noqa: E402

from quad_vehicles.ros.topics import MissionPause  # noqa: E402

STOP, RESUME = "/mission/quad0/stop", "/mission/quad0/resume"
STOPPED = "/mission/quad0/stopped"


class Sequencer:
    """The services of a sequencer, or none.

    Attributes:
        ros: Parameters and log.
        is_there: Whether a sequencer runs.
        calls: What it was asked for.
        meanwhile: Called once, during the next call.
    """

    def __init__(self, ros):
        self.ros, self.is_there, self.calls, self.meanwhile = ros, True, [], None

    def start(self):
        """A sequencer starts with a new mission, which knows of no stop."""
        self.is_there, self.ros._parameters[STOPPED] = True, False

    def wait(self, service, timeout_s):
        if not self.is_there:
            raise rospy.ROSException(f"timeout exceeded while waiting for service {service}")

    def respond(self, service):
        self.calls.append(service)
        self.ros._parameters[STOPPED] = service == STOP
        meanwhile, self.meanwhile = self.meanwhile, None
        if meanwhile is not None:
            meanwhile()
        return TriggerResponse(True, "done")


@pytest.fixture
def ros(monkeypatch):
    with FakeRos("/vehicle0") as fake:
        monkeypatch.setattr(rospy, "is_shutdown", lambda: True)  # the test calls, no thread
        yield fake


@pytest.fixture
def sequencer(ros, monkeypatch):
    made = Sequencer(ros)
    monkeypatch.setattr(rospy, "wait_for_service", made.wait)
    monkeypatch.setattr(rospy, "ServiceProxy", lambda name, _: lambda: made.respond(name))
    return made


def test_a_stop_is_delivered_once(sequencer):
    pause = MissionPause(0)
    pause.pause()
    assert [pause.deliver() for _ in range(3)] == [True, True, True]
    assert sequencer.calls == [STOP]


@pytest.mark.parametrize(("ask", "service"), [("pause", STOP), ("resume", RESUME)])
def test_what_could_not_be_delivered_is_tried_again_until_it_is(sequencer, ask, service):
    pause = MissionPause(0)
    sequencer.is_there = False
    getattr(pause, ask)()
    assert [pause.deliver() for _ in range(5)] == [False] * 5
    warnings = [line for line in sequencer.ros.log.lines if service in line]
    assert len(warnings) == 1 and "tries again" in warnings[0]
    sequencer.start()
    assert pause.deliver()
    assert sequencer.calls == [service]
    assert pause.deliver()
    assert sequencer.calls == [service]


def test_the_last_word_counts(sequencer):
    pause = MissionPause(0)
    sequencer.is_there = False
    pause.pause()
    pause.deliver()
    pause.resume()
    sequencer.start()
    assert pause.deliver()
    assert sequencer.calls == [RESUME]
    pause.resume()
    sequencer.meanwhile = pause.pause  # taken over again before the sequencer has responded
    pause.deliver()
    pause.deliver()
    assert sequencer.calls == [RESUME, RESUME, STOP]


def test_a_sequencer_that_starts_later_hears_that_the_vehicle_is_taken_over(sequencer):
    is_taken_over = True
    pause = MissionPause(0, lambda: is_taken_over)
    pause.pause()
    pause.deliver()
    pause.deliver()
    assert sequencer.calls == [STOP]
    sequencer.start()  # another mission
    pause.deliver()
    assert sequencer.calls == [STOP, STOP]
    is_taken_over = False
    pause.resume()
    for _ in range(2):
        pause.deliver()
    assert sequencer.calls == [STOP, STOP, RESUME]


def test_a_refusal_is_tried_again(sequencer, monkeypatch):
    pause = MissionPause(0, lambda: True)
    pause.pause()
    with monkeypatch.context() as patched:
        patched.setattr(sequencer, "respond", lambda _: TriggerResponse(False, "busy"))
        assert not pause.deliver()
    (line,) = sequencer.ros.log.lines
    assert line == f"{STOP}: busy; tries again until it succeeds"
    assert pause.deliver()
    assert sequencer.calls == [STOP]


def test_a_master_that_fails_is_asked_again(sequencer, monkeypatch):
    pause = MissionPause(0, lambda: True)

    def refuse(*_):
        raise ConnectionRefusedError("no master")

    with monkeypatch.context() as patched:
        patched.setattr(rospy, "get_param", refuse)
        assert not pause.deliver()
    assert pause.deliver()
    assert sequencer.calls == [STOP]
