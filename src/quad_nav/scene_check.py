"""Where in a scene a goal may be."""
from __future__ import annotations

from quad_nav.mission.goal_file import PlaceCheck, clearance_check
from quad_nav.sim.scene import Scene


def scene_check(scene: Scene, robot_radius_m: float) -> PlaceCheck:
    """Tells goals outside the arena, and those nearer to something than the radius."""
    arena = f"x 0 to {scene.size_x_m:g} m, y 0 to {scene.size_y_m:g} m"
    return clearance_check(scene.contains, scene.flight_clearance_m, robot_radius_m, arena)
