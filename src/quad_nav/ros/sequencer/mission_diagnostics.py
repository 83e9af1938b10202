"""Convert the progress of a mission to `diagnostic_msgs`."""

from __future__ import annotations

from typing import Mapping, Optional, Sequence

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from quad_nav.mission.flight_log import FlightLog
from quad_nav.ros.sequencer.robot import MissionRobot


def progress_message(
    robots: Sequence[MissionRobot], log: FlightLog, failures: Mapping[str, str]
) -> DiagnosticArray:
    """Return the status of each robot of the mission.

    Args:
        robots: The robots.
        log: Their log.
        failures: Why the missions of single robots ended early, by their names.
    """
    array = DiagnosticArray(
        status=[_robot_status(robot, log, failures.get(robot.name, "")) for robot in robots]
    )
    array.header.stamp = rospy.Time.now()
    return array


def _robot_status(robot: MissionRobot, log: FlightLog, failure: str) -> DiagnosticStatus:
    sequencer, odometry, flown = robot.sequencer, robot.odometry, log.robots[robot.name]
    count = len(sequencer.sequence.goals)
    skipped, contacts = sum(not leg.reached for leg in flown.legs), log.contacts_of(robot.name)
    active, pose = sequencer.active_goal, robot.pose
    attempts = [leg.attempts for leg in flown.legs] + ([active.attempt] if active else [])
    distance_m = None
    if active is not None and pose is not None:
        distance_m = pose.to_2d().distance_to(active.pose)
    level, message = DiagnosticStatus.OK, _state(robot, distance_m)
    if skipped or contacts or (active is not None and active.attempt > 1):
        level = DiagnosticStatus.WARN
    if odometry.is_silent:
        level, message = DiagnosticStatus.ERROR, f"no odometry for {odometry.silent_s:.0f} s"
    if failure:
        level, message = DiagnosticStatus.ERROR, f"ended early: {failure}"
    values = {
        "goal": min(sequencer.index + 1, count),
        "goals": count,
        "lap": sequencer.lap,
        "distance_m": "" if distance_m is None else f"{distance_m:.2f}",
        "attempt": active.attempt if active else 0,
        "retries": sum(attempts) - len(attempts),
        "reached": len(flown.legs) - skipped,
        "skipped": skipped,
        "contacts": contacts,
        "last reason": next((leg.reason for leg in reversed(flown.legs) if leg.reason), ""),
        "odometry silent s": f"{odometry.silent_s:.2f}",
        "recoveries": flown.recoveries,
        "path_length_m": f"{flown.path_length_m:.2f}",
        "stopped": robot.is_stopped,
    }
    return DiagnosticStatus(
        level=level,
        name=f"mission: {robot.name}",
        message=message,
        hardware_id=robot.name,
        values=[KeyValue(key, str(value)) for key, value in values.items()],
    )


def _state(robot: MissionRobot, distance_m: Optional[float]) -> str:
    if robot.is_stopped:
        return "stopped, /mission/resume resumes it"
    sequencer, dwell = robot.sequencer, robot.sequencer.dwell
    count = len(sequencer.sequence.goals)
    if distance_m is not None:
        return f"flying to goal {sequencer.index + 1} of {count}, {distance_m:.2f} m away"
    if dwell is not None:
        left_s = max(dwell.until_s - rospy.get_time(), 0.0)
        return f"staying at goal {sequencer.index} of {count} for {left_s:.0f} s"
    return "done" if sequencer.done else "starting"
