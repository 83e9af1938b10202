"""amcl of one robot as other nodes see it: topics, services and parameters.

Scans come by calls, from the node ``amcl`` or from the simulation in the same process.
"""

from __future__ import annotations

import random
import threading
import time
from dataclasses import replace
from typing import Any, Callable, Dict, Optional, Tuple

import numpy as np
import rospy
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid
from nav_msgs.srv import GetMap, SetMap, SetMapRequest, SetMapResponse
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from quad_localization.localizer import Amcl, Observation, PoseEstimate
from quad_localization.occupancy_map import OccupancyMap
from quad_localization.parameters import AmclParams, read_params
from quad_localization.ros.given_pose import given_pose
from quad_localization.scan_beams import tilted_yaw
from quad_nav.errors import excerpt
from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.parameter import parameters_of
from quad_nav.ros.common.conversions import pose_estimate_message, transform_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.packed_messages import pose_array_message
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.ros.navigator.reconfigure import ParameterServer, config_type
from quad_nav.ros.navigator.robot_identity import number_in
from quad_nav.topics.health import Health, Level
from quad_nav.topics.publishing import Names, own_node
from quad_nav.topics.validation import grid_problem

_POLL_S = 0.01  # wall time: how late a transform is noticed
_TF_WAIT_S = 0.5
_ASK_AGAIN_S = 0.5
SILENT_S = 15.0
"""Time without a scan that could be used after which `/diagnostics` warns."""
_PARAMETERS = [one for one in parameters_of(AmclParams) if not one.is_fixed]
_STARTS = "/amcl_starts"  # parameter: those that `quad_localization.start` has found
_ALPHAS = ("recovery_alpha_slow", "recovery_alpha_fast")


class AmclRobot:
    """Topics, services and parameters of one robot's amcl.

    Attributes:
        name: Name of the node that it is, for messages.
    """

    def __init__(
        self,
        transforms: Transforms,
        send: Callable[[TransformStamped], None],
        names: Names = own_node,
    ) -> None:
        """Read the parameters, advertise, and ask for the map; ``send`` publishes transforms."""
        self.name = (rospy.get_name() if names is own_node else names("~")).strip("/")
        self._warnings, self._names = ThrottledWarnings(), names
        params = self._read(rospy.get_param(names("~"), {}))
        seed = params.seed if params.seed >= 0 else random.SystemRandom().randrange(2**31)
        rospy.loginfo("%s: seed of the random numbers: %d", self.name, seed)
        self._amcl, self._lock = Amcl(params, seed), threading.RLock()
        self._transforms, self._send = transforms, send
        self._last: Optional[Tuple[rospy.Time, Observation]] = None
        self._saved_s, self._saver = 0.0, threading.Thread()
        self._start: Optional[PoseEstimate] = None
        self._pose = rospy.Publisher(
            names("amcl_pose"), PoseWithCovarianceStamped, queue_size=2, latch=True
        )
        self._cloud = rospy.Publisher(names("particlecloud"), PoseArray, queue_size=2, latch=True)
        rospy.Service(names("global_localization"), Empty, self._on_global_localization)
        rospy.Service(names("request_nomotion_update"), Empty, self._on_update_request)
        rospy.Service(names("set_map"), SetMap, self._on_set_map)
        rospy.Subscriber(
            names("initialpose"), PoseWithCovarianceStamped, self._on_initial_pose, queue_size=2
        )
        self._serve_parameters()
        if params.use_map_topic:
            self._map = rospy.Subscriber(names("map"), OccupancyGrid, self._on_map, queue_size=1)
        else:
            threading.Thread(target=self._ask_for_map, name="map", daemon=True).start()

    @property
    def params(self) -> AmclParams:
        """Parameters in force."""
        return self._amcl.params

    @property
    def robot(self) -> Optional[int]:
        """Number of the robot; None if its names have none."""
        params = self.params
        robot = params.robot if params.robot >= 0 else number_in(params.base_frame_id)
        return number_in(self.name) if robot is None else robot

    @property
    def leaves_out_peers(self) -> bool:
        """Whether beams that end on peers are left out."""
        return self.params.peer_radius_m > 0.0 and not self.params.upstream

    def reset(self) -> None:
        """Begin anew at the pose of the start, after a reset of the simulation."""
        with self._lock:
            if self._start is not None:
                self._amcl.set_pose(self._start)

    def _warn(self, text: str) -> None:
        self._warnings.warn(f"{self.name}: {text}")

    def _read(self, given: Dict[str, Any]) -> AmclParams:
        params, faults = read_params(given)
        for fault in faults:
            self._warn(fault)
        return params

    # Maps.

    def _ask_for_map(self) -> None:
        service = rospy.ServiceProxy(self._names("static_map"), GetMap)
        while not rospy.is_shutdown():
            try:
                if self._take_map(service().map):
                    return
            except (rospy.ServiceException, rospy.ROSException, OSError) as error:
                self._warn(f"{service.resolved_name}: no map yet, asking again: {error}")
            time.sleep(_ASK_AGAIN_S)

    def _on_map(self, message: OccupancyGrid) -> None:
        if self._take_map(message) and self.params.first_map_only:
            self._map.unregister()

    def _take_map(self, message: OccupancyGrid) -> bool:
        """Take a map; return false if it is not valid."""
        info, origin = message.info, message.info.origin.position
        size, place = (info.width, info.height), (origin.x, origin.y)
        problem = grid_problem(*size, info.resolution, len(message.data), place, 16)
        if problem:
            self._warn(f"map dropped: {problem}")
            return False
        frame, wanted = message.header.frame_id.lstrip("/"), self.params.global_frame_id
        if frame != wanted:
            self._warn(f"the map is in frame '{excerpt(frame)}', expected '{wanted}'; using it")
        cells = np.array(message.data, np.int8).reshape(info.height, info.width)
        grid = OccupancyMap.from_occupancy(cells, info.resolution, *place, self.params.upstream)
        start = self._initial_pose()
        with self._lock:
            self._start = self._start or start
            waiting = None if self._amcl.has_map else self._last
            self._amcl.set_map(grid, start)
        rospy.loginfo("%s: map of %d x %d cells", self.name, info.width, info.height)
        if waiting is not None:
            self.localise(*waiting)
        return True

    def _initial_pose(self) -> PoseEstimate:
        """Return where the parameters say that it is; without them where the scene starts it."""
        given = rospy.get_param(self._names("~"), {})
        params = self._read(given)
        row = params.initial_pose_x_m, params.initial_pose_y_m, params.initial_pose_a_rad
        if "initial_pose_x" not in given:  # neither a launch file nor `save_pose` has set it
            row = rospy.get_param(f"{_STARTS}/quad{self.robot}", None) or row
        variances = params.initial_cov_xx, params.initial_cov_yy, params.initial_cov_aa
        return PoseEstimate(Pose2D(*row), np.diag(variances))

    def _on_set_map(self, request: SetMapRequest) -> SetMapResponse:
        with self._lock:
            is_valid = self._take_map(request.map)
            if is_valid:
                is_valid = self._take_pose(request.initial_pose)
                if self.params.force_update_after_set_map:
                    self._amcl.is_update_requested = True
        return SetMapResponse(is_valid or self.params.upstream)

    # Poses and requests.

    def _on_initial_pose(self, message: PoseWithCovarianceStamped) -> None:
        if self._take_pose(message) and self.params.force_update_after_initialpose:
            self._amcl.is_update_requested = True

    def _take_pose(self, message: PoseWithCovarianceStamped) -> bool:
        """Begin anew at a pose, moved by the odometry since its stamp; return false if invalid."""
        try:
            pose, covariance = given_pose(message, self.params.global_frame_id)
        except ValueError as error:
            self._warn(f"initial pose dropped: {error}")
            return False
        pose = pose.compose(self._motion_since(message.header.stamp))
        planar = Pose2D(pose.x_m, pose.y_m, tilted_yaw(pose.quaternion))
        with self._lock:
            self._amcl.set_pose(PoseEstimate(planar, covariance))
        place = f"({planar.x_m:.2f}, {planar.y_m:.2f}) m, {planar.yaw_rad:.2f} rad"
        rospy.loginfo("%s: pose set to %s", self.name, place)
        return True

    def _motion_since(self, stamp: rospy.Time) -> Pose3D:
        """Return the motion of the base since a stamp by odometry; none if tf does not know."""
        frames = self.params.odom_frame_id, self.params.base_frame_id
        end_s = time.monotonic() + _TF_WAIT_S
        while not stamp.is_zero():
            try:
                before = self._transforms.lookup(*frames, stamp)
                return before.inverse().compose(self._transforms.lookup(*frames))
            except TransformUnavailable as error:
                if not error.later or time.monotonic() > end_s:
                    self._warn(f"initial pose taken as the present one: {error}")
                    break
            time.sleep(_POLL_S)
        return Pose3D(0.0, 0.0, 0.0)

    def _on_global_localization(self, _: EmptyRequest) -> EmptyResponse:
        with self._lock:
            if not self._amcl.set_uniform():
                self._warn("global localization: no map with free cells")
        return EmptyResponse()

    def _on_update_request(self, _: EmptyRequest) -> EmptyResponse:
        self._amcl.is_update_requested = True
        return EmptyResponse()

    # Parameters.

    def _serve_parameters(self) -> None:
        given = rospy.get_param(self._names("~"), {})
        values = {one.name: getattr(self.params, one.field) for one in _PARAMETERS}
        if self.params.upstream:  # the server's defaults turn recovery off
            values.update({name: 0.0 for name in _ALPHAS if name not in given})
        self._at_start: Optional[Dict[str, Any]] = None
        kind = config_type("AMCLConfig", _PARAMETERS)
        self._server = ParameterServer(kind, self._on_reconfigure, self._names("~"), values)

    def _on_reconfigure(self, requested: Any, level: int) -> Any:
        values = {one.name: requested[one.name] for one in _PARAMETERS}
        if self._at_start is None:  # the server's first call
            self._at_start = values
            return requested
        if values["restore_defaults"]:
            values = self._at_start
        values["max_particles"] = max(values["max_particles"], values["min_particles"])
        read, faults = read_params(values)
        for fault in faults:
            self._warn(f"reconfiguration: {fault}")
        with self._lock:
            changes = {one.field: getattr(read, one.field) for one in _PARAMETERS}
            self._amcl.reconfigure(replace(self.params, **changes))
        requested.update({one.name: changes[one.field] for one in _PARAMETERS})
        return requested

    # Scans.

    def localise(self, stamp: rospy.Time, seen: Observation) -> None:
        """Take a scan and publish what it tells; without a map it waits for the map."""
        with self._lock:
            self._last = stamp, seen
            if not self._amcl.has_map:
                self._warn("no map yet: no transform until there is one")
            update, params = self._amcl.update(seen), self.params
            is_lost, transform = self._amcl.is_lost, self._amcl.map_from_odom
            if update is None:
                return
            poses = self._amcl.cloud.copy() if update.shows_cloud else None
        frame, found = params.global_frame_id, update.estimate
        if poses is not None:
            self._cloud.publish(pose_array_message(poses, rospy.get_time(), frame))
        if found is not None:
            self._pose.publish(pose_estimate_message(found.pose, found.covariance, frame, stamp))
        if transform is None:
            return
        if params.tf_broadcast and not is_lost:  # without it the navigator stops
            until = stamp + rospy.Duration(params.transform_tolerance_s)
            self._send(transform_message(transform, frame, params.odom_frame_id, until))
        rate_hz, now_s = params.save_pose_rate_hz, rospy.get_time()
        is_due = rate_hz > 0.0 and not is_lost and abs(now_s - self._saved_s) >= 1.0 / rate_hz
        if found is None and is_due and not self._saver.is_alive():
            self._saved_s = now_s
            self._saver = threading.Thread(target=self.save_pose, daemon=True)
            self._saver.start()  # the ROS master may hang

    def save_pose(self) -> None:
        """Store the present pose as the parameters of the initial one."""
        with self._lock:
            transform, estimate = self._amcl.map_from_odom, self._amcl.estimate
            last = self._last
        if transform is None or estimate is None or last is None:
            return
        pose = transform.compose(last[1].odom_from_base)
        variances = np.diag(estimate.covariance).tolist()
        values = (pose.x_m, pose.y_m, tilted_yaw(pose.quaternion), *variances)
        for name, value in zip(
            ("pose_x", "pose_y", "pose_a", "cov_xx", "cov_yy", "cov_aa"), values
        ):
            rospy.set_param(self._names(f"~initial_{name}"), value)

    def health(self) -> Health:
        """Return the status for `/diagnostics`."""
        params, estimate = self.params, self._amcl.estimate
        level, message = Level.OK, "OK"
        values = {}
        search, fit = self._amcl.search, self._amcl.fit
        if not self._amcl.has_map:
            level, message = Level.ERROR, "no map"
        elif self._amcl.is_lost:
            level, message = Level.ERROR, "lost"
            if search.is_on and search.is_complete:
                message += (
                    ": other places fit as well" if search.is_ambiguous else ": no place fits"
                )
        elif self._last is None or rospy.get_time() - self._last[0].to_sec() > SILENT_S:
            level, message = Level.WARN, "no scans with odometry"
        elif estimate is None:
            level, message = Level.WARN, "no pose"
        if estimate is not None:
            names = ("x", "y", "yaw")
            deviations = np.sqrt(np.maximum(np.diag(estimate.covariance), 0.0)).tolist()
            limits = (
                params.std_warn_level_x_m,
                params.std_warn_level_y_m,
                params.std_warn_level_yaw_rad,
            )
            values = {f"std_{name}": f"{value:.4f}" for name, value in zip(names, deviations)}
            values.update({f"std_warn_level_{n}": f"{one:g}" for n, one in zip(names, limits)})
            if fit is not None:
                values["fit"] = f"{fit:.2f}"
            if level is Level.OK and any(np.greater(deviations, limits)):
                level, message = Level.WARN, "Too large"
        return Health(f"{self.name}: Standard deviation", self.name, level, message, values)
