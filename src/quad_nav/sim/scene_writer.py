"""Scenes as documents and YAML files that ``scene_file`` reads."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict

import yaml

from quad_nav.sim.motion_file import motion_document, phase_document, walkers_document
from quad_nav.sim.scene import Scene


def scene_document(scene: Scene) -> Dict[str, Any]:
    """Return the document of a scene, without its remarks.

    ``scene_file.scene_from_document`` makes an equal scene of it. ``write_scene`` writes it to a
    file, and recordings contain it.
    """
    extra: Dict[str, Any] = {}
    if scene.motion_phase_s != 0.0:
        extra["motion_phase"] = phase_document(scene.motion_phase_s)
    if scene.walkers is not None:
        extra["walkers"] = walkers_document(scene.walkers)
    walls = {"height": scene.walls.height_m, "thickness": scene.walls.thickness_m}
    return {
        "name": scene.name,
        "size": [scene.size_x_m, scene.size_y_m],
        "origin": [scene.origin_x_m, scene.origin_y_m],
        "altitude": scene.altitude_m,
        "walls": walls,
        **extra,
        "obstacles": [
            *(solid.document() for solid in scene.obstacles),
            *(
                {**one.shape.document(), "motion": motion_document(one.motion)}
                for one in scene.moving
            ),
        ],
        "starts": [[pose.x_m, pose.y_m, pose.yaw_rad] for pose in scene.starts],
    }


def write_scene(scene: Scene, path: Path) -> None:
    """Write a scene to a YAML file with one obstacle per line.

    ``scene_file.load_scene`` reads an equal scene, but for its remarks.

    Raises:
        OSError: The file cannot be written.
    """
    document = scene_document(scene)
    head = {key: document[key] for key in document if key not in ("obstacles", "starts")}
    if head["origin"] == [0.0, 0.0]:
        del head["origin"]
    lines = [yaml.safe_dump(head, default_flow_style=None, sort_keys=False)]
    for key in ("obstacles", "starts"):
        lines.append(f"{key}:\n" if document[key] else f"{key}: []\n")
        lines += [
            "  - " + yaml.safe_dump(item, default_flow_style=True, sort_keys=False, width=math.inf)
            for item in document[key]
        ]
    path.write_text("".join(lines), encoding="utf-8")
