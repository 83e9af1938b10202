"""A scene as the document that ``scene_file`` reads, with every shape spelt out."""

from __future__ import annotations

from typing import Any, Dict

from quad_nav.sim.scene import Box, Obstacle, Scene, Sphere


def scene_document(scene: Scene) -> Dict[str, Any]:
    """``scene_file.scene_from_document`` makes an equal scene of it."""
    return {
        "name": scene.name,
        "size": [scene.size_x_m, scene.size_y_m],
        "origin": [scene.origin_x_m, scene.origin_y_m],
        "altitude": scene.altitude_m,
        "walls": {"height": scene.walls.height_m, "thickness": scene.walls.thickness_m},
        "obstacles": [_obstacle(obstacle) for obstacle in scene.obstacles],
        "starts": [[start.x_m, start.y_m, start.yaw_rad] for start in scene.starts],
    }


def _obstacle(obstacle: Obstacle) -> Dict[str, Any]:
    fields = {
        "name": obstacle.name,
        "centre": [obstacle.x_m, obstacle.y_m],
        "bottom": obstacle.bottom_m,
    }
    if isinstance(obstacle, Sphere):
        return {**fields, "shape": "sphere", "radius": obstacle.radius_m}
    fields["height"] = obstacle.height_m
    if isinstance(obstacle, Box):
        return {
            **fields,
            "shape": "box",
            "size": [obstacle.size_x_m, obstacle.size_y_m],
            "yaw": obstacle.yaw_rad,
        }
    return {**fields, "shape": "cylinder", "radius": obstacle.radius_m}
