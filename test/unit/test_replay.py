"""Recordings on a page: the index, any time of a flight, and the player."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Optional

import numpy as np
import pytest
from click.testing import CliRunner

from quad_nav.cli import main
from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D, Pose3D, Scan, quaternion_from_yaw
from quad_nav.grid import GridSpec
from quad_nav.recording import messages
from quad_nav.recording import replay as replay_module
from quad_nav.recording.bag_file import read_messages
from quad_nav.recording.bag_index import RecordingIndex
from quad_nav.recording.record_file import TopicWriter, create, stamp_at
from quad_nav.recording.recorded_flight import RecordedFlight
from quad_nav.recording.replay import FASTEST, OpenedReplay, Replay
from quad_nav.sim.motion import Motion
from quad_nav.sim.scene import BODY_RADIUS_M, Box, MovingObstacle, Scene, Walls
from quad_nav.topics import flight_info
from quad_nav.topics.markers import CUBE, OBSTACLES_TOPIC, Marker
from quad_nav.view.actions import Answer
from quad_nav.view.state import LAYERS, FleetState, Wanted

SCENE = Scene(
    "room",
    10.0,
    8.0,
    1.0,
    Walls(),
    starts=(Pose2D(1.0, 2.0),),
    obstacles=(Box("b", 5.0, 7.0, 1.0, 1.0, 2.0),),
)
SUFFIXES = (".bag", ".mcap")
LAST_S = 20.0
SENT = {"yaw_rad": 0.0, "attempt": 1, "why": ""}


def x_at(time_s: float) -> float:
    """x of robot 0, which flies at 0.3 m/s; robot 1 stands at (8, 2)."""
    return 1.0 + 0.3 * time_s


def write_flight(path: Path, scene: Scene = SCENE, cart_y_m: Optional[float] = None) -> Path:
    """Write 20 s of two robots: a goal of 10 s, two scans per second, a costmap and updates.

    With ``cart_y_m`` there is the topic of moving obstacles, with one at (its time in s, this).
    """
    topics = TopicWriter(create(path))

    def write(topic, time_s, content, latched=False):
        topics.write(topic, stamp_at(time_s), content, "/node", latched)

    info = {
        **flight_info.simulation_info(scene, 3),
        "robot_radius_m": BODY_RADIUS_M,
        "robots": [
            {"name": "quad0", "goals": [[4.0, 2.0], [7.0, 2.0, 0.0]], "parameters": {}},
            {"name": "quad1", "goals": [[8.0, 2.0]], "parameters": {}},
        ],
    }
    write(flight_info.FLIGHT_TOPIC, 0.0, messages.text(flight_info.to_text(info)), True)
    spec = GridSpec(4, 3, 0.5, -1.0, -2.0)
    for step in range(int(LAST_S * 10) + 1):
        time_s = step / 10.0
        stamp = stamp_at(time_s)
        write("/clock", time_s, messages.clock(stamp))
        for robot, x_m in ((0, x_at(time_s)), (1, 8.0)):
            if robot == 1 and time_s > 15.0:
                continue  # lost
            frame = Pose3D(0.0, 1.0, 0.0)
            transform = messages.transform(frame, "map", f"odom{robot}", stamp)
            write("/tf", time_s, messages.message("tf2_msgs/TFMessage", [transform]))
            pose = Pose3D(x_m, 1.0, 1.0, quaternion_from_yaw(0.0))
            frames = (f"odom{robot}", f"base_link{robot}")
            speed = (0.3 if robot == 0 else 0.0, 0.0, 0.0)
            odometry = messages.odometry(pose, speed, (0.0, 0.0, 0.0), frames, stamp)
            write(f"/odom{robot}", time_s, odometry)
        if cart_y_m is not None and step % 10 == 0:
            cart = Marker("map", "moving", 0, CUBE, (time_s, cart_y_m, 1.0), (1, 1, 1), (1,) * 4)
            write(OBSTACLES_TOPIC, time_s, messages.marker_array([cart]))
        if step % 5 == 0:
            ranges = np.array([1.0, np.inf, 2.0 + time_s], np.float32)
            scan = Scan(time_s, 0.0, math.pi / 2, 0.02, 60.0, ranges)
            write("/scan0", time_s, messages.laser_scan(scan, "Lidar0", stamp))
        if step % 100 == 0:  # full grids at 0, 10 and 20 s, of free cells
            costs = np.zeros(spec.shape, np.uint8)
            grid = messages.occupancy_grid(spec, costs, "odom0", stamp)
            write("/move_base0/local_costmap/costmap", time_s, grid, True)
        elif step % 10 == 0:  # at second k, cell k % 4 of row k // 4 % 3 becomes lethal
            x0, y0 = (step // 10) % 4, (step // 40) % 3
            update = messages.grid_update(np.full((1, 1), 254, np.uint8), x0, y0, "odom0", stamp)
            write("/move_base0/local_costmap/costmap_updates", time_s, update)
    for event in (
        {"event": "sent", "goal": 0, "time_s": 2.0, "x_m": 4.0, "y_m": 2.0, **SENT},
        {"event": "ended", "time_s": 11.0, "reached": True, "attempts": 1, "reason": ""},
        {"event": "sent", "goal": 1, "time_s": 11.0, "x_m": 7.0, "y_m": 2.0, **SENT},
    ):
        event = {"robot": 0, "lap": 1, "yaw_error_rad": None, **event}
        write(flight_info.EVENTS_TOPIC, LAST_S, messages.text(flight_info.to_text(event)))
    topics.close()
    assert topics.problem == ""
    return path


@pytest.fixture(scope="module", params=SUFFIXES)
def path(request, tmp_path_factory):
    return write_flight(tmp_path_factory.mktemp("replay") / f"flight{request.param}")


@pytest.fixture
def flight(path):
    flight = RecordedFlight(path)
    yield flight
    flight.close()


def items_at(flight: RecordedFlight, time_s: float, layers=LAYERS) -> dict:
    """Return the layers of both robots at a time, by key."""
    parts = flight.parts(time_s, {layer: (0, 1) for layer in layers})
    made = {key: make() for key, (_, make) in parts.items()}
    present = {item.key: item for item in flight.present_items(time_s)}
    return {**present, **{key: item for key, item in made.items() if item is not None}}


def costs_of(*cells) -> np.ndarray:
    costs = np.zeros((3, 4), np.int8)
    for second in cells:
        costs[second // 4 % 3, second % 4] = 100
    return costs


# -- index -----------------------------------------------------------------------------------


STREET = replace(
    SCENE,
    moving=(
        MovingObstacle(
            Box("cart", 1.0, 6.0, 1.0, 1.0, 2.0),
            Motion((0.0, 20.0), ((1.0, 6.0, 0.0), (5.0, 6.0, 0.0))),
        ),
    ),
)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize(
    "cart_y_m, expected, nearest_m",
    [(None, (3.1, 6.0, 0.0), 2.0), (2.0, (10.0, 2.0, 0.0), 1.5)],
    ids=["computed from the scene", "recorded"],
)
def test_moving_obstacles_are_where_they_were(tmp_path, suffix, cart_y_m, expected, nearest_m):
    """At 10.5 s the cart, at 0.2 m/s, is 2.1 m on; its last message is of 10 s.

    Robot 1 is at (8, 2): 2 m from two walls, and 1.5 m from the cart that was recorded.
    """
    flight = RecordedFlight(write_flight(tmp_path / f"flight{suffix}", STREET, cart_y_m))
    before, poses = items_at(flight, 2.0), items_at(flight, 10.5)["obstacles"].arrays["poses"]
    assert poses.tolist() == [pytest.approx(expected)]
    assert before["obstacles"].arrays["poses"][0, 0] < poses[0, 0]
    assert "obstacles" not in items_at(flight, 10.5)  # it stands
    clearance_m = flight.sample(10.5).arrays["values"][1, 1]
    assert clearance_m == pytest.approx(nearest_m - BODY_RADIUS_M)
    flight.close()


def test_the_index_reads_any_message_and_no_other(path):
    wanted = ("/scan0", "/move_base0/local_costmap/costmap_updates")
    index = RecordingIndex(path, lambda topic, kind: topic in wanted)
    assert set(index.kinds) == set(wanted)
    for topic in wanted:
        in_order = list(read_messages(path, lambda name, _, wanted=topic: name == wanted))
        times = index.times_ns(topic)
        assert times.tolist() == [one.stamp_ns for one in in_order]
        for number in (len(times) - 1, 0, 7, 8, 3):
            found, expected = index.read(topic, number), in_order[number]
            assert (found.stamp_ns, found.kind) == (expected.stamp_ns, expected.kind)
            assert messages.encode(found.content) == messages.encode(expected.content)
    index.close()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_damaged_and_truncated_files_get_the_messages_of_the_report(tmp_path, suffix):
    good = write_flight(tmp_path / f"flight{suffix}").read_bytes()
    for name, content in {"empty": b"", "half": good[: len(good) // 2], "text": b"#!x\n"}.items():
        path = tmp_path / f"{name}{suffix}"
        path.write_bytes(content)
        texts = []
        for read in (
            lambda path: list(read_messages(path, lambda topic, kind: True)),
            lambda path: RecordingIndex(path, lambda topic, kind: True),
            RecordedFlight,
        ):
            with pytest.raises(InputError) as error:
                read(path)
            texts.append(str(error.value))
        assert len(set(texts)) == 1 and texts[0].startswith(str(path))


# -- any time of a flight --------------------------------------------------------------------


def test_poses_lie_between_the_samples(flight):
    assert (flight.start_s, flight.end_s) == (0.0, LAST_S)
    pose = items_at(flight, 7.05)["poses"].arrays["pose"]
    np.testing.assert_allclose(pose[0], [x_at(7.05), 2, 1, 0, 0, 0, 0.3, 0, 0], atol=1e-6)
    np.testing.assert_allclose(pose[1], [8, 2, 1, 0, 0, 0, 0, 0, 0], atol=1e-6)


def test_goals_have_their_state_at_the_time(flight):
    def states(time_s):
        goals = items_at(flight, time_s)["goals"].data["goals"]
        return [(goal["robot"], goal["x"], goal["state"]) for goal in goals]

    assert states(0.5) == [(0, 4.0, "pending"), (0, 7.0, "pending"), (1, 8.0, "pending")]
    assert states(5.0)[:2] == [(0, 4.0, "active"), (0, 7.0, "pending")]
    assert states(12.0)[:2] == [(0, 4.0, "reached"), (0, 7.0, "active")]


def test_rows_and_samples_are_those_of_the_time(flight):
    items = items_at(flight, 6.0)
    first, second = items["status"].data["rows"]
    assert (first["state"], first["goal"], first["goals"]) == ("flying", 1, 2)
    assert first["distance_m"] == pytest.approx(4.0 - x_at(6.0))
    gap_m = 8.0 - x_at(6.0) - 2 * BODY_RADIUS_M
    assert first["gap_m"] == second["gap_m"] == pytest.approx(gap_m, abs=1e-5)
    gap, clearance, speed, cycle = items["samples"].arrays["values"][0]
    # The wall at y = 0 is 2 m away.
    assert (gap, clearance) == pytest.approx((gap_m, 2.0 - BODY_RADIUS_M), abs=1e-5)
    assert speed == pytest.approx(0.3) and math.isnan(cycle)
    late = items_at(flight, 18.0)["status"].data["rows"][1]
    assert late["state"] == "lost" and late["age_s"] == pytest.approx(3.0)


@pytest.mark.parametrize(
    "time_s, cells",
    [
        (0.0, ()),
        (3.5, (1, 2, 3)),
        (9.95, range(1, 10)),
        (10.0, ()),  # a full grid
        (13.0, (11, 12, 13)),
        (2.0, (1, 2)),
        (20.0, ()),
    ],
)
def test_a_costmap_is_the_last_full_grid_and_the_updates_since(flight, time_s, cells):
    for order in ((time_s,), (19.0, 4.0, time_s), (time_s, time_s)):
        for at_s in order:
            item = items_at(flight, at_s, ["local_costmap"])["local_costmap/0"]
        np.testing.assert_array_equal(item.arrays["costs"], costs_of(*cells))
    # The grid's corner is at (-1, -2) in odom0, which is at (0, 1) in map.
    assert (item.data["x"], item.data["y"], item.data["resolution_m"]) == (-1.0, -1.0, 0.5)


def test_a_costmap_without_time_goes_on_where_it_stopped(flight):
    parts = flight.parts(9.5, {"local_costmap": (0,)}, lambda: False)
    make = parts["local_costmap/0"][1]
    made = [make() for _ in range(9)]
    assert made[:8] == [None] * 8  # one update at a time
    np.testing.assert_array_equal(made[8].arrays["costs"], costs_of(*range(1, 10)))


def test_a_scan_is_shown_where_it_was_taken_and_until_it_is_old(flight):
    points = items_at(flight, 7.3, ["scan"])["scan/0"].arrays["points"]  # of 7.0 s
    x_m = x_at(7.0)
    np.testing.assert_allclose(points[:, :2], [[x_m + 1, 2], [x_m - 9.0, 2]], atol=1e-5)
    assert "scan/1" not in items_at(flight, 7.3, ["scan"])


def test_a_trail_ends_at_the_robot(flight):
    trail = items_at(flight, 10.0, ["trail"])["trail/0"].arrays["points"]
    assert trail[0].tolist() == [1.0, 2.0]
    assert x_at(10.0) - 0.13 <= trail[-1, 0] <= x_at(10.0) + 1e-6
    assert np.diff(trail[:, 0]).min() >= 0.1 - 1e-6


# -- player ----------------------------------------------------------------------------------


class Clock:
    """Wall clock that stands."""

    now_s = 50.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def player(flight):
    state, clock = FleetState(), Clock()
    return Replay(flight, state, clock), state, clock


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


def test_after_a_jump_the_charts_have_the_minute_before(player):
    replay, state, _ = player
    watch(player)
    replay.seek(15.0)
    step(player)
    assert "times" not in state.item("samples").arrays
    step(player)  # nobody has jumped again
    arrays = state.item("samples").arrays
    np.testing.assert_allclose(arrays["times"], np.arange(1.0, 15.0))
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
    replay = OpenedReplay(path, state)
    state.add_listener(lambda: titles.append(state.item("flight").data["title"]))
    assert state.item("flight").data["state"] == "starting"
    assert replay.pause() == Answer(False, "pause: the recording is still being read")
    player = replay.read()
    shares = [int(title.split(", ")[1].rstrip("%")) for title in titles[:-1]]
    assert titles[0] == f"reading {path.name}, 0%" and titles[-1] == path.name
    assert len(shares) > 100 and shares == sorted(shares) and 95 < shares[-1] <= 100
    assert replay.seek(1.0).ok and replay.pause().ok
    player.step()
    assert state.item("flight").data["state"] == "paused"
    assert state.item("flight").data["time_s"] == 1.0


def test_a_replay_steers_nothing(player):
    assert not player[0].stop_all().ok and not player[0].cancel(0).ok
    assert "stop_all" not in player[0].available


@pytest.mark.parametrize(
    "name, content, problem",
    [
        ("missing.bag", None, "cannot be read: No such file"),
        ("text.bag", b"goals\n", "cannot read as a recording"),
        ("text.mcap", b"goals\n", "expected a recorded flight"),
    ],
)
def test_the_command_refuses_what_is_no_flight(tmp_path, name, content, problem):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    result = CliRunner().invoke(main, ["replay", str(path)])
    assert result.exit_code == 2
    assert f"no replay:\n  {path}: " in result.output and problem in result.output
