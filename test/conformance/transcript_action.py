"""Goals and cancels of a transcript, and what the navigator publishes after each.

An input is written as in the recordings:

    goal 'ID' (X,Y,YAW) frame 'FRAME' stamp now pose stamp None q None via goal
    cancel id 'ID' stamp 0.0

``stamp`` is that of the goal's id, ``pose stamp`` that of its pose: seconds, those that are not
positive or follow ``now`` are counted from now. ``q`` is a quaternion that replaces the yaw. ``via
simple`` publishes the pose on ``move_base_simple/goal``. The answer is what was published from the
input until the next one: [seconds after it, topic, summary].
"""

from __future__ import annotations

import ast
import functools
import math
import re
from typing import Any, Callable, Dict, List, Sequence, Tuple

import rospy
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from geometry_msgs.msg import PoseStamped, Twist
from move_base_msgs.msg import (
    MoveBaseActionFeedback,
    MoveBaseActionGoal,
    MoveBaseActionResult,
    RecoveryStatus,
)
from transcript_session import Session
from transcript_world import pose_from_yaw

Event = List[Any]
PERIOD_S = 0.2  # of control and of the status, in the sessions
_GOAL = re.compile(
    r"goal '(?P<id>.*)' \((?P<x>.*),(?P<y>.*),(?P<yaw>.*)\) frame '(?P<frame>.*)'"
    r" stamp (?P<stamp>\S+) pose stamp (?P<pose_stamp>\S+) q (?P<q>None|\(.*\)) via (?P<via>\w+)"
)
_CANCEL = re.compile(r"cancel id '(?P<id>.*)' stamp (?P<stamp>\S+)")
_UNFINISHED = (
    GoalStatus.PENDING,
    GoalStatus.ACTIVE,
    GoalStatus.PREEMPTING,
    GoalStatus.RECALLING,
)
_MADE_UP = re.compile(r"(/move_base)[@\d]*(-\d+)-[\d.]+")  # an id with the time in it


class Recorder:
    """What a navigator publishes, and the topics that it listens to."""

    def __init__(self, session: Session) -> None:
        """Connect to a navigator."""
        self._session, self._begin = session, rospy.Time()
        self.events: List[Event] = []
        kinds: Sequence[Tuple[str, str, Any, Callable[[Any], Any]]] = (
            ("~/status", "/move_base/status", GoalStatusArray, self._status),
            ("~/result", "/move_base/result", MoveBaseActionResult, self._result),
            ("~/feedback", "/move_base/feedback", MoveBaseActionFeedback, self._feedback),
            ("~/recovery_status", "/move_base/recovery_status", RecoveryStatus, self._recovery),
            ("~/current_goal", session.name("~current_goal"), PoseStamped, self._pose),
            ("/cmd_vel", session.named("/cmd_vel@"), Twist, self._command),
        )
        for name, topic, kind, summary in kinds:
            rospy.Subscriber(topic, kind, self._note, (name, summary), queue_size=100)
        self.goals = rospy.Publisher("/move_base/goal", MoveBaseActionGoal, queue_size=5)
        self.cancels = rospy.Publisher("/move_base/cancel", GoalID, queue_size=5)
        self.simple = rospy.Publisher("/move_base_simple/goal", PoseStamped, queue_size=5)
        session.wait(1.0)  # all are connected

    def begin(self) -> List[Event]:
        """Begin the answer to an input."""
        self.events, self._begin = [], self._session.now()
        return self.events

    def _note(self, message: Any, named: Tuple[str, Callable[[Any], Any]]) -> None:
        name, summary = named
        seconds = (self._session.now() - self._begin).to_sec()
        self.events.append([round(seconds, 2), name, summary(message)])

    def _name(self, goal_id: GoalID) -> str:
        return self._session.anonymous(goal_id.id)

    def _status(self, message: GoalStatusArray) -> Dict[str, Any]:
        listed = message.status_list
        return {"status": [[self._name(s.goal_id), s.status, s.text] for s in listed]}

    def _result(self, message: MoveBaseActionResult) -> Dict[str, Any]:
        status, frame = message.status, message.header.frame_id
        name = self._name(status.goal_id)
        return {"id": name, "status": status.status, "text": status.text, "frame": frame}

    def _feedback(self, message: MoveBaseActionFeedback) -> Dict[str, Any]:
        status, pose = message.status, self._pose(message.feedback.base_position)
        given = {"id": self._name(status.goal_id), "status": status.status, "text": status.text}
        return {**given, "bframe": pose["frame"], "bstamp": pose["stamp"], "pose": pose["pose"]}

    def _recovery(self, message: RecoveryStatus) -> Dict[str, Any]:
        number, total = message.current_recovery_number, message.total_number_of_recoveries
        at = self._pose(message.pose_stamped)
        named = {"i": number, "of": total, "name": message.recovery_behavior_name}
        return {"frame": at["frame"], "stamp": at["stamp"], **named}

    def _pose(self, message: PoseStamped) -> Dict[str, Any]:
        at, turn = message.pose.position, message.pose.orientation
        numbers = [at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w]
        return {
            "frame": self._session.anonymous(message.header.frame_id),
            "stamp": round(message.header.stamp.to_sec(), 2),
            "pose": [round(number, 4) for number in numbers],
        }

    def _command(self, message: Twist) -> Dict[str, Any]:
        numbers = (message.linear.x, message.linear.y, message.angular.z)
        return {"cmd": [round(number, 6) for number in numbers]}


@functools.lru_cache(maxsize=1)
def _recorder(session: Session) -> Recorder:
    return Recorder(session)


def answer(session: Session, request: str) -> List[Event]:
    """Give an input; the list that is returned grows until the next one."""
    recorder = _recorder(session)
    events, now = recorder.begin(), session.now()
    cancel, goal = _CANCEL.fullmatch(request), _GOAL.fullmatch(request)
    if cancel:
        stamp = rospy.Time.from_sec(float(cancel["stamp"]))
        recorder.cancels.publish(GoalID(stamp, session.named(cancel["id"])))
    elif goal:
        pose = _pose_of(session, goal, now)
        if goal["via"] == "simple":
            recorder.simple.publish(pose)
        else:
            message = MoveBaseActionGoal()
            message.goal.target_pose, message.header.stamp = pose, now
            stamp = _stamp(goal["stamp"], now) if goal["stamp"] != "None" else rospy.Time()
            message.goal_id = GoalID(stamp, goal["id"])
            recorder.goals.publish(message)
    else:
        raise ValueError(f"{request!r} is neither a goal nor a cancel")
    return events


def _pose_of(session: Session, goal: Any, now: rospy.Time) -> PoseStamped:
    quaternion = ast.literal_eval(goal["q"])
    turn = float(goal["yaw"]) if quaternion is None else [float(part) for part in quaternion]
    message = PoseStamped(pose=pose_from_yaw(float(goal["x"]), float(goal["y"]), turn))
    message.header.frame_id = session.named(goal["frame"])
    message.header.stamp = _stamp(goal["pose_stamp"], now)
    return message


def _stamp(text: str, now: rospy.Time) -> rospy.Time:
    """The time of an input: None and now, seconds from now, or seconds."""
    if text in ("None", "now"):
        return now
    given_s = float(text[len("now") :] if text.startswith("now") else text)
    is_relative = text.startswith("now") or given_s < 0.0
    return now + rospy.Duration.from_sec(given_s) if is_relative else rospy.Time.from_sec(given_s)


# -- comparison --------------------------------------------------------------------------


def is_equal(request: str, answer: List[Event], recorded: List[Event]) -> bool:
    """Whether the same was published: in the same order on each topic, within one control cycle.

    Where the robot is and how fast it flies depends on the world, which is not known. How often a
    periodic message came is compared to two, and not at all before a cancel takes effect: it may
    come right before the cycle, or after it.
    """
    end_s = recorded[-1][0] if recorded else 0.0
    given = [event for event in answer if event[0] <= end_s + 0.05]
    late = [event for event in answer if event[0] <= end_s + PERIOD_S]
    is_cancel = _CANCEL.fullmatch(request) is not None
    parts = (_results, _recoveries, _commands, *(() if is_cancel else (_goals, _feedback)))
    return _has_same_statuses(late, recorded) and all(
        part(recorded, recorded) in (part(given, recorded), part(late, recorded)) for part in parts
    )


def _of(events: List[Event], topic: str) -> List[Tuple[float, Dict[str, Any]]]:
    return [(seconds, summary) for seconds, name, summary in events if name == topic]


def _text(text: str) -> str:
    return text.replace("recieved", "received")


def _named(name: str) -> str:
    return _MADE_UP.sub(r"\1@\2", name)


def _results(events: List[Event], _: List[Event]) -> List[Any]:
    found = [one for _, one in _of(events, "~/result")]
    return [(_named(one["id"]), one["status"], _text(one["text"])) for one in found]


def _recoveries(events: List[Event], _: List[Event]) -> List[Any]:
    found = [one for _, one in _of(events, "~/recovery_status")]
    return [(one["name"], one["i"], one["of"], one["frame"]) for one in found]


def _goals(events: List[Event], recorded: List[Event]) -> List[Any]:
    """The goals that are new, each with its pose where that is recorded; NaN is None."""
    with_pose = {one["frame"] for _, one in _of(recorded, "~/current_goal") if "pose" in one}
    found: List[Any] = []
    for _, one in _of(events, "~/current_goal"):
        numbers = one["pose"] if one["frame"] in with_pose else []
        pose = [None if math.isnan(number) else round(number, 3) + 0.0 for number in numbers]
        if not found or found[-1] != (one["frame"], pose):
            found.append((one["frame"], pose))
    return found


def _commands(events: List[Event], _: List[Event]) -> List[bool]:
    """Whether the last command, and any after the first cycle, moves the robot."""
    moves = [(seconds, any(one["cmd"])) for seconds, one in _of(events, "/cmd_vel")]
    return [is_moving for _, is_moving in moves[-1:]]


def _feedback(events: List[Event], recorded: List[Event]) -> List[Any]:
    """Whose they are, and whether there are as many as recorded, to two."""
    found = [one for _, one in _of(events, "~/feedback")]
    names = dict.fromkeys((_named(one["id"]), one["status"], one["bframe"]) for one in found)
    return [*names, abs(len(found) - len(_of(recorded, "~/feedback"))) <= 2]


def _has_same_statuses(answer: List[Event], recorded: List[Event]) -> bool:
    """Whether goals take on the same statuses, but for one that a periodic message may miss."""
    given, expected = _statuses(answer), _statuses(recorded)
    last = _of(recorded, "~/status")[-1:]
    listed = [entry for _, one in last for entry in one["status"]]
    unfinished = {_named(name) for name, status, _ in listed if status in _UNFINISHED}
    for name in unfinished | {name for name, taken in expected.items() if len(taken) > 1}:
        ours, theirs = given.get(name, []), expected[name]
        most = max(len(ours), len(theirs)) - 1
        if not ours or (ours != theirs and ours[-most:] != theirs[-most:]):
            return False
    return True


def _statuses(events: List[Event]) -> Dict[str, List[Any]]:
    found: Dict[str, List[Any]] = {}
    for _, one in _of(events, "~/status"):
        for name, status, text in one["status"]:
            taken = found.setdefault(_named(name), [])
            if not taken or taken[-1] != (status, _text(text)):
                taken.append((status, _text(text)))
    return found
