"""The worlds and goals of ``docs/scenes.md`` fly as the page has them."""

import json
import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from quad_nav.cli import main

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "scenes.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"^quad (fly .*goals/examples.*)$", PAGE, re.M)


def test_a_scene_a_world_a_map_and_goals_are_shown():
    kinds = [re.search(r"--scene \S+\.(\w+)", command) for command in COMMANDS]
    shown = [kind.group(1) if kind else "" for kind in kinds]
    assert shown == ["", "yaml", "world", "yaml", "yaml"]  # the last one has people


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_it_flies_to_every_goal(command, tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    result = tmp_path / "result.json"
    run = CliRunner().invoke(main, [*shlex.split(command), "-q", "--json", str(result)])
    assert run.exit_code == 0, run.output
    summary = json.loads(result.read_text())
    assert len(summary["robots"]) == 2
