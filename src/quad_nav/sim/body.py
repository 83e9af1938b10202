"""Rigid bodies: the scene and the quadcopters in pybullet, the only file that imports it.

A quadcopter touches and is seen as an upright cylinder, its propeller guard. It
is centred on its own LIDAR, so that two level quadcopters see each other, also
while one of them tilts by a few degrees.
"""

from __future__ import annotations

import ctypes
import os
import sys
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np
import pybullet

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D, quaternion_from_yaw
from quad_nav.sim.colours import robot_rgba
from quad_nav.sim.contacts import Touch
from quad_nav.sim.flight import GRAVITY_MPS2, Airframe, BodyState
from quad_nav.sim.lidar import MOUNT_HEIGHT_M
from quad_nav.sim.scene import GUARD_HEIGHT_M, Box, Obstacle, Scene, Sphere

_MAX_RAYS_PER_CALL = 16383
"""One less than ``pybullet.MAX_RAY_INTERSECTION_BATCH_SIZE``: of that many the last is dropped."""
_MANY_BOXES = 256
_STRIPE_M = 4.0
_BOXES_PER_BODY = 16
"""pybullet's limit for the shapes of one collision shape."""
_PARKED_M = 100.0
"""Below the floor, without contacts: quadcopters that are not engaged."""
_LEVEL = [0.0, 0.0, 0.0, 1.0]

GoalSphere = Tuple[Tuple[float, float, float], float, Tuple[float, float, float, float]]
"""Centre in metres, radius in metres, RGBA in 0..1."""


class World:
    """Scene and quadcopters; steps by a fixed time under given forces.

    Quadcopters are engaged at first, see ``engage``.

    With ``gui`` pybullet opens a window; ``InputError`` if there is no display.
    """

    def __init__(
        self,
        scene: Scene,
        starts: Sequence[Pose2D],
        airframe: Airframe,
        step_s: float,
        gui: bool = False,
    ):
        self._scene = scene
        self._airframe = airframe
        self._step_s = step_s
        self._client = _connect(gui)
        self._gui = gui
        self._goal_ids: List[int] = []
        self.reset(starts)

    def reset(self, starts: Sequence[Pose2D]) -> None:
        """Build everything anew, so that nothing of the past is left in the engine."""
        client = self._client
        pybullet.resetSimulation(physicsClientId=client)
        self._draw(False)
        pybullet.setGravity(0.0, 0.0, -GRAVITY_MPS2, physicsClientId=client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=self._step_s, deterministicOverlappingPairs=1, physicsClientId=client
        )
        floor = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
        self._names: Dict[int, Optional[str]] = {
            pybullet.createMultiBody(0.0, floor, physicsClientId=client): "floor"
        }
        single, grouped = _by_number((*self._scene.wall_boxes(), *self._scene.obstacles))
        for solid in single:
            self._names[self._add_obstacle(solid)] = solid.name
        for group in grouped:
            self._names[self._add_boxes(group)] = None
        self._robots = [self._add_quadcopter(k, start) for k, start in enumerate(starts)]
        self._engaged = list(range(len(starts)))
        self._goal_ids = []
        pybullet.performCollisionDetection(physicsClientId=client)
        self._draw(True)

    def close(self) -> None:
        if pybullet.isConnected(self._client):
            pybullet.disconnect(self._client)

    @property
    def is_open(self) -> bool:
        """False once the window has been closed."""
        return bool(pybullet.isConnected(self._client))

    def state(self) -> BodyState:
        """Read all bodies."""
        rows = np.empty((len(self._robots), 13))
        self._read(range(len(self._robots)), rows)
        return BodyState(rows)

    def engage(self, robots: Sequence[int], state: BodyState) -> None:
        """From now on only these quadcopters can be touched and are moved by ``step``.

        Those that were not engaged are put where ``state`` has them.
        """
        if list(robots) == self._engaged:
            return
        client = self._client
        for robot in set(self._engaged) - set(robots):
            body, far_m = self._robots[robot], [0.0, 0.0, -_PARKED_M - robot]
            pybullet.setCollisionFilterGroupMask(body, -1, 0, 0, physicsClientId=client)
            pybullet.resetBasePositionAndOrientation(body, far_m, _LEVEL, client)
        for robot in sorted(set(robots) - set(self._engaged)):
            body, row = self._robots[robot], state.rows[robot].tolist()
            pybullet.setCollisionFilterGroupMask(body, -1, 1, -1, physicsClientId=client)
            pybullet.resetBasePositionAndOrientation(body, row[0:3], row[3:7], client)
            pybullet.resetBaseVelocity(body, row[7:10], row[10:13], client)
        self._engaged = list(robots)

    def step(self, state: BodyState, forces_n: np.ndarray, torques_nm: np.ndarray) -> BodyState:
        """``state`` after one time step of the quadcopters that are engaged.

        Under forces at the bodies' centres and torques, float64[n, 3] in map.
        """
        client, in_map = self._client, pybullet.WORLD_FRAME
        positions, forces, torques = (
            rows.tolist() for rows in (state.positions_m, forces_n, torques_nm)
        )
        for robot in self._engaged:
            body = self._robots[robot]
            pybullet.applyExternalForce(body, -1, forces[robot], positions[robot], in_map, client)
            pybullet.applyExternalTorque(body, -1, torques[robot], in_map, client)
        pybullet.stepSimulation(client)
        rows = state.rows.copy()
        self._read(self._engaged, rows)
        return BodyState(rows)

    def _read(self, robots: Sequence[int], rows: np.ndarray) -> None:
        client = self._client
        for robot in robots:
            body = self._robots[robot]
            position, quaternion = pybullet.getBasePositionAndOrientation(body, client)
            linear, angular = pybullet.getBaseVelocity(body, client)
            rows[robot] = (*position, *quaternion, *linear, *angular)

    def touches(self) -> List[Touch]:
        """What presses on the quadcopters after the last step."""
        touches = {}
        for point in pybullet.getContactPoints(physicsClientId=self._client):
            body_a, body_b, position, normal_force = point[1], point[2], point[5], point[9]
            if normal_force <= 0.0:
                continue
            touch = self._touch(body_a, body_b, position)
            touches[touch.robot, touch.other] = touch
        return [touches[key] for key in sorted(touches)]

    def cast(self, starts_m: np.ndarray, ends_m: np.ndarray) -> np.ndarray:
        """See ``casters.RayWorld``. A quadcopter's own beams start inside its guard: unseen."""
        starts, ends = starts_m.tolist(), ends_m.tolist()
        hits: List[float] = []
        for k in range(0, len(starts), _MAX_RAYS_PER_CALL):
            chunk = slice(k, k + _MAX_RAYS_PER_CALL)
            hits += [
                hit[2] if hit[0] >= 0 else np.inf
                for hit in pybullet.rayTestBatch(
                    starts[chunk], ends[chunk], numThreads=1, physicsClientId=self._client
                )
            ]
        return np.array(hits)

    def show_goals(self, spheres: Sequence[GoalSphere]) -> None:
        """Draw goals that nothing can touch or see, in place of the last ones."""
        client = self._client
        for goal in self._goal_ids:
            pybullet.removeBody(goal, physicsClientId=client)
        self._goal_ids = []
        for centre, radius, rgba in spheres:
            shape = pybullet.createVisualShape(
                pybullet.GEOM_SPHERE, radius=radius, rgbaColor=rgba, physicsClientId=client
            )
            self._goal_ids.append(
                pybullet.createMultiBody(
                    0.0, baseVisualShapeIndex=shape, basePosition=centre, physicsClientId=client
                )
            )

    def _draw(self, on: bool) -> None:
        """Stop drawing while bodies are added, which is slow otherwise, and go on after it."""
        if not self._gui:
            return
        client, scene = self._client, self._scene
        for option, value in ((pybullet.COV_ENABLE_GUI, 0), (pybullet.COV_ENABLE_RENDERING, on)):
            pybullet.configureDebugVisualizer(option, int(value), physicsClientId=client)
        pybullet.resetDebugVisualizerCamera(
            0.9 * max(scene.size_x_m, scene.size_y_m),
            0.0,
            -60.0,
            [*scene.centre, 0.0],
            physicsClientId=client,
        )

    def _touch(self, body_a: int, body_b: int, position: Tuple[float, float, float]) -> Touch:
        numbers = sorted(
            self._robots.index(body) for body in (body_a, body_b) if body not in self._names
        )
        other: Optional[int] = numbers[1] if len(numbers) == 2 else None
        name = (
            f"quad{other}"
            if other is not None
            else self._names[body_a if body_a in self._names else body_b]
        )
        return Touch(numbers[0], name or self._scene.nearest(*position).name, position)

    def _add_obstacle(self, solid: Obstacle) -> int:
        client, height = self._client, solid.height_m
        if isinstance(solid, Box):
            yaw = solid.yaw_rad
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_BOX,
                physicsClientId=client,
                halfExtents=[solid.size_x_m / 2, solid.size_y_m / 2, height / 2],
            )
        elif isinstance(solid, Sphere):
            yaw = 0.0
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_SPHERE, radius=solid.radius_m, physicsClientId=client
            )
        else:
            yaw = 0.0
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_CYLINDER, radius=solid.radius_m, height=height, physicsClientId=client
            )
        return int(
            pybullet.createMultiBody(
                0.0,
                shape,
                basePosition=[solid.x_m, solid.y_m, solid.bottom_m + height / 2],
                baseOrientation=quaternion_from_yaw(yaw),
                physicsClientId=client,
            )
        )

    def _add_boxes(self, boxes: Sequence[Box]) -> int:
        """Boxes as one body: each step goes through all bodies, which tells from thousands on."""
        shape = pybullet.createCollisionShapeArray(
            shapeTypes=[pybullet.GEOM_BOX] * len(boxes),
            halfExtents=[[b.size_x_m / 2, b.size_y_m / 2, b.height_m / 2] for b in boxes],
            collisionFramePositions=[[b.x_m, b.y_m, b.bottom_m + b.height_m / 2] for b in boxes],
            collisionFrameOrientations=[quaternion_from_yaw(b.yaw_rad) for b in boxes],
            physicsClientId=self._client,
        )
        return int(
            pybullet.createMultiBody(
                0.0, shape, useMaximalCoordinates=1, physicsClientId=self._client
            )
        )

    def _add_quadcopter(self, number: int, start: Pose2D) -> int:
        client, offset = self._client, [0.0, 0.0, MOUNT_HEIGHT_M]
        radius = self._airframe.radius_m
        guard = pybullet.createCollisionShape(
            pybullet.GEOM_CYLINDER,
            radius=radius,
            height=GUARD_HEIGHT_M,
            collisionFramePosition=offset,
            physicsClientId=client,
        )
        looks = pybullet.createVisualShape(
            pybullet.GEOM_CYLINDER,
            radius=radius,
            length=GUARD_HEIGHT_M,
            rgbaColor=robot_rgba(number),
            visualFramePosition=offset,
            physicsClientId=client,
        )
        body = int(
            pybullet.createMultiBody(
                self._airframe.mass_kg,
                guard,
                looks,
                basePosition=[start.x_m, start.y_m, self._scene.altitude_m],
                baseOrientation=quaternion_from_yaw(start.yaw_rad),
                physicsClientId=client,
            )
        )
        pybullet.changeDynamics(
            body,
            -1,
            localInertiaDiagonal=self._airframe.inertia_kgm2,
            linearDamping=0.0,
            angularDamping=0.0,
            restitution=0.0,
            lateralFriction=0.2,
            physicsClientId=client,
        )
        return body


def _by_number(solids: Sequence[Obstacle]) -> Tuple[Sequence[Obstacle], List[List[Box]]]:
    """Solids that get a body each, and groups of near boxes with a body per group.

    A usual scene has no groups, so that each obstacle is a body.
    """
    boxes = [solid for solid in solids if isinstance(solid, Box)]
    if len(boxes) < _MANY_BOXES:
        return solids, []
    boxes.sort(key=lambda b: (b.x_m // _STRIPE_M, b.y_m))
    return (
        [solid for solid in solids if not isinstance(solid, Box)],
        [boxes[k : k + _BOXES_PER_BODY] for k in range(0, len(boxes), _BOXES_PER_BODY)],
    )


def _connect(gui: bool) -> int:
    """Open the engine; a window needs a display, without which pybullet ends the process."""
    if gui and sys.platform == "linux" and not _has_display():
        display = os.environ.get("DISPLAY", "")
        raise InputError([f"gui: no display at DISPLAY={display!r}, expected one or gui:=false"])
    client = pybullet.connect(pybullet.GUI if gui else pybullet.DIRECT)
    if client < 0:
        raise InputError(["gui: pybullet cannot open its window; gui:=false simulates without"])
    return int(client)


def _has_display() -> bool:
    """Whether an X server answers."""
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError:
        return False
    x11.XOpenDisplay.restype = ctypes.c_void_p
    display = x11.XOpenDisplay(None)
    if display:
        x11.XCloseDisplay(ctypes.c_void_p(display))
    return bool(display)
