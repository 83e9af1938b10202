"""The player of recordings on a page."""

from __future__ import annotations

import math

import numpy as np
import pytest
from click.testing import CliRunner
from hand_made_recording import LAST_S, write_flight, x_at

from quad_nav.cli import main
from quad_nav.sim.scene import BODY_RADIUS_M
from quad_web.replay import replay as replay_module
from quad_web.replay.replay import FASTEST, Replay
from quad_web.view.actions import Answer
from quad_web.view.state import LAYERS, FleetState, Wanted


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write_flight(tmp_path_factory.mktemp("replay") / "flight.bag")


class Clock:
    """Wall clock that stands."""

    now_s = 50.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def player(path):
    state, clock = FleetState(), Clock()
    replay = Replay(path, state, clock)
    replay.read()
    yield replay, state, clock
    replay.release()


def step(player, wall_s: float = 0.0):
    """Let wall time pass, and return time and state of the flight."""
    replay, state, clock = player
    clock.now_s += wall_s
    replay.step()
    data = state.item("flight").data
    return round(data["time_s"], 6), data["state"]


def watch(player):
    player[1].add_client(Wanted(frozenset(LAYERS), 0))
    return step(player)


def test_it_plays_from_when_a_page_is_open(player):
    step(player)
    assert step(player, 5.0) == (0.0, "running")
    assert watch(player) == (0.0, "running")
    assert step(player, 2.0) == (2.0, "running")
    assert player[1].item("poses").data["stamp_s"] == 2.0


@pytest.mark.parametrize("rate, expected_s", [(0.1, 0.03), (4.0, 1.2), (0.0, 0.3 * FASTEST)])
def test_the_rate_is_seconds_of_the_recording_per_second(player, rate, expected_s):
    watch(player)
    assert player[0].set_rate(rate).ok
    assert step(player, 0.3) == (pytest.approx(expected_s), "running")


@pytest.mark.parametrize("rate", [-1.0, 1e9, 1e-9, math.nan])
def test_other_rates_are_refused(player, rate):
    answer = player[0].set_rate(rate)
    assert not answer.ok and "expected 0, or 0.01 to 1000" in answer.text


def test_pause_seek_and_the_end(player):
    replay, state, _ = player
    watch(player)
    assert replay.pause().ok
    assert step(player, 3.0) == (0.0, "paused")
    assert replay.seek(12.5).ok
    assert step(player, 3.0) == (12.5, "paused")
    assert state.item("poses").arrays["pose"][0, 0] == pytest.approx(x_at(12.5))
    assert replay.start().ok
    assert step(player, 1.0) == (13.5, "running")
    assert replay.seek(3.0).ok
    assert step(player, 1.0) == (3.0, "running")
    assert replay.seek(1e9).ok
    assert step(player) == (LAST_S, "ended")
    assert step(player, 9.0) == (LAST_S, "ended")
    assert replay.start().ok  # from the start again
    assert step(player) == (0.0, "running")
    assert not replay.seek(math.nan).ok


def samples_of(state):
    """Return the samples that a new client gets."""
    (item,) = [one for one in state.changes(Wanted(), {}).items if one.key == "samples"]
    return {"times": [], **item.arrays}


def test_a_fast_replay_has_samples_of_the_time_between_two_steps(player):
    _, state, _ = player
    watch(player)
    step(player)
    first_s = state.item("samples").data["time_s"]
    step(player, 5.0)
    np.testing.assert_allclose(samples_of(state)["times"][1:], first_s + np.arange(0.1, 4.95, 0.1))


def test_after_a_jump_the_charts_have_the_minute_before(player):
    replay, state, _ = player
    watch(player)
    replay.seek(15.0)
    step(player)
    assert samples_of(state)["times"].tolist() == [0.0]
    step(player)  # nobody has jumped again
    arrays = samples_of(state)
    np.testing.assert_allclose(arrays["times"], np.arange(0.0, 15.0))
    gaps_m = 8.0 - (1.0 + 0.3 * arrays["times"]) - 2 * BODY_RADIUS_M
    np.testing.assert_allclose(arrays["history"][:, 0, 0], gaps_m, atol=1e-5)


def test_what_nobody_shows_is_not_there(player):
    replay, state, _ = player
    client = state.add_client(Wanted(frozenset({"local_costmap"}), 0))
    replay.seek(5.0)
    step(player)
    assert state.item("local_costmap/0") is not None and state.item("trail/0") is None
    state.set_wanted(client, Wanted(frozenset({"trail"}), 0))
    step(player, 0.1)
    assert state.item("local_costmap/0") is None and state.item("trail/0") is not None


def test_the_log_has_each_event_once(player):
    replay, state, _ = player
    watch(player)
    for time_s in (5.0, 1.0, 12.0, 5.0):
        replay.seek(time_s)
        step(player)
    assert [(event.time_s, event.text) for event in state.events()] == [
        (1.0, "goal 1: sent (4.00, 2.00)"),
        (10.0, "goal 1: reached after 9.0 s"),
        (10.0, "goal 2: sent (7.00, 2.00)"),
    ]


def test_while_the_file_is_read_the_page_says_how_far_it_is(path, monkeypatch):
    monkeypatch.setattr(replay_module, "_PROGRESS_PERIOD_S", 0.0)
    state, titles = FleetState(), []
    replay = Replay(path, state)
    state.add_listener(lambda: titles.append(state.item("flight").data["title"]))
    assert state.item("flight").data["state"] == "starting"
    assert replay.call("pause") == Answer(False, "pause: the recording is still being read")
    assert replay.call("goal_files") == []
    replay.read()
    shares = [int(title.split(", ")[1].rstrip("%")) for title in titles[:-1]]
    assert titles[0] == f"reading {path.name}, 0%" and titles[-1] == path.name
    assert len(shares) > 100 and shares == sorted(shares) and 95 < shares[-1] <= 100
    assert replay.call("seek", 1.0).ok and replay.call("pause").ok
    replay.step()
    assert state.item("flight").data["state"] == "paused"
    assert state.item("flight").data["time_s"] == 1.0
    replay.release()


def test_a_replay_steers_nothing(player):
    assert not player[0].call("stop_all").ok and not player[0].call("cancel", 0).ok


@pytest.mark.parametrize(
    "name, content, problem",
    [
        ("missing.bag", None, "cannot be read: No such file"),
        ("text.bag", b"goals\n", "cannot read as a recording"),
    ],
)
def test_the_command_refuses_what_is_no_flight(tmp_path, name, content, problem):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    result = CliRunner().invoke(main, ["replay", str(path)])
    assert result.exit_code == 2
    assert f"no replay:\n  {path}: " in result.output and problem in result.output
