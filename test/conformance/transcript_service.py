"""Service calls of a transcript, and what is kept of their answers."""

from __future__ import annotations

from typing import Any, Dict, Sequence

import rospy
from geometry_msgs.msg import PoseStamped
from nav_msgs.srv import GetPlan
from std_srvs.srv import Empty
from transcript_session import Session
from transcript_world import pose_from_yaw


def answer(session: Session, request: Dict[str, Any]) -> Dict[str, Any]:
    """Call a service: a plan's poses, frames and stamps, or {} of an empty answer.

    ``P`` are all poses, ``last`` is the last one. ``stamps`` are seconds from the call and its
    answer, to a tenth; ``header`` has its frame and whether it has a stamp.
    """
    name, now = session.name(f"~{request['service']}"), session.now()
    kind = GetPlan if name.endswith("make_plan") else Empty
    try:
        rospy.wait_for_service(name, 5.0)
        if kind is Empty:
            rospy.ServiceProxy(name, Empty)()
            return {}
        plan = rospy.ServiceProxy(name, GetPlan)(
            stamped(session, request["start"], now),
            stamped(session, request["goal"], now),
            request["tolerance"],
        ).plan
    except (rospy.ServiceException, rospy.ROSException) as error:
        return {"error": session.anonymous(f"{type(error).__name__}: {error}")}
    end = session.now()
    return {
        "n": len(plan.poses),
        "header": [session.anonymous(plan.header.frame_id), not plan.header.stamp.is_zero()],
        "frames": sorted({session.anonymous(pose.header.frame_id) for pose in plan.poses}),
        "stamps": sorted({seconds_outside(pose.header.stamp, now, end) for pose in plan.poses}),
        "P": [numbers(pose.pose) for pose in plan.poses],
        "last": [numbers(pose.pose) for pose in plan.poses[-1:]],
    }


def seconds_outside(stamp: rospy.Time, begin: rospy.Time, end: rospy.Time) -> float:
    """How long before or after a time it is, to a tenth; 0 within it."""
    return round((stamp - min(max(stamp, begin), end)).to_sec(), 1)


def stamped(session: Session, place: Sequence[Any], now: rospy.Time) -> PoseStamped:
    """A pose from x, y, yaw or a list of the quaternion, and frame."""
    x, y, turn, frame = place
    message = PoseStamped(pose=pose_from_yaw(x, y, turn))
    message.header.frame_id, message.header.stamp = session.named(frame), now
    return message


def numbers(pose: Any) -> Sequence[float]:
    """x, y, z and the quaternion."""
    at, turn = pose.position, pose.orientation
    return [at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w]
