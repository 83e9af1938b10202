"""Where in a scene a goal may be."""

from __future__ import annotations

from quad_nav.mission.goal_file import PlaceCheck, clearance_check
from quad_nav.sim.scene import Scene


def scene_check(scene: Scene, robot_radius_m: float) -> PlaceCheck:
    """Tells goals outside the arena, and those nearer to something than the radius."""
    return clearance_check(
        scene.contains, scene.flight_surface_distance_m, robot_radius_m, arena_text(scene)
    )


def arena_text(scene: Scene) -> str:
    """Where the arena is, for messages."""
    return (
        f"x {scene.origin_x_m:g} to {scene.end_x_m:g} m, "
        f"y {scene.origin_y_m:g} to {scene.end_y_m:g} m"
    )
