"""Hand a sensor's messages to the obstacle layers that take them.

Both shells use it: ``ros/navigator/sensors.py`` has one ``ScanIntake`` for each topic,
``loop/navigator_group.py`` one for the LIDAR. The shell knows where the sensor was; the intake
decides whether a scan counts and lets layers that see a message alike share its projection.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.observation import Observation, SourceParams
from quad_nav.costmap.obstacle import ObstacleLayer
from quad_nav.costmap.scan_validator import ScanValidator, ScanValidatorParams
from quad_nav.geometry import Pose3D, Scan
from quad_nav.tracking.tracker import ObstacleTracker, TrackedScan


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
    """Validate the messages of one sensor and hand them to its sinks.

    Attributes:
        sinks: Layers and sources that take the messages.
    """

    def __init__(
        self,
        sinks: Sequence[Sink],
        params: ScanValidatorParams,
        tracker: Optional[ObstacleTracker] = None,
    ) -> None:
        """Hand messages to sinks, and the scans to a tracker before.

        Args:
            sinks: Layers and sources that take the messages.
            params: Parameters of the scan validation.
            tracker: Tracker of moving obstacles, which are not marked then.
        """
        self.sinks = tuple(sinks)
        self._tracker = tracker
        frames = [sink.costmap.params.global_frame for sink in self.sinks]
        is_tracked = tracker is not None and tracker.frame in frames
        self._tracking_sink = frames.index(tracker.frame) if tracker and is_tracked else None
        self._keys = [sink.layer.projection_key(sink.source.name) for sink in self.sinks]
        self._buffers = [sink.layer.buffers[sink.source.name] for sink in self.sinks]
        self._params = params
        self._validator = ScanValidator(sink.source for sink in self.sinks)

    @property
    def expected_period_s(self) -> float:
        """Longest silence with which every layer stays current, in seconds; 0 for any."""
        return self._validator.expected_period_s

    def reconfigure(self, params: ScanValidatorParams) -> None:
        """Take other parameters, and those of the buffers; what the validator has seen stays."""
        self._params = params
        self._validator.expect(buffer.params for buffer in self._buffers)

    def reset(self) -> None:
        """Forget earlier scans, after the clock has jumped."""
        self._validator.reset()
        if self._tracker is not None:
            self._tracker.reset()

    def is_late(self, stamp_s: float, now_s: float) -> bool:
        """Tell whether a scan with this stamp is rejected now for its age."""
        rejects = self._params.reject_implausible_scans
        return rejects and bool(self._validator.late_reason(stamp_s, now_s))

    def add_scan(
        self, scan: Scan, poses: Sequence[SensorPose], received_s: float, now_s: float
    ) -> str:
        """Hand a scan to the layers unless it is implausible.

        Args:
            scan: The scan, in the frame of ``poses[k].frame``.
            poses: Poses at the scan's stamp, one for each sink.
            received_s: When the scan arrived. With ``reject_implausible_scans`` the stamp
                counts if it is earlier, so that late scans are not taken for recent ones.
            now_s: Current time, against which the validator judges the scan's age.

        Returns:
            The reason for which the scan was rejected, "" if the layers have it.
        """
        if self.sinks and self._params.reject_implausible_scans:
            reason = self._validator.rejection_reason(scan, poses[0].frame, now_s)
            if reason:
                return reason

        tracked = self._track(scan, poses)
        moving = tracked.moving_beams if tracked is not None and tracked.any_moving else None

        def make(sink: Sink, pose: SensorPose) -> Observation:
            name, layer = sink.source.name, sink.layer
            return layer.observe_scan(name, scan, pose.frame, pose.origin, moving)

        self._add(make, poses, scan.stamp_s, received_s)
        return ""

    def _track(self, scan: Scan, poses: Sequence[SensorPose]) -> Optional[TrackedScan]:
        """Show the tracker a scan, and free the cells that obstacles have left."""
        k, tracker = self._tracking_sink, self._tracker
        if k is None or tracker is None:
            return None
        sink, pose = self.sinks[k], poses[k].frame
        _, low_m, high_m = self._keys[k]
        circles = sink.layer.excluded_circles
        name = sink.source.topic or sink.source.name
        tracked = tracker.add_scan(name, scan, pose, (low_m, high_m), circles)
        if tracked is not None and len(tracked.vacated):
            at_sensor = pose.inverse().transform_points(tracked.vacated)
            for other, there in zip(self.sinks, poses):
                other.layer.forget_points(there.frame.transform_points(at_sensor))
        return tracked

    def add_cloud(
        self,
        points: NDArray[np.float32],
        poses: Sequence[SensorPose],
        stamp_s: float,
        received_s: float,
    ) -> None:
        """Hand a point cloud to the layers.

        Args:
            points: float32[n, 3], metres in the frame of ``poses[k].frame``, all finite.
            poses: Poses at the cloud's stamp, one for each sink.
            stamp_s: When the points were measured.
            received_s: When the cloud arrived, as for ``add_scan``.
        """

        def make(sink: Sink, pose: SensorPose) -> Observation:
            layer, name = sink.layer, sink.source.name
            return layer.observe_cloud(name, points, pose.frame, stamp_s, pose.origin)

        self._add(make, poses, stamp_s, received_s)

    def _add(
        self, make: _MakeObservation, poses: Sequence[SensorPose], stamp_s: float, received_s: float
    ) -> None:
        if self._params.reject_implausible_scans:
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
