"""Rigid bodies: the scene and the quadcopters in pybullet; the only module that imports it.

A quadcopter collides as a cylinder, its propeller guard, which other LIDARs see too. The guard is
centred on the quadcopter's LIDAR, so that two level quadcopters see each other, even if one
of them tilts by a few degrees.
"""

from __future__ import annotations

import ctypes
import os
import sys
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import InputError, discarded_stderr
from quad_nav.geometry import Pose2D, quaternion_from_yaw
from quad_nav.sim.colours import robot_rgba
from quad_nav.sim.contacts import Touch
from quad_nav.sim.flight import GRAVITY_MPS2, Airframe, BodyState
from quad_nav.sim.obstacles import Box, Obstacle
from quad_nav.sim.scene import GUARD_HEIGHT_M, MOUNT_HEIGHT_M, Scene
from quad_nav.sim.solids import grouped

with discarded_stderr():  # pybullet prints its build time
    import pybullet

Floats = NDArray[np.float64]

_MAX_RAYS_PER_CALL = 16383
"""One less than ``pybullet.MAX_RAY_INTERSECTION_BATCH_SIZE``, with which the last is dropped."""
_PARKED_M = 100.0
"""Depth below the floor at which quadcopters that are not engaged wait without contacts."""
_LEVEL = [0.0, 0.0, 0.0, 1.0]
_GEOMETRIES: Dict[str, Callable[[Obstacle], Tuple[int, Dict[str, Any]]]] = {
    "box": lambda solid: (pybullet.GEOM_BOX, {"halfExtents": solid.half_m}),
    "cylinder": lambda solid: (
        pybullet.GEOM_CYLINDER,
        {"radius": solid.half_m[0], "height": solid.height_m},
    ),
    "sphere": lambda solid: (pybullet.GEOM_SPHERE, {"radius": solid.half_m[0]}),
}
"""The engine's kind and sizes of each shape of obstacles."""

GoalSphere = Tuple[Tuple[float, float, float], float, Tuple[float, float, float, float]]
"""Centre in metres, radius in metres, RGBA in 0..1."""


class World:
    """Scene and quadcopters in the physics engine; steps by a fixed time under given forces.

    All quadcopters are engaged at first, see ``engage``.

    Args:
        scene: The scene.
        starts: Start poses of the quadcopters in ``map``.
        airframe: Mass properties and size of the quadcopters.
        step_s: Duration of a step.
        gui: Open pybullet's window.

    Raises:
        InputError: There is no display for the window.
    """

    def __init__(
        self,
        scene: Scene,
        starts: Sequence[Pose2D],
        airframe: Airframe,
        step_s: float,
        gui: bool = False,
    ) -> None:
        self._scene = scene
        self._airframe = airframe
        self._step_s = step_s
        self._client = _connect(gui)
        self._gui = gui
        self._goal_ids: List[int] = []
        self._moving_ids: List[int] = []
        self._obstacle_poses: Floats = np.zeros((0, 3))
        self.reset(starts)

    def reset(self, starts: Sequence[Pose2D]) -> None:
        """Rebuild the world, so that the engine keeps nothing of the past.

        Without a window it is rebuilt when the engine is needed, which few short flights do.
        """
        self._starts = list(starts)
        self._is_stale, self._none_engaged = True, False
        if self._gui:
            self._rebuild()

    def _rebuild(self) -> None:
        """Build the world of the last reset, unless it is built."""
        if not self._is_stale:
            return
        self._is_stale = False
        client, starts = self._client, self._starts
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
        single, groups = grouped((*self._scene.wall_boxes(), *self._scene.obstacles))
        for solid in single:
            self._names[self._add_obstacle(solid)] = solid.name
        for group in groups:
            self._names[self._add_boxes(group)] = None
        moving = self._scene.moving_shapes
        self._moving_ids = [self._add_obstacle(solid) for solid in moving]
        self._names.update(zip(self._moving_ids, (solid.name for solid in moving)))
        self.place_obstacles(self._obstacle_poses)
        self._robots = [self._add_quadcopter(k, start) for k, start in enumerate(starts)]
        self._engaged = list(range(len(starts)))
        self._goal_ids = []
        pybullet.performCollisionDetection(physicsClientId=client)
        self._draw(True)

    def close(self) -> None:
        """Free the engine."""
        if pybullet.isConnected(self._client):
            pybullet.disconnect(self._client)

    @property
    def is_open(self) -> bool:
        """False after the window was closed."""
        return bool(pybullet.isConnected(self._client))

    def state(self) -> BodyState:
        """Return the state of all quadcopters."""
        rows = np.zeros((len(self._starts), 13))
        if self._is_stale:
            for number, start in enumerate(self._starts):
                rows[number, :7] = self._pose_at(start)
        else:
            self._read(range(len(self._robots)), rows)
        return BodyState(rows)

    def _pose_at(self, start: Pose2D) -> Tuple[float, ...]:
        """Return position and quaternion at a start, to the last bit as the engine rounds them."""
        body = pybullet.createMultiBody(
            1.0,
            basePosition=[start.x_m, start.y_m, self._scene.altitude_m],
            baseOrientation=quaternion_from_yaw(start.yaw_rad),
            physicsClientId=self._client,
        )
        position, quaternion = pybullet.getBasePositionAndOrientation(body, self._client)
        pybullet.removeBody(body, physicsClientId=self._client)
        return (*position, *quaternion)

    def engage(self, robots: Sequence[int], state: BodyState) -> None:
        """Choose the quadcopters that ``step`` moves and that can be touched.

        Args:
            robots: Numbers of the quadcopters, in increasing order.
            state: State that newly engaged quadcopters start from.
        """
        if self._is_stale:
            if not len(robots):
                self._none_engaged = True
                return
            self._rebuild()
            if self._none_engaged:
                self.engage([], state)
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

    def place_obstacles(self, poses: Floats) -> None:
        """Set the poses (x_m, y_m, yaw_rad) of the moving obstacles, float64[m, 3].

        They are bodies without mass that are put from pose to pose, as Gazebo does with animated
        models: nothing stops them, and they push what they overlap.
        """
        self._obstacle_poses = poses
        if self._is_stale:
            return
        for body, solid, (x_m, y_m, yaw_rad) in zip(
            self._moving_ids, self._scene.moving_shapes, poses.tolist()
        ):
            place = [x_m, y_m, solid.centre_m[2]]
            turn = quaternion_from_yaw(yaw_rad)
            pybullet.resetBasePositionAndOrientation(body, place, turn, self._client)

    def step(self, state: BodyState, forces_n: Floats, torques_nm: Floats) -> BodyState:
        """Return the state after one step of the engaged quadcopters.

        Args:
            state: Present state of all quadcopters.
            forces_n: float64[n, 3], forces at the bodies' centres in ``map``.
            torques_nm: float64[n, 3], torques in ``map``.
        """
        self._rebuild()
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

    def _read(self, robots: Sequence[int], rows: Floats) -> None:
        client = self._client
        for robot in robots:
            body = self._robots[robot]
            position, quaternion = pybullet.getBasePositionAndOrientation(body, client)
            linear, angular = pybullet.getBaseVelocity(body, client)
            rows[robot] = (*position, *quaternion, *linear, *angular)

    def touches(self) -> List[Touch]:
        """Return what presses on the quadcopters after the last step, in the robots' order."""
        touches = {}
        self._rebuild()
        for point in pybullet.getContactPoints(physicsClientId=self._client):
            body_a, body_b, position, normal_force = point[1], point[2], point[5], point[9]
            if normal_force <= 0.0:
                continue
            touch = self._touch(body_a, body_b, position)
            touches[touch.robot, touch.other] = touch
        return [touches[key] for key in sorted(touches)]

    def cast(self, starts_m: Floats, ends_m: Floats) -> Floats:
        """Cast rays from and to float64[m, 3] in ``map``.

        Returns:
            float64[m], distance to the first hit as a fraction of the ray's length; +inf for no
            hit. A ray does not hit a solid that it starts in, such as its own quadcopter's guard.
        """
        self._rebuild()
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
        """Replace the drawn goals, which neither collide nor appear in scans."""
        self._rebuild()
        client = self._client
        for goal in self._goal_ids:
            pybullet.removeBody(goal, physicsClientId=client)
        self._goal_ids = []
        for centre, radius, rgba in spheres:
            shape = pybullet.createVisualShape(
                pybullet.GEOM_SPHERE, radius=radius, rgbaColor=rgba, physicsClientId=client
            )
            body = pybullet.createMultiBody(
                0.0, baseVisualShapeIndex=shape, basePosition=centre, physicsClientId=client
            )
            self._goal_ids.append(body)

    def _draw(self, on: bool) -> None:
        """Switch drawing on or off; adding bodies is slow while it is on."""
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
        robots = sorted(
            self._robots.index(one) for one in (body_a, body_b) if one not in self._names
        )
        if len(robots) == 2:
            return Touch(robots[0], f"quad{robots[1]}", position)
        name = self._names[body_a if body_a in self._names else body_b]
        return Touch(robots[0], name or self._scene.nearest(*position).name, position)

    def _add_obstacle(self, solid: Obstacle) -> int:
        kind, sizes = _GEOMETRIES[solid.shape](solid)
        shape = pybullet.createCollisionShape(kind, physicsClientId=self._client, **sizes)
        turn = quaternion_from_yaw(solid.yaw_rad)
        body = pybullet.createMultiBody(
            0.0,
            shape,
            basePosition=solid.centre_m,
            baseOrientation=turn,
            physicsClientId=self._client,
        )
        return int(body)

    def _add_boxes(self, boxes: Sequence[Box]) -> int:
        """Add boxes as one body, because each step visits all bodies."""
        shape = pybullet.createCollisionShapeArray(
            shapeTypes=[pybullet.GEOM_BOX] * len(boxes),
            halfExtents=[box.half_m for box in boxes],
            collisionFramePositions=[box.centre_m for box in boxes],
            collisionFrameOrientations=[quaternion_from_yaw(box.yaw_rad) for box in boxes],
            physicsClientId=self._client,
        )
        client = self._client
        body = pybullet.createMultiBody(0.0, shape, useMaximalCoordinates=1, physicsClientId=client)
        return int(body)

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
        visual = pybullet.createVisualShape(
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
                visual,
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


def _connect(gui: bool) -> int:
    """Connect to the engine; check the display first, because pybullet exits without one."""
    if gui and sys.platform == "linux" and not _has_display():
        display = os.environ.get("DISPLAY", "")
        raise InputError([f"gui: no display at DISPLAY={display!r}, expected one, or gui:=false"])
    client = pybullet.connect(pybullet.GUI if gui else pybullet.DIRECT)
    if client < 0:
        problem = "gui: pybullet cannot open its window, expected a display, or gui:=false"
        raise InputError([problem])
    return int(client)


def _has_display() -> bool:
    """Return whether an X server answers."""
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError:
        return False
    x11.XOpenDisplay.restype = ctypes.c_void_p
    display = x11.XOpenDisplay(None)
    if display:
        x11.XCloseDisplay(ctypes.c_void_p(display))
    return bool(display)
