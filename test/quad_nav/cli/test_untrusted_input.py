"""Untrusted input never becomes code, and recordings hold no personal data.

ruff finds the calls that make code of data, such as ``eval`` and ``pickle.load``: see the rules S
in ``pyproject.toml``. Here are those that take too much memory.
"""

from __future__ import annotations

import getpass
import platform
import re
import shutil
import socket
import sys
from pathlib import Path

import lz4.frame
import pytest
from click.testing import CliRunner

from quad_nav.cli import main
from quad_nav.recording import messages
from quad_nav.topics.flight_info import FlightInfo, RobotInfo, flight_info_from_message

ROOT = Path(__file__).parents[3]
SOURCES = sorted(
    [
        *(ROOT / "src").rglob("*.py"),
        *(ROOT / "nodes").iterdir(),
        ROOT / "scripts" / "fly",
        ROOT / "scripts" / "quad",
    ]
)
# Its input is what roslaunch has just printed, or ships with the package.
SAFE_LOAD_IN = ("ros/common/preflight.py", "topics/rviz_file.py")


LOADS = re.compile(r"yaml\.\w*load_all|yaml\.safe_load|np\.load\((?!.*allow_pickle=False)")


def test_files_are_read_within_limits():
    found = {
        str(path): LOADS.findall(path.read_text(encoding="utf-8"))
        for path in SOURCES
        if not path.as_posix().endswith(SAFE_LOAD_IN)
    }
    assert {path: calls for path, calls in found.items() if calls} == {}


def test_parameters_in_recordings_load_no_plugins(monkeypatch):
    # They may name Python classes of the author; showing them must not import them.
    named = []
    monkeypatch.setattr("quad_nav.config.plugins.load_class", lambda name, _: named.append(name))
    parameters = {
        "base_global_planner": "antigravity.Planner",
        "base_local_planner": "this.Planner",
    }
    info = FlightInfo(robots=(RobotInfo("quad0", parameters=parameters),))
    flight_info_from_message(messages.flight_info(info))
    assert named == []
    assert not {"antigravity", "this"} & set(sys.modules)


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Files of a flight by the command line; user and machine have names that can be searched."""
    with pytest.MonkeyPatch.context() as patch:
        home = tmp_path_factory.mktemp("hidden8-home")
        for name in ("USER", "LOGNAME", "USERNAME"):
            patch.setenv(name, "hidden8-user")
        patch.setenv("HOME", str(home))
        patch.setenv("HOSTNAME", "hidden8-host")
        patch.setattr(socket, "gethostname", lambda: "hidden8-host")
        patch.setattr(platform, "node", lambda: "hidden8-host")
        yield _fly(home)


def _fly(home):
    shutil.copytree(ROOT / "config" / "default", home / "mine")
    shutil.copy(ROOT / "scenes" / "arena.yaml", home / "place.yaml")
    goals = home / "goals"
    goals.mkdir()
    (goals / "quad0_goals.json").write_text('{"goals": [[2.1, 1.9]]}')
    kinds = {"record": "bag", "report": "html", "json": "json", "animate": "gif"}
    written = {kind: home / f"flight.{kind}" for kind in kinds.values()}
    given = {"config": home / "mine", "scene": home / "place.yaml", "goals": goals, "robots": 1}
    given.update({option: written[kind] for option, kind in kinds.items()})
    words = [word for option, value in given.items() for word in (f"--{option}", str(value))]
    result = CliRunner().invoke(main, ["fly", "--quiet", *words])
    assert result.exit_code == 0, result.output
    return written


@pytest.mark.parametrize("kind", ["bag", "html", "gif"])
def test_files_of_a_flight_hold_no_user_machine_or_folder_names(flown, kind):
    content = unpacked(flown[kind], kind)
    assert b"quad0" in content or kind == "gif"
    for secret in (
        "hidden8-",
        str(flown[kind].parent),
        str(ROOT),
        str(Path.home()) + "/",
        f"/{getpass.getuser()}/",
    ):
        assert secret.encode() not in content, secret


def unpacked(path, kind):
    """A recording's bytes with the content of its chunks."""
    content = path.read_bytes()
    if kind != "bag":
        return content
    magic, at, parts = b"\x04\x22\x4d\x18", 0, [content]
    while True:
        at = content.find(magic, at)
        if at < 0:
            break
        parts.append(lz4.frame.LZ4FrameDecompressor().decompress(content[at:]))
        at += 4
    assert len(parts) > 1
    return b"".join(parts)
