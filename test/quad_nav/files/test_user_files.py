"""Files that somebody else has made: what they may be, how large, and where they may lead."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from quad_nav.config.files import load_files
from quad_nav.errors import MAX_PROBLEMS, InputError
from quad_nav.files.user_files import open_file, read_bytes, read_text, referenced_file
from quad_nav.geometry import Pose3D
from quad_nav.mission.goal_file import MAX_BYTES, MAX_GOALS, load_goals, parse_goals
from quad_nav.mission.robot_goals import WatchedGoalFile
from quad_nav.recording import bag_trace, messages
from quad_nav.recording.bag_trace import read_trace
from quad_nav.recording.record_file import create
from quad_nav.sim.scene_file import load_scene
from quad_nav.topics.flight_info import FlightInfo

READERS = {
    "goals.json": load_goals,
    "scene.yaml": load_scene,
    "place.world": load_scene,
    "flight.bag": read_trace,
}
SCENE = "origin: [0, 0]\nsize: [9, 9]\nstarts: [[4, 4]]\n"


def refusal(function, *arguments):
    with pytest.raises(InputError) as caught:
        function(*arguments)
    return str(caught.value)


@pytest.mark.parametrize("name, read", READERS.items())
def test_a_pipe_a_folder_and_a_device_are_refused_at_once(tmp_path, name, read):
    assert_reads_files_alone(read, tmp_path / name)


def assert_reads_files_alone(read, path):
    os.mkfifo(path)  # without a writer: opening it for reading would block
    assert "is a pipe; expected a file" in refusal(read, path)
    path.unlink()
    path.mkdir()
    assert "is a folder; expected a file" in refusal(read, path)
    path.rmdir()
    path.symlink_to("/dev/zero")
    assert "is a device or socket; expected a file" in refusal(read, path)


@pytest.mark.parametrize(
    "name, read", [item for item in READERS.items() if item[0] != "flight.bag"]
)
def test_a_file_of_a_gigabyte_is_refused_before_it_is_read(tmp_path, name, read):
    path = tmp_path / name
    with path.open("wb") as file:
        file.truncate(1 << 30)
    assert "has 1073741824 bytes; expected " in refusal(read, path)


def test_parameters_and_images_are_read_with_the_same_care(tmp_path):
    os.mkfifo(tmp_path / "costmap_common_params.yaml")
    (tmp_path / "map.yaml").write_text(
        "image: pipe.png\nresolution: 0.05\norigin: [0, 0, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
    )
    os.mkfifo(tmp_path / "pipe.png")
    assert "is a pipe" in refusal(load_files, [tmp_path / "costmap_common_params.yaml"])
    assert "is a pipe" in refusal(load_scene, tmp_path / "map.yaml")


def test_a_file_that_grows_while_it_is_read_is_refused(tmp_path):
    # /proc's files tell a size of 0 and hold more.
    assert "has more than 10 bytes" in refusal(read_bytes, Path("/proc/self/status"), 10)


def test_texts_are_utf_8(tmp_path):
    path = tmp_path / "text"
    path.write_bytes(b"\xef\xbb\xbfa\xc3\xa9")
    assert read_text(path, 10) == "a\u00e9"
    path.write_bytes(b"ab\xe9")
    assert "byte 2 is not UTF-8" in refusal(read_text, path, 10)


def test_names_that_no_file_can_have():
    assert "cannot be read" in refusal(open_file, Path("a\0b"))
    assert "cannot be read" in refusal(open_file, Path("a" * 300))


def test_goal_files_have_limits():
    goals = "[1, 2]," * MAX_GOALS
    assert len(parse_goals(f'{{"goals": [{goals[:-1]}]}}', "f").goals) == MAX_GOALS
    assert "expected 10000 at most" in refusal(parse_goals, f'{{"goals": [{goals}[1, 2]]}}', "f")
    assert "bytes; expected" in refusal(parse_goals, " " * (MAX_BYTES + 1), "f")
    far = '{"goals": [[1e7, 1]]}'
    assert "x is 1e+07; expected 1e+06 metres at most" in refusal(parse_goals, far, "f")


def test_a_watched_file_that_becomes_a_pipe_is_a_changed_file(tmp_path):
    path = tmp_path / "goals.json"
    path.write_text('{"goals": [[1, 2]]}')
    watched = WatchedGoalFile(path)
    watched.load()
    path.unlink()
    os.mkfifo(path)
    assert watched.poll() is None
    assert "is a pipe" in refusal(watched.poll)


def test_many_faults_are_counted_and_escape_sequences_are_escaped():
    error = InputError([f"fault {k}" for k in range(MAX_PROBLEMS + 5)])
    assert error.problems[-1] == "... and 5 more problems"
    assert InputError(["a\x1b[2Jb\ud800"]).problems == ["a\\x1b[2Jb\\ud800"]
    assert len(InputError(["x" * 10**6]).problems[0]) < 3000


# -- where files may lead ---------------------------------------------------------------


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Beside a scene of somebody else's that must not be reached from the folder ``given``."""
    monkeypatch.delenv("QUAD_FILES_PATH", raising=False)
    (tmp_path / "secret.world").write_text(
        '<sdf version="1.6"><model name="m"><pose>1 1 0.5 0 0 0</pose><link name="l">'
        '<collision name="c"><geometry><box><size>1 1 1</size></box></geometry></collision></link>'
        "</model></sdf>"
    )
    (tmp_path / "given" / "sub").mkdir(parents=True)
    return tmp_path / "given"


def scene(folder, world):
    path = folder / "scene.yaml"
    path.write_text(f"world: {world}\n{SCENE}")
    return path


def test_a_link_that_the_user_names_is_followed(folder):
    (folder / "mine.yaml").symlink_to(scene(folder.parent, "secret.world"))
    assert len(load_scene(folder / "mine.yaml").obstacles) == 1


@pytest.mark.parametrize(
    "way",
    ["../secret.world", "sub/../../secret.world", "{outside}", "link.world", "folder/secret.world"],
)
def test_a_scene_refers_to_no_file_outside_its_folder(folder, way):
    (folder / "link.world").symlink_to(folder.parent / "secret.world")
    (folder / "folder").symlink_to(folder.parent)
    name = way.format(outside=folder.parent / "secret.world")
    assert f"leads out of {folder}" in refusal(load_scene, scene(folder, name))


def test_a_scene_reaches_files_below_its_folder_and_in_folders_that_are_allowed(
    folder, monkeypatch
):
    monkeypatch.setenv("QUAD_FILES_PATH", f"/none{os.pathsep}{folder.parent}")
    assert len(load_scene(scene(folder, "../secret.world")).obstacles) == 1
    monkeypatch.delenv("QUAD_FILES_PATH")
    (folder.parent / "secret.world").rename(folder / "sub" / "own.world")
    assert len(load_scene(scene(folder, "sub/own.world")).obstacles) == 1


def test_a_map_refers_to_no_image_outside_its_folder(folder):
    (folder / "map.yaml").write_text(
        "image: ../../etc/passwd\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.2\n"
    )
    assert "leads out of" in refusal(load_scene, folder / "map.yaml")


@pytest.mark.parametrize("named", ["../../../secret.world", "{outside}"])
def test_a_models_config_refers_to_no_file_outside(folder, named):
    model = folder / "models" / "crate"
    model.mkdir(parents=True)
    named = named.format(outside=folder.parent / "secret.world")
    (model / "model.config").write_text(f"<model><sdf>{named}</sdf></model>")
    world = folder / "a.world"
    world.write_text(
        '<sdf version="1.6"><world name="w"><include><uri>model://crate</uri>'
        "</include></world></sdf>"
    )
    assert f"leads out of {model}" in refusal(load_scene, world)


def test_links_in_a_circle_are_no_file(folder):
    (folder / "a").symlink_to("b")
    (folder / "b").symlink_to("a")
    assert "cannot be" in refusal(lambda: open_file(referenced_file(folder, "a")))


def recording(path, **facts):
    """A flight of one instant about which there are some facts."""
    file = create(path)
    handle = file.add_topic("/quad/flight", "quad/FlightInfo", True, "/simulator")
    file.write(handle, 10**9, messages.encode(messages.flight_info(FlightInfo(**facts))))
    handle = file.add_topic("/odom0", "nav_msgs/Odometry", False, "/simulator")
    still = messages.odometry(
        Pose3D(1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), ("odom0", "base_link0"), 10**9
    )
    file.write(handle, 10**9, messages.encode(still))
    file.close()
    return path


def test_a_recordings_scene_refers_to_no_file(tmp_path):
    path = recording(tmp_path / "flight.bag", scene={"map": "/etc/map.yaml"})
    assert "scene: refers to another file" in refusal(read_trace, path)


@pytest.mark.slow
def test_a_recording_that_unpacks_to_far_more_is_refused(tmp_path, monkeypatch):
    path = recording(tmp_path / "flight.bag", title=" " * 200_000_000)
    assert path.stat().st_size < 2_000_000
    monkeypatch.setattr(bag_trace, "MAX_MEMORY_BYTES", 100_000_000)
    problem = refusal(read_trace, path)  # lz4 says it in its own words
    assert "needs more than 0.1 GB of memory" in problem or "Failed to resize buffer" in problem
    monkeypatch.undo()
    assert len(read_trace(path).robots) == 1


@pytest.mark.slow
def test_worlds_that_include_each_other_come_to_an_end(tmp_path):
    # Each has the next one twice, and the last one the first: 2^16 models within 16 levels.
    for k in range(20):
        (tmp_path / f"{k}.sdf").write_text(
            '<sdf version="1.6"><model name="m"><link name="l"/>'
            + f"<include><uri>{(k + 1) % 20}.sdf</uri></include>" * 4
            + "</model></sdf>"
        )
    (tmp_path / "a.world").write_text(
        '<sdf version="1.6"><world name="w"><include><uri>0.sdf</uri></include></world></sdf>'
    )
    assert "more than 200000 models, links and collisions" in refusal(
        load_scene, tmp_path / "a.world"
    )
