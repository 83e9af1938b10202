"""A small mission: one quadcopter, 3 m past a pillar, a second of computing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

SCENE = """\
name: small
size: [5.0, 4.0]
altitude: 1.0
obstacles:
  - {name: pillar, shape: cylinder, centre: [2.5, 1.7], radius: 0.2, height: 2.0}
starts:
  - [1.0, 2.0, 0.0]
"""


class MissionFiles(NamedTuple):
    """Scene file and folder of goals."""

    scene: Path
    goals: Path


def write_mission(folder: Path) -> MissionFiles:
    """Write the mission's files."""
    goals = folder / "goals"
    goals.mkdir(parents=True, exist_ok=True)
    (goals / "quad0_goals.json").write_text(json.dumps({"goals": [[4.0, 2.0]]}))
    (folder / "scene.yaml").write_text(SCENE)
    return MissionFiles(folder / "scene.yaml", goals)
