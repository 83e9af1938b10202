"""Moving obstacles of a scene: where they are at any time of a flight.

Their poses depend on the scene, the seed and the time alone: the simulator, a log and a report
compute the same ones. Where people are who react to quadcopters depends on the flight: the
simulation calls ``react``, others give a record of it.
"""

from __future__ import annotations

import math
from typing import List, Optional, Sequence, Union

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import rotate_vectors
from quad_nav.sim.crowd_record import CrowdRecord
from quad_nav.sim.keyframes import Keyframes, fill_poses
from quad_nav.sim.motion import SPLINE, Motion
from quad_nav.sim.obstacles import Obstacle
from quad_nav.sim.scene import Scene
from quad_nav.sim.walkers import REACTION_S, Crowd, round_down, walks

Floats = NDArray[np.float64]

_PHASE_STREAM = 4
"""Stream of the random phases, beside those of starts, noise, missions and drift."""


class Motions:
    """Poses of many motions at any time.

    Args:
        motions: The motions.
        phases_s: Time by which each is ahead; it replaces ``Motion.phase_s``.
    """

    def __init__(self, motions: Sequence[Motion], phases_s: Sequence[float]) -> None:
        self.count = len(motions)
        self._keyframes = Keyframes(
            np.cumsum([0, *(len(motion.times_s) for motion in motions)]).astype(np.int64),
            np.array([time_s for motion in motions for time_s in motion.times_s], float),
            np.array([pose for motion in motions for pose in motion.poses], float).reshape(-1, 3),
            np.concatenate([np.zeros((0, 3)), *(motion.tangents() for motion in motions)]),
            np.array([motion.interpolation == SPLINE for motion in motions], bool),
            np.array([motion.loop for motion in motions], bool),
            np.array(phases_s, float),
        )

    def poses(self, times_s: Floats) -> Floats:
        """Return the poses (x_m, y_m, yaw_rad) in ``map``, float64[t, m, 3], at float64[t]."""
        poses = np.empty((len(times_s), self.count, 3))
        fill_poses(self._keyframes, times_s, poses)
        return poses


class Movers:
    """All obstacles of a scene that move, in the order of ``Scene.moving_shapes``.

    Args:
        scene: The scene.
        seed: Seed of the random phases and of the walkers.
        start_s: Time on the clock at which the motions begin.
        record: Where people were who react to quadcopters; without it they walk by ``react``.

    Raises:
        InputError: The scene has no room for its walkers.

    Attributes:
        shapes: Shapes of the obstacles.
        start_s: As given.
    """

    def __init__(
        self,
        scene: Scene,
        seed: Optional[int] = 0,
        start_s: float = 0.0,
        record: Optional[CrowdRecord] = None,
    ) -> None:
        self.shapes = scene.moving_shapes
        self.start_s = start_s
        self._scene = scene
        motions = [obstacle.motion for obstacle in scene.moving]
        phases = phases_s(motions, scene.motion_phase_s, seed or 0)
        self._reacting: Optional[Crowd] = None
        self._people: Union[Crowd, CrowdRecord, None] = None
        people: Sequence[Motion] = ()
        if not scene.people_react:
            people = walks(scene, seed or 0) if scene.walkers is not None else ()
        elif record is None:
            self._reacting = self._people = Crowd(scene, seed or 0)
        else:
            self._people = record
        self._motions = Motions([*motions, *people], [*phases, *(0.0 for _ in people)])

    def __len__(self) -> int:
        return len(self.shapes)

    def poses(self, now_s: float) -> Floats:
        """Return the poses (x_m, y_m, yaw_rad) in ``map`` at a time, float64[m, 3]."""
        return self.poses_at(np.array([now_s]))[0]

    def poses_at(self, times_s: Floats) -> Floats:
        """Return the poses at many times float64[t] on the clock, float64[t, m, 3].

        Those of people who react are NaN before ``react`` or a minute later, and where the record
        does not have them.
        """
        poses = self._motions.poses(times_s - self.start_s)
        if self._people is None:
            return poses
        return np.concatenate([poses, self._people.poses(times_s - self.start_s)], axis=1)

    def react(self, now_s: float, rows: Floats, radius_m: float) -> float:
        """Let people react to quadcopters, at least once in each period.

        Args:
            now_s: Present time on the clock.
            rows: float64[n, 13], ``BodyState.rows``.
            radius_m: Radius of the quadcopters.

        Returns:
            Time on the clock up to which all poses are known; +inf if nobody reacts.
        """
        if self._reacting is None:
            return math.inf
        elapsed_s = now_s - self.start_s
        self._reacting.react(elapsed_s, np.ascontiguousarray(rows[:, [0, 1, 7, 8]]), radius_m)
        return self.start_s + (round_down(elapsed_s) + 1) * REACTION_S

    def flight_surface_distances_m(self, positions_m: Floats, times_s: Floats) -> Floats:
        """Return the distances to the nearest surface of the scene, moving or not.

        Args:
            positions_m: float64[..., t, 2], positions in ``map`` at the flying altitude.
            times_s: float64[t], their times on the clock.

        Returns:
            float64[..., t], metres; negative inside.
        """
        nearest = self._scene.flight_surface_distances_m(positions_m)
        if len(self):
            np.minimum(nearest, self.distances_m(positions_m, times_s), out=nearest)
        return nearest

    def distances_m(self, positions_m: Floats, times_s: Floats) -> Floats:
        """Return the distances to the surface of the nearest obstacle that moves.

        Arguments and result are as for ``flight_surface_distances_m``.
        """
        return moving_distances_m(self._scene, self.poses_at(times_s), positions_m)

    def at(self, now_s: float) -> List[Obstacle]:
        """Return the obstacles where they are at a time, without those of which it is unknown."""
        return self._scene.moving_solids(self.poses(now_s))


def moving_distances_m(scene: Scene, poses: Floats, positions_m: Floats) -> Floats:
    """Return the distances to the surface of the nearest obstacle that moves.

    Args:
        scene: The scene.
        poses: float64[t, m, 3], x, y, yaw in ``map`` of ``Scene.moving_shapes``; NaN if unknown.
        positions_m: float64[..., t, 2], positions in ``map`` at the flying altitude.

    Returns:
        float64[..., t], metres; negative inside, infinity without obstacles.
    """
    nearest = np.full(positions_m.shape[:-1], np.inf)
    for k, shape in enumerate(scene.moving_shapes):
        touchable = scene.touchable([shape.placed((0.0, 0.0, 0.0))])
        if not touchable:
            continue
        x_m, y_m, yaw_rad = poses[:, k].T
        local = rotate_vectors(
            np.cos(yaw_rad),
            -np.sin(yaw_rad),
            positions_m[..., 0] - x_m,
            positions_m[..., 1] - y_m,
        )
        own = touchable[0].surface_distance_m(*local, scene.altitude_m)
        np.fmin(nearest, own, out=nearest)  # nobody knows where NaN is
    return nearest


def phases_s(motions: Sequence[Motion], common_s: Optional[float], seed: int) -> List[float]:
    """Return the time by which each motion is ahead of the clock, at random by the seed.

    ``common_s`` is that by which all are ahead; None for a random part of the longest loop.
    """
    if common_s is None:
        longest_s = max((motion.length_s for motion in motions), default=0.0)
        common_s = longest_s * np.random.default_rng([seed, _PHASE_STREAM]).random()
    return [
        common_s
        + (
            motion.length_s * np.random.default_rng([seed, _PHASE_STREAM, k]).random()
            if motion.phase_s is None
            else motion.phase_s
        )
        for k, motion in enumerate(motions)
    ]
