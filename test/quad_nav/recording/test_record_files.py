"""Files of recordings: refused, interrupted, on a full disk, and from the command line."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from click.testing import CliRunner
from recorded_flight import setup
from rosbags.rosbag1 import Reader
from size_limit import size_limit

from quad_nav.cli import main
from quad_nav.errors import InputError
from quad_nav.files.shipped import shipped
from quad_nav.mission.flight_log import INTERRUPTED
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.offline.run import fly
from quad_nav.recording.bag_file import read_messages
from quad_nav.recording.record_file import create
from quad_nav.recording.recorder import Recorder
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.topics.flight_info import FLIGHT_TOPIC


def read(path, *topics):
    return list(read_messages(path, lambda topic, kind: topic in topics))


@pytest.mark.parametrize(
    "name, problem",
    [
        ("flight.mcap", "expected a name that ends with .bag$"),
        ("file/flight.bag", "cannot write the recording: "),
        ("folder.bag", "is a folder"),
    ],
)
def test_a_file_that_cannot_be_made_is_refused_at_once(tmp_path, name, problem):
    (tmp_path / "file").write_text("", encoding="utf-8")
    (tmp_path / "folder.bag").mkdir()
    with pytest.raises(InputError, match=problem):
        Recorder(tmp_path / name)


def test_an_older_recording_stays_until_the_new_one_is_complete(tmp_path):
    path = tmp_path / "flight.bag"
    path.write_bytes(b"older")
    flight = Flight(setup(tmp_path), [Recorder(path)])
    flight.advance()
    assert path.read_bytes() == b"older"
    flight.end("enough")
    assert len(read(path, "/odom0")) == 2
    assert read(path, FLIGHT_TOPIC)[-1].content.reason == "enough"
    assert not path.with_name("flight.bag.active").exists()


class Stop(FlightObserver):
    """Ends the flight at once, as Ctrl-C does, or fails."""

    stop_reason = ""

    def __init__(self, fails):
        self._fails = fails

    def on_move(self, flight):
        if self._fails:
            raise ZeroDivisionError
        self.stop_reason = INTERRUPTED


@pytest.mark.parametrize(
    "fails, reason", [(False, INTERRUPTED), (True, "ended by ZeroDivisionError")]
)
def test_a_flight_that_ends_early_leaves_a_recording(tmp_path, fails, reason):
    path = tmp_path / "flight.bag"
    with contextlib.suppress(ZeroDivisionError):
        summary = fly(setup(tmp_path), [Recorder(path), Stop(fails)])
        assert (fails, summary.reason, summary.success) == (False, INTERRUPTED, False)
    assert read(path, FLIGHT_TOPIC)[-1].content.reason == reason


def test_a_full_disk_ends_the_flight_and_what_was_recorded_is_readable(tmp_path):
    path = tmp_path / "flight.bag"
    long_flight = read_setup(FlightOptions(shipped("scenes", "arena.yaml"), shipped("goals")))
    with size_limit(500_000):
        summary = fly(long_flight, [Recorder(path)])
    assert summary.reason == "cannot write the recording: File too large"
    assert summary.exit_status == 1
    assert path.stat().st_size <= 500_000
    assert 40 < len(read(path, "/odom0")) < summary.sim_time_s * 40


def test_a_disk_that_is_full_at_the_end_is_reported(tmp_path):
    path, whole = tmp_path / "flight.bag", tmp_path / "whole.bag"
    fly(setup(tmp_path), [Recorder(whole)])
    with size_limit(whole.stat().st_size - 100):
        summary = fly(setup(tmp_path), [Recorder(path)])
    assert all(robot.reached == len(robot.legs) for robot in summary.robots)
    assert summary.reason == "cannot write the recording: File too large"
    assert len(read(path, "/odom0")) > 40


def noise_bag(path, size):
    """Writes until the limit is hit: a message of 1.05 MB that does not compress to a chunk."""
    noise = np.random.default_rng(0).bytes(1_050_000)
    data = len(noise).to_bytes(4, "little") + noise
    file = create(path)
    with size_limit(size):
        topic = file.add_topic("/noise", "std_msgs/String", False, "/test")
        with pytest.raises(OSError):
            for k in range(1, 9):
                file.write(topic, k * 10**9, data)
        with pytest.raises(OSError):
            file.close()
    with Reader(path) as reader:
        found = [(stamp, bytes(content)) for _, stamp, content in reader.messages()]
    assert all(content == data for _, content in found)
    return [stamp // 10**9 for stamp, _ in found]


def test_as_many_chunks_stay_as_there_is_room_for(tmp_path):
    path = tmp_path / "flight.bag"
    assert noise_bag(path, 3_300_000) == [1, 2, 3]
    size = path.stat().st_size
    assert noise_bag(path, size) == [1, 2, 3]
    assert noise_bag(path, size - 1) == [1, 2]  # no room for the index of three


def test_a_flight_without_room_for_anything_gives_the_reason(tmp_path):
    path = tmp_path / "flight.bag"
    with size_limit(5_000):
        summary = fly(setup(tmp_path, time_limit_s=0.1), [Recorder(path)])
    assert summary.reason == (
        "time limit of 0.1 s; cannot write the recording: no room for a single chunk"
    )
    assert not path.exists()


def test_the_command_records(tmp_path):
    path = tmp_path / "flights" / "flight.bag"
    result = CliRunner().invoke(main, ["fly", "-q", "--time-limit", "0.5", "--record", str(path)])
    assert result.exit_code == 1  # the time was not enough for the goals
    assert len(read(path, "/odom0")) == 21
