"""Node ``amcl``: topics, services, tf and parameters of one robot's localisation.

Callbacks store scans; the main thread hands them over when tf knows where the robot was.
"""

from __future__ import annotations

import random
import threading
import time
from collections import deque
from dataclasses import replace
from typing import Any, Dict, List, Optional

import numpy as np
import rospy
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from nav_msgs.srv import GetMap, SetMap, SetMapRequest, SetMapResponse
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse
from tf2_msgs.msg import TFMessage

from quad_localization.localizer import Amcl, Observation, PoseEstimate, is_covariance
from quad_localization.occupancy_map import OccupancyMap
from quad_localization.parameters import AmclParams, read_params
from quad_localization.ros.peers import PeerPlaces
from quad_localization.scan_beams import tilted_yaw
from quad_localization.start import initial_pose
from quad_localization.warm_up import warm_up_amcl
from quad_nav.errors import InputError, excerpt
from quad_nav.files.kernel_cache import COMPILING, announced
from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.parameter import parameters_of
from quad_nav.ros.common.conversions import (
    pose_array_message,
    pose_from_message,
    pose_message,
    scan_from_message,
    transform_message,
)
from quad_nav.ros.common.diagnostics import ThrottledWarnings, publish_health
from quad_nav.ros.common.readiness import init_node
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.ros.navigator.reconfigure import ParameterServer, config_type
from quad_nav.ros.navigator.robot_identity import number_in
from quad_nav.topics.health import Health, Level
from quad_nav.topics.validation import grid_problem, pose_problem, scan_problem, stamp_problem

_QUEUE = 100
_POLL_S = 0.01  # wall time: how late a transform is noticed
_TF_WAIT_S = 0.5
_ASK_AGAIN_S = 0.5
_SILENT_S = 15.0
_PARAMETERS = [one for one in parameters_of(AmclParams) if not one.is_fixed]
_ALPHAS = ("recovery_alpha_slow", "recovery_alpha_fast")


class AmclNode:
    """Everything that the node has."""

    def __init__(self) -> None:
        """Read the parameters, advertise, and ask for the map."""
        self._name, self._warnings = rospy.get_name().lstrip("/"), ThrottledWarnings()
        given = rospy.get_param("~", {})
        params = self._read(given)
        seed = params.seed if params.seed >= 0 else random.SystemRandom().randrange(2**31)
        rospy.loginfo("%s: seed of the random numbers: %d", self._name, seed)
        self._amcl, self._lock = Amcl(params, seed), threading.RLock()
        self._transforms, self._scans = Transforms(), deque(maxlen=_QUEUE)  # type: ignore[var-annotated]
        self._scan_s: Optional[float] = None  # wall time of the last scan
        self._saved_s, self._saver = 0.0, threading.Thread()
        self._odom_from_base: Optional[Pose3D] = None
        self._peers = self._find_peers(params)
        self._pose = rospy.Publisher(
            "amcl_pose", PoseWithCovarianceStamped, queue_size=2, latch=True
        )
        self._cloud = rospy.Publisher("particlecloud", PoseArray, queue_size=2, latch=True)
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=100)
        rospy.Service("global_localization", Empty, self._on_global_localization)
        rospy.Service("request_nomotion_update", Empty, self._on_update_request)
        rospy.Service("set_map", SetMap, self._on_set_map)
        rospy.Subscriber("scan", LaserScan, self._on_scan, queue_size=_QUEUE)
        rospy.Subscriber(
            "initialpose", PoseWithCovarianceStamped, self._on_initial_pose, queue_size=2
        )
        self._serve_parameters(given)
        if params.use_map_topic:
            self._map = rospy.Subscriber("map", OccupancyGrid, self._on_map, queue_size=1)
        else:
            threading.Thread(target=self._ask_for_map, name="map", daemon=True).start()
        publish_health(self._health)

    def _read(self, given: Dict[str, Any]) -> AmclParams:
        params, faults = read_params(given)
        for fault in faults:
            self._warn(fault)
        return params

    def _warn(self, text: str) -> None:
        self._warnings.warn(f"{self._name}: {text}")

    def _find_peers(self, params: AmclParams) -> Optional[PeerPlaces]:
        robot = params.robot if params.robot >= 0 else number_in(params.base_frame_id)
        robot = number_in(self._name) if robot is None else robot
        if params.peer_radius_m <= 0.0 or params.upstream:
            return None
        if robot is None:
            self._warn("no number in base_frame_id or in the node's name: peers are not left out")
            return None
        return PeerPlaces(robot, self._transforms)

    # Maps.

    def _ask_for_map(self) -> None:
        service = rospy.ServiceProxy("static_map", GetMap)
        while not rospy.is_shutdown():
            try:
                self._take_map(service().map)
                return
            except (rospy.ServiceException, rospy.ROSException, OSError) as error:
                self._warn(f"{service.resolved_name}: no map yet, asking again: {error}")
            time.sleep(_ASK_AGAIN_S)

    def _on_map(self, message: OccupancyGrid) -> None:
        if self._take_map(message) and self._amcl.params.first_map_only:
            self._map.unregister()

    def _take_map(self, message: OccupancyGrid) -> bool:
        """Take a map; return false if it is not valid."""
        info, origin = message.info, message.info.origin.position
        size, place = (info.width, info.height), (origin.x, origin.y)
        problem = grid_problem(*size, info.resolution, len(message.data), place, 16)
        if problem:
            self._warn(f"map dropped: {problem}")
            return False
        frame, wanted = message.header.frame_id.lstrip("/"), self._amcl.params.global_frame_id
        if frame != wanted:
            self._warn(f"the map is in frame '{excerpt(frame)}', expected '{wanted}'; using it")
        cells = np.array(message.data, np.int8).reshape(info.height, info.width)
        grid = OccupancyMap.from_occupancy(
            cells, info.resolution, *place, self._amcl.params.upstream
        )
        one = self._read(rospy.get_param("~", {}))
        robot = one.robot if one.robot >= 0 else number_in(one.base_frame_id) or 0
        try:
            pose = initial_pose(one, robot)
        except InputError as error:
            self._warn(f"map dropped: {error}")
            return False
        variances = (one.initial_cov_xx, one.initial_cov_yy, one.initial_cov_aa)
        with self._lock:
            self._amcl.set_map(grid, PoseEstimate(pose, np.diag(variances)))
        rospy.loginfo("%s: map of %d x %d cells", self._name, info.width, info.height)
        return True

    def _on_set_map(self, request: SetMapRequest) -> SetMapResponse:
        with self._lock:
            is_valid = self._take_map(request.map)
            if is_valid:
                is_valid = self._take_pose(request.initial_pose)
                if self._amcl.params.force_update_after_set_map:
                    self._amcl.is_update_requested = True
        return SetMapResponse(is_valid or self._amcl.params.upstream)

    # Poses and requests.

    def _on_initial_pose(self, message: PoseWithCovarianceStamped) -> None:
        if self._take_pose(message) and self._amcl.params.force_update_after_initialpose:
            self._amcl.is_update_requested = True

    def _take_pose(self, message: PoseWithCovarianceStamped) -> bool:
        """Begin anew at a pose, moved by the odometry since its stamp; return false if invalid."""
        frame, params = message.header.frame_id.lstrip("/"), self._amcl.params
        pose = pose_from_message(message.pose.pose)
        matrix = np.array(message.pose.covariance, np.float64).reshape(6, 6)
        covariance = np.zeros((3, 3))
        covariance[:2, :2], covariance[2, 2] = matrix[:2, :2], matrix[5, 5]
        problem = pose_problem(pose)
        if frame not in ("", params.global_frame_id):
            problem = f"frame '{excerpt(frame)}', expected '{params.global_frame_id}'"
        elif not is_covariance(covariance):
            problem = "the covariance is not positive semidefinite"
        if problem:
            self._warn(f"initial pose dropped: {problem}")
            return False
        pose = pose.compose(self._motion_since(message.header.stamp))
        planar = Pose2D(pose.x_m, pose.y_m, tilted_yaw(pose.quaternion))
        with self._lock:
            self._amcl.set_pose(PoseEstimate(planar, covariance))
        rospy.loginfo("%s: pose set: %s", self._name, planar)
        return True

    def _motion_since(self, stamp: rospy.Time) -> Pose3D:
        """Return the motion of the base since a stamp by odometry; none if tf does not know."""
        frames = self._amcl.params.odom_frame_id, self._amcl.params.base_frame_id
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

    def _serve_parameters(self, given: Dict[str, Any]) -> None:
        values = {one.name: getattr(self._amcl.params, one.field) for one in _PARAMETERS}
        if self._amcl.params.upstream:  # the server's defaults turn recovery off
            values.update({name: 0.0 for name in _ALPHAS if name not in given})
        self._at_start: Optional[Dict[str, Any]] = None
        kind = config_type("AMCLConfig", _PARAMETERS)
        self._server = ParameterServer(kind, self._on_reconfigure, "~", values)

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
            self._amcl.reconfigure(replace(self._amcl.params, **changes))
        requested.update({one.name: changes[one.field] for one in _PARAMETERS})
        return requested

    # Scans.

    def _on_scan(self, message: LaserScan) -> None:
        self._scan_s = time.monotonic()
        self._scans.append(message)

    def run(self) -> None:
        """Handle scans until ROS shuts down."""
        before_s = rospy.get_time()
        while not rospy.is_shutdown():
            if rospy.get_time() < before_s:
                self._warn("the clock jumped back: waiting scans dropped")
                self._scans.clear()
                self._saved_s = 0.0
            before_s = rospy.get_time()
            if self._peers is not None:
                self._peers.check()
            while self._scans and self._handle(self._scans[0]):
                self._scans.popleft()
            time.sleep(_POLL_S)

    def _handle(self, message: LaserScan) -> bool:
        """Hand a scan over; return false if it has to wait for tf."""
        params, stamp, frame = self._amcl.params, message.header.stamp, message.header.frame_id
        scan = scan_from_message(message)
        problem = stamp_problem(scan.stamp_s, rospy.get_time())
        if not (problem or params.upstream):
            problem = scan_problem(scan)
        try:
            if not problem:
                odometry = self._transforms.lookup(
                    params.odom_frame_id, params.base_frame_id, stamp
                )
                mount = self._transforms.lookup(params.base_frame_id, frame)
        except TransformUnavailable as error:
            latest = self._transforms.locate(
                params.odom_frame_id, params.base_frame_id, scan.stamp_s, 0.0
            )
            if latest is None and (error.later or self._odom_from_base is None):
                if len(self._scans) == _QUEUE:
                    self._warn(f"scans wait for tf: {error}")
                return False  # the stamp is younger than the latest transform
            problem = str(error)
        if problem:
            self._warn(f"scan dropped: {problem}")
            return True
        self._odom_from_base = odometry
        peers = np.empty((0, 2))
        if self._peers is not None:
            peers = self._peers.at(scan.stamp_s, params.global_frame_id)
        self._localise(stamp, Observation(frame.lstrip("/"), scan, mount, odometry, peers))
        return True

    def _localise(self, stamp: rospy.Time, seen: Observation) -> None:
        with self._lock:
            update, params = self._amcl.update(seen), self._amcl.params
            is_lost = self._amcl.is_lost
            if update is None:
                return
            particles = self._amcl.particles
            assert particles is not None
            poses = particles.poses.copy() if update.shows_cloud else None
        if poses is not None:
            cloud = pose_array_message(poses, rospy.get_time())
            cloud.header.frame_id = params.global_frame_id
            self._cloud.publish(cloud)
        if update.estimate is not None:
            self._pose.publish(_pose_message(update.estimate, params.global_frame_id, stamp))
        if update.map_from_odom is None:
            return
        if params.tf_broadcast and not is_lost:  # without it the navigator stops
            frames = params.global_frame_id, params.odom_frame_id
            until = stamp + rospy.Duration(params.transform_tolerance_s)
            self._tf.publish(TFMessage([transform_message(update.map_from_odom, *frames, until)]))
        rate_hz, now_s = params.save_pose_rate_hz, rospy.get_time()
        is_due = rate_hz > 0.0 and now_s - self._saved_s >= 1.0 / rate_hz
        if update.estimate is None and is_due and not self._saver.is_alive():
            self._saved_s = now_s
            self._saver = threading.Thread(target=self.save_pose, daemon=True)
            self._saver.start()  # the ROS master may hang

    def save_pose(self) -> None:
        """Store the present pose as the parameters of the initial one."""
        with self._lock:
            transform, odometry = self._amcl.map_from_odom, self._odom_from_base
            estimate = self._amcl.estimate
        if transform is None or odometry is None or estimate is None:
            return
        pose, variances = transform.compose(odometry), np.diag(estimate.covariance).tolist()
        values = (pose.x_m, pose.y_m, tilted_yaw(pose.quaternion), *variances)
        for name, value in zip(
            ("pose_x", "pose_y", "pose_a", "cov_xx", "cov_yy", "cov_aa"), values
        ):
            rospy.set_param(f"~initial_{name}", value)

    def _health(self) -> List[Health]:
        params, estimate = self._amcl.params, self._amcl.estimate
        silent_s = time.monotonic() - (self._scan_s or 0.0)
        level, message = Level.OK, "OK"
        values = {}
        if self._amcl.particles is None:
            level, message = Level.ERROR, "no map"
        elif self._scan_s is None or silent_s > _SILENT_S:
            level, message = Level.WARN, "no scans"
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
            if level is Level.OK and any(np.greater(deviations, limits)):
                level, message = Level.WARN, "Too large"
        return [Health(f"{self._name}: Standard deviation", self._name, level, message, values)]


def _pose_message(
    estimate: PoseEstimate, frame: str, stamp: rospy.Time
) -> PoseWithCovarianceStamped:
    message = PoseWithCovarianceStamped()
    message.header.frame_id, message.header.stamp = frame, stamp
    message.pose.pose = pose_message(estimate.pose.to_3d())
    matrix = np.zeros((6, 6))
    matrix[:2, :2], matrix[5, 5] = estimate.covariance[:2, :2], estimate.covariance[2, 2]
    message.pose.covariance = matrix.ravel().tolist()
    return message


def main() -> int:
    """Run the node; return 0 after a shutdown."""
    nodes: List[AmclNode] = []

    def save() -> None:
        for node in nodes:
            node.save_pose()

    init_node("amcl", save)
    with announced(lambda: rospy.loginfo("%s", COMPILING)):
        warm_up_amcl()
    try:
        nodes.append(AmclNode())
        nodes[0].run()
    except rospy.ROSException:
        if not rospy.core.is_shutdown_requested():  # at shutdown rospy closes the topics
            raise
    return 0
