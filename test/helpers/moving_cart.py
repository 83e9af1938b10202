"""A cart that goes through a yard, for tests."""

from quad_nav.geometry import Pose2D
from quad_nav.sim.motion import Motion
from quad_nav.sim.obstacles import Cylinder
from quad_nav.sim.scene import MovingObstacle, Scene, Walls

START = Pose2D(6.0, 5.0)


def scene_with(*moving, **given):
    return Scene("yard", 12.0, 12.0, 1.0, Walls(), (), (START,), moving=moving, **given)


def cart(shape=None, speed_mps=1.0, **given):
    """From (2, 5) along x to (10, 5)."""
    shape = shape or Cylinder("cart", 2.0, 5.0, 0.5, 2.0)
    return MovingObstacle(
        shape, Motion((0.0, 8.0 / speed_mps), ((2.0, 5.0, 0.0), (10.0, 5.0, 0.0)), **given)
    )
