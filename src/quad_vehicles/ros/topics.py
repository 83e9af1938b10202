"""Topics of one vehicle: odometry, transforms, scans, state; and its mission's services."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace
from typing import Callable, Dict, Optional, Tuple

import rospy
from nav_msgs.msg import Odometry
from quad.msg import VehicleState
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

from quad_nav.files.values import is_number
from quad_nav.geometry import Pose2D, Pose3D, Scan
from quad_nav.ros.common.conversions import (
    ScanMessage,
    odometry_message,
    scan_message,
    time_message,
    transform_message,
)
from quad_nav.topics.health import Health, Level
from quad_nav.topics.vehicle_states import IN_FLIGHT, ON_GROUND, State
from quad_vehicles.safety import LOST_HOVER_S
from quad_vehicles.states import VehicleMachine
from quad_vehicles.telemetry import Estimate, Landed
from quad_vehicles.vehicle_file import AMCL, FIXED, SLAM, Vehicle

_SERVICE_WAIT_S = 2.0
_MISSION_PERIOD_S = 1.0
_TAKE_OFFS = "~take_offs"  # parameter: x, y, yaw and z of the first and of the last one
Place = Tuple[Pose2D, float]
"""Where a vehicle has taken off: pose and height of the ground in the odometry frame."""
_GOOD = (State.READY, State.FLYING, State.HOLDING, State.LANDED, State.TAKING_OFF, State.ARMING)


class VehicleTopics:
    """Publishers of one vehicle."""

    def __init__(self, vehicle: Vehicle, respawned: bool) -> None:
        """Advertise the topics.

        Args:
            vehicle: The vehicle.
            respawned: Whether the bridge before was killed.
        """
        self.starts = StartMemory(respawned)
        i = vehicle.number
        self._vehicle = vehicle
        self._odom, self._base, self._lidar = f"odom{i}", f"base_link{i}", f"Lidar{i}"
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=10)
        self._odometry = rospy.Publisher(f"/odom{i}", Odometry, queue_size=10, tcp_nodelay=True)
        self._state = rospy.Publisher(f"/vehicle{i}/state", VehicleState, queue_size=10, latch=True)
        self._is_localized = vehicle.localization != FIXED
        self._map_from_odom: Optional[Pose3D] = vehicle.map_from_odom
        self._on_ground: Optional[Pose3D] = None  # the same before the first take-off
        self._scan: Optional[rospy.Publisher] = None
        self._relay: Optional[rospy.Subscriber] = None
        self._advertise_scan()

    def _advertise_scan(self) -> None:
        lidar, topic = self._vehicle.lidar, f"/scan{self._vehicle.number}"
        if lidar is None or lidar.topic == topic:
            return
        type_ = LaserScan if lidar.topic else ScanMessage
        self._scan = rospy.Publisher(topic, type_, queue_size=10)
        if lidar.topic:
            self._relay = rospy.Subscriber(lidar.topic, LaserScan, self._pass_on, queue_size=2)

    def _pass_on(self, message: LaserScan) -> None:
        """Publish a driver's scan in the frame that the navigator expects."""
        message.header.frame_id = self._lidar
        if self._scan is not None:
            self._scan.publish(message)

    def publish_scan(self, scan: Scan) -> None:
        """Publish a scan of the vehicle's own sensors; its stamp is monotonic time."""
        if self._scan is not None:
            self._scan.publish(
                scan_message(replace(scan, stamp_s=scan.stamp_s + _clock_offset_s()), self._lidar)
            )

    def publish_estimate(self, estimate: Estimate, machine: VehicleMachine) -> None:
        """Publish odometry and transforms; the estimate's stamp is monotonic time."""
        stamp = time_message(estimate.stamp_s + _clock_offset_s())
        pose = self._levelled(estimate.odom_from_base, machine)
        self._odometry.publish(
            odometry_message(
                pose,
                estimate.linear_mps,
                estimate.angular_radps,
                (self._odom, self._base),
                stamp,
            )
        )
        transforms = [transform_message(pose, self._odom, self._base, stamp)]
        lidar = self._vehicle.lidar
        mount = _DEFAULT_MOUNT if lidar is None else lidar.base_from_lidar
        transforms.append(transform_message(mount, self._base, self._lidar, stamp))
        map_from_odom = self.map_from_odom(pose, machine)
        if map_from_odom is not None:
            transforms.insert(0, transform_message(map_from_odom, "map", self._odom, stamp))
        self._tf.publish(TFMessage(transforms))

    def map_from_odom(self, odom_from_base: Pose3D, machine: VehicleMachine) -> Optional[Pose3D]:
        """Return the pose of the odometry frame; None if a localization publishes it.

        With a known pose at the start it is fixed at the first take-off. Before, it follows the
        estimate on the ground, which drifts while the vehicle stands still. In the air nobody knows
        it, if the vehicle was not seen on the ground.
        """
        start = self._vehicle.map_from_start
        if self._is_localized or self._map_from_odom is not None or start is None:
            return self._map_from_odom
        if self.starts.first is not None:
            self._map_from_odom = frame_at(start, *self.starts.first)
            return self._map_from_odom
        if machine.state in ON_GROUND:
            self._on_ground = frame_at(start, odom_from_base.to_2d(), odom_from_base.z_m)
        return self._on_ground

    def _levelled(self, pose: Pose3D, machine: VehicleMachine) -> Pose3D:
        """Return a pose of odometry for amcl and slam, which work in the plane.

        It counts heights from the ground, because they leave ``odom{i}`` at the height of ``map``:
        the origin of an autopilot's heights is where it was switched on, and its barometer drifts.
        """
        if self._vehicle.localization not in (AMCL, SLAM):
            return pose
        ground_m = pose.z_m if machine.state in ON_GROUND else machine.ground_m
        return replace(pose, z_m=pose.z_m - ground_m)

    def is_lost(self, machine: VehicleMachine) -> bool:
        """Return whether the vehicle is in the air and nobody knows where in ``map``."""
        if self._is_localized:
            return machine.inputs.lost_s(time.monotonic()) > LOST_HOVER_S
        status = machine.inputs.status
        is_up = status is not None and status.is_armed
        is_up = is_up and machine.inputs.landed is not Landed.ON_GROUND
        is_known = self._on_ground is not None or self.starts.first is not None
        return self._vehicle.map_from_start is not None and is_up and not is_known

    def publish_state(self, machine: VehicleMachine) -> None:
        """Publish the state, latched."""
        status, battery = machine.inputs.status, machine.inputs.battery
        self._state.publish(
            VehicleState(
                header=Header(0, rospy.Time.now(), self._base),
                state=machine.state.number,
                reason=machine.reason,
                mode="" if status is None else status.mode,
                armed=status is not None and status.is_armed,
                height=machine.inputs.height_m(machine.ground_m),
                battery=math.nan if battery is None else battery,
            )
        )


_DEFAULT_MOUNT = Pose3D(0.0, 0.0, 0.06)


def frame_at(map_from_base: Pose2D, odom_from_base: Pose2D, ground_m: float) -> Pose3D:
    """Return the pose of the odometry frame in which both poses are the same place."""
    frame = map_from_base.compose(odom_from_base.inverse()).to_3d()
    return Pose3D(frame.x_m, frame.y_m, -ground_m, frame.quaternion)


def _clock_offset_s() -> float:
    """Return ROS's time minus the monotonic one, which all parts of the bridge use."""
    return float(rospy.get_time()) - time.monotonic()


class StartMemory:
    """Places of the first and the last take-off, also those of a bridge that was killed.

    The first one says where the odometry frame is in ``map``, the last one from where heights and
    distances are measured. A parameter keeps both: a bridge that is restarted while its vehicle
    flies would know neither.

    Attributes:
        first: Pose and height of the ground in the odometry frame; None before a take-off.
        last: The same of the last take-off.
    """

    def __init__(self, respawned: bool) -> None:
        """Start without a take-off, or with those of the bridge before."""
        kept = rospy.get_param(_TAKE_OFFS, None) if respawned else None
        self.first: Optional[Place] = None
        self.last: Optional[Place] = None
        if isinstance(kept, list) and len(kept) == 8 and all(map(is_number, kept)):
            places = [(Pose2D(*kept[k : k + 3]), float(kept[k + 3])) for k in (0, 4)]
            self.first, self.last = places

    def update(self, machine: VehicleMachine) -> None:
        """Tell a new state machine the last place, and keep that of a new take-off."""
        if machine.odom_from_start is None:
            if self.last is not None:
                machine.odom_from_start, machine.ground_m = self.last
            return
        place = machine.odom_from_start, machine.ground_m
        if place != self.last:
            self.first, self.last = self.first or place, place
            values = [
                number
                for pose, ground_m in (self.first, place)
                for number in (pose.x_m, pose.y_m, pose.yaw_rad, ground_m)
            ]
            # In a thread of its own, because the master may hang.
            keep = threading.Thread(target=rospy.set_param, args=(_TAKE_OFFS, values), daemon=True)
            keep.start()


def vehicle_health(vehicle: Vehicle, machine: VehicleMachine) -> Health:
    """Return the diagnostic status of a vehicle."""
    status = machine.inputs.status
    level = Level.OK if machine.state in _GOOD else Level.WARN
    if machine.state is State.NO_LINK or machine.state is State.TAKEN_OVER:
        level = Level.ERROR
    message = machine.state.value + (f": {machine.reason}" if machine.reason else "")
    values: Dict[str, str] = {
        "state": machine.state.value,
        "reason": machine.reason,
        "mode": "" if status is None else status.mode,
        "armed": str(status is not None and status.is_armed).lower(),
        "in flight": str(machine.state in IN_FLIGHT).lower(),
        "height_m": f"{machine.inputs.height_m(machine.ground_m):.2f}",
        "battery": "" if machine.inputs.battery is None else f"{machine.inputs.battery:.2f}",
    }
    return Health(f"vehicle{vehicle.number}: bridge", vehicle.name, level, message, values)


class MissionPause:
    """Stops and resumes the mission of one robot by the sequencer's services.

    What was asked for last is tried again until the sequencer has done it.
    """

    def __init__(self, robot: int, is_taken_over: Callable[[], bool] = lambda: False) -> None:
        """Start the thread that calls.

        Args:
            robot: Number of the robot.
            is_taken_over: Whether its mission must be stopped now, whatever sequencer has started.
        """
        self._prefix, self._is_taken_over = f"/mission/quad{robot}", is_taken_over
        self._wanted, self._problem = "", ""
        self._changed = threading.Condition()
        threading.Thread(target=self._run, name="mission pause", daemon=True).start()

    def pause(self) -> None:
        """Stop the robot's mission until somebody resumes it."""
        self._want("stop")

    def resume(self) -> None:
        """Resume the robot's mission."""
        self._want("resume")

    def _want(self, action: str) -> None:
        with self._changed:
            self._wanted = action
            self._changed.notify_all()

    def _run(self) -> None:
        while not rospy.is_shutdown():
            with self._changed:
                self._changed.wait_for(lambda: self._wanted, _MISSION_PERIOD_S)
            if not self.deliver():
                time.sleep(_MISSION_PERIOD_S)

    def deliver(self) -> bool:
        """Call the service that is due; return False to try again."""
        wanted = self._wanted
        try:
            if not wanted and self._is_taken_over():
                wanted = "" if rospy.get_param(f"{self._prefix}/stopped", False) else "stop"
            service = f"{self._prefix}/{wanted}"
            problem = call_trigger(service) if wanted else ""
            problem = problem and f"{service}: {problem}"
        except Exception as error:  # without this thread no stop would be delivered any more
            problem = f"{self._prefix}: {error!r}"
        if problem and problem != self._problem and not rospy.core.is_shutdown_requested():
            rospy.logwarn("%s; tries again until it succeeds", problem)
        self._problem = problem
        with self._changed:
            if not problem and self._wanted == wanted:
                self._wanted = ""
        return not problem


def call_trigger(service: str) -> str:
    """Call a service; return why it has failed, "" if it has not."""
    try:
        rospy.wait_for_service(service, _SERVICE_WAIT_S)
        response = rospy.ServiceProxy(service, Trigger)()
    except (rospy.ROSException, rospy.ServiceException) as error:
        return str(error)
    if not response.success:
        return response.message or "refused without giving a reason"
    rospy.loginfo("%s: %s", service, response.message)
    return ""
