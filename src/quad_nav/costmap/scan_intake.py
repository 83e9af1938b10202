"""Hand a sensor's messages to the obstacle layers that take them.

Both shells use it: ``ros/navigator/sensors.py`` has one ``ScanIntake`` for each topic,
``loop/navigator_group.py`` one for the LIDAR. The shell knows where the sensor was; the intake
passes scans through the robot's filters and lets layers that see a message alike share its
projection.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Iterable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.observation import Observation, SourceParams
from quad_nav.costmap.obstacle import ObstacleLayer
from quad_nav.costmap.scan_filter import ScanFilters, ScanSituation
from quad_nav.costmap.scan_validator import ScanValidator, late_reason
from quad_nav.geometry import Pose3D, Scan


@dataclass(frozen=True)
class Sink:
    """An obstacle layer and one of its observation sources."""

    costmap: LayeredCostmap
    layer: ObstacleLayer
    source: SourceParams


class SensorPose(NamedTuple):
    """Poses of a sensor in the global frame of a sink's costmap.

    Attributes:
        frame: Pose of the frame in which the message has its points.
        origin: Pose where the rays start. It differs from ``frame`` only if the source names
            a ``sensor_frame`` other than the message's.
    """

    frame: Pose3D
    origin: Pose3D


_Key = Tuple[bool, float, float]  # as ObstacleLayer.projection_key returns it
_Made = Tuple[_Key, SensorPose, Observation]
_MakeObservation = Callable[[Sink, SensorPose], Observation]


def sinks_of(costmaps: Sequence[LayeredCostmap]) -> List[Sink]:
    """List every source of every obstacle layer."""
    return [
        Sink(costmap, layer, source)
        for costmap in costmaps
        for layer in costmap.layers.values()
        if isinstance(layer, ObstacleLayer)
        for source in layer.params.sources
    ]


class ScanIntake:
    """Filter the messages of one sensor and hand them to its sinks.

    Attributes:
        sinks: Layers and sources that take the messages.
        expected_period_s: Longest silence with which every layer stays current, in seconds; 0 for
            any.
    """

    def __init__(self, sinks: Sequence[Sink], filters: ScanFilters, local_frame: str) -> None:
        """Hand messages to sinks, in a robot whose local costmap has a global frame."""
        self.sinks = tuple(sinks)
        self._filters = filters
        frames = [sink.costmap.params.global_frame for sink in self.sinks]
        self._is_local = local_frame in frames
        self._filtered_sink = frames.index(local_frame) if self._is_local else 0
        self._names = [
            f"{sink.source.topic or sink.source.name} {sink.source.sensor_frame}".strip()
            for sink in self.sinks
        ]
        self._keys = [sink.layer.projection_key(sink.source.name) for sink in self.sinks]
        self._buffers = [sink.layer.buffers[sink.source.name] for sink in self.sinks]
        self._expect(sink.source for sink in self.sinks)

    def _expect(self, sources: Iterable[SourceParams]) -> None:
        periods_s = [source.expected_update_period_s for source in sources]
        self.expected_period_s = min((one for one in periods_s if one > 0.0), default=0.0)

    def reconfigure(self) -> None:
        """Take the present parameters of the buffers."""
        self._expect(buffer.params for buffer in self._buffers)

    def reset(self) -> None:
        """Forget earlier scans, after the clock has jumped."""
        self._filters.reset()

    def is_late(self, stamp_s: float, now_s: float) -> bool:
        """Tell whether a scan with this stamp is rejected now for its age."""
        return self._validates and bool(late_reason(stamp_s, now_s, self.expected_period_s))

    @property
    def _validates(self) -> bool:
        """Whether implausible scans are rejected."""
        return any(
            isinstance(one, ScanValidator) and one.params.reject_implausible_scans
            for one in self._filters.filters
        )

    def add_scan(
        self, scan: Scan, poses: Sequence[SensorPose], received_s: float, now_s: float
    ) -> str:
        """Hand a scan to the layers unless a filter rejects it.

        Args:
            scan: The scan, in the frame of ``poses[k].frame``.
            poses: Poses at the scan's stamp, one for each sink.
            received_s: When the scan arrived. With ``reject_implausible_scans`` the stamp
                counts if it is earlier, so that late scans are not taken for recent ones.
            now_s: Current time.

        Returns:
            The reason for which the scan was rejected, "" if the layers have it.
        """
        if not self.sinks:
            return ""
        pose = poses[self._filtered_sink].frame
        filtered = self._filters.filter(scan, self._situation(pose, now_s))
        if filtered.rejected:
            return filtered.rejected
        if len(filtered.vacated):
            at_sensor = pose.inverse().transform_points(filtered.vacated)
            for sink, there in zip(self.sinks, poses):
                sink.layer.forget_points(there.frame.transform_points(at_sensor))

        def make(sink: Sink, pose: SensorPose) -> Observation:
            name, layer = sink.source.name, sink.layer
            return layer.observe_scan(name, filtered.scan, pose.frame, pose.origin, filtered.masked)

        self._add(make, poses, scan.stamp_s, received_s)
        return ""

    def _situation(self, pose: Pose3D, now_s: float) -> ScanSituation:
        filtered = self._filtered_sink
        _, low_m, high_m = self._keys[filtered]
        circles = self.sinks[filtered].layer.excluded_circles
        return ScanSituation(
            now_s,
            self._names[filtered],
            pose,
            self._is_local,
            self.expected_period_s,
            (low_m, high_m),
            circles,
        )

    def add_cloud(
        self,
        points: NDArray[np.float32],
        poses: Sequence[SensorPose],
        stamp_s: float,
        received_s: float,
    ) -> None:
        """Hand a point cloud to the layers.

        Its points, float32[n, 3], are in the frame of ``poses[k].frame``, all finite; see
        ``add_scan``.
        """

        def make(sink: Sink, pose: SensorPose) -> Observation:
            layer, name = sink.layer, sink.source.name
            return layer.observe_cloud(name, points, pose.frame, stamp_s, pose.origin)

        self._add(make, poses, stamp_s, received_s)

    def _add(
        self, make: _MakeObservation, poses: Sequence[SensorPose], stamp_s: float, received_s: float
    ) -> None:
        if self._validates:
            received_s = min(received_s, stamp_s)
        made: List[_Made] = []
        for sink, key, buffer, pose in zip(self.sinks, self._keys, self._buffers, poses):
            observation = _find_equal(made, key, pose)
            if observation is None:
                observation = make(sink, pose)
                made.append((key, pose, observation))
            buffer.add(observation, received_s)


def _find_equal(made: Sequence[_Made], key: _Key, pose: SensorPose) -> Optional[Observation]:
    """Find an observation by comparison: mostly the poses are the same objects.

    Hashing them costs more than all other steps of an intake.
    """
    for other_key, other_pose, observation in made:
        if other_key == key and (other_pose is pose or other_pose == pose):
            return observation
    return None
