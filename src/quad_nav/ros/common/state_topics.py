"""Receive the states of robots: many in one message, or else each from its odometry.

`/quad/states` carries the states of many robots in one message, from the simulator and from the
hosts of real quadcopters. A robot that no such message carries, such as a real one with C++
move_base, is heard from `/odom{j}`. Which of both is decided for each robot while the node runs.
"""

from __future__ import annotations

import threading
import time
from functools import partial
from typing import Callable, Dict, Iterable, List, Optional, Sequence

import numpy as np
import rospy
from nav_msgs.msg import Odometry
from numpy.typing import NDArray

from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.packed_messages import STATES_TOPIC, States, StatesMessage, StatesReader
from quad_nav.ros.common.rospy_repairs import sender_of
from quad_nav.topics.validation import frame_problem, stamp_problem, valid_states

CHECK_S = 0.1  # wall time
MISSING_AFTER_S = 0.5
"""A robot that was on no bulk message for so long, in wall time and by the clock, is not there."""
FIND_S = 1.0
"""Wall time between two questions to the ROS master which robots there are."""
STEADY_S = 2.0
"""Wall time for which bulk messages have carried a robot when its own topic is left."""


class OwnTopics:
    """Subscribe to a topic of each robot for as long as no bulk message carries the robot.

    Subscribing asks the ROS master, which may take long: a thread of its own does it.
    """

    def __init__(
        self,
        robots: int,
        heard: Iterable[int],
        subscribe: Callable[[int], rospy.Subscriber],
        find: Optional[Callable[[int], str]] = None,
    ) -> None:
        """Start without subscriptions.

        Args:
            robots: Number of all robots.
            heard: Numbers of those to subscribe to.
            subscribe: Subscribes to the topic of a robot.
            find: Returns the name of a robot's topic, and only topics that are published are
                subscribed to: it is not known which robots there are. None if they are known.
        """
        self._heard, self._subscribe, self._find = list(heard), subscribe, find
        self._subscribers: Dict[int, rospy.Subscriber] = {}
        now_s = time.monotonic()
        self._wall_s = np.full(robots, now_s)  # of the last bulk message with each robot
        self._clock_s = np.full(robots, -np.inf)
        self._since_s = np.full(robots, now_s)  # start of its bulk messages without a gap
        self._next_check_s = now_s + CHECK_S
        self._worker = threading.Thread()

    def hear(self, robots: NDArray[np.int64]) -> None:
        """Note that a bulk message has carried robots."""
        now_s = time.monotonic()
        returned = robots[now_s - self._wall_s[robots] > MISSING_AFTER_S]
        self._since_s[returned] = now_s
        self._wall_s[robots], self._clock_s[robots] = now_s, rospy.get_time()

    def is_in_bulk(self, robot: int) -> bool:
        """Return whether bulk messages carry a robot."""
        return (
            time.monotonic() - self._wall_s[robot] <= MISSING_AFTER_S
            or abs(rospy.get_time() - self._clock_s[robot]) <= MISSING_AFTER_S
        )

    def _missing(self) -> NDArray[np.bool_]:
        silent_s = np.minimum(
            time.monotonic() - self._wall_s, np.abs(rospy.get_time() - self._clock_s)
        )
        return silent_s > MISSING_AFTER_S

    @property
    def is_due(self) -> bool:
        """Whether `check` has something to do now."""
        return time.monotonic() >= self._next_check_s

    def check(self) -> None:
        """Subscribe and unsubscribe as needed, in another thread; call it often."""
        if not self.is_due:
            return
        now_s = time.monotonic()
        self._next_check_s = now_s + (FIND_S if self._find else CHECK_S)
        missing = self._missing()
        steady = ~missing & (now_s - self._since_s > STEADY_S)
        wanted = [j for j in self._heard if missing[j] and j not in self._subscribers]
        unwanted = [j for j in list(self._subscribers) if steady[j]]
        if (wanted or unwanted) and not self._worker.is_alive():
            self._worker = threading.Thread(
                target=self._change, args=(wanted, unwanted), daemon=True
            )
            self._worker.start()

    def _change(self, wanted: Sequence[int], unwanted: Sequence[int]) -> None:
        try:
            for robot in self._published(wanted) if self._find else wanted:
                self._subscribers[robot] = self._subscribe(robot)
            for robot in unwanted:
                self._subscribers.pop(robot).unregister()
        except rospy.ROSException:
            if not rospy.core.is_shutdown_requested():  # at shutdown rospy closes the topics
                raise

    def _published(self, robots: Sequence[int]) -> List[int]:
        assert self._find is not None
        try:
            topics = {name for name, _ in rospy.get_published_topics()}
        except OSError:  # the ROS master hangs
            return []
        return [robot for robot in robots if self._find(robot) in topics]


class StateTopics:
    """Receive valid states, and odometry of the robots that no state message carries."""

    def __init__(
        self,
        robots: int,
        on_states: Callable[[States], bool],
        on_odometry: Callable[[int, Odometry], None],
        subscribed: Callable[[int, rospy.Subscriber], None] = lambda *_: None,
        queue_size: int = 0,
        topic: Callable[[int], str] = "/odom{}".format,
        only_published: bool = False,
    ) -> None:
        """Subscribe to the states.

        Args:
            robots: Number of robots; states of others are left out.
            on_states: Called with the valid states of a message; returns whether it can use them.
            on_odometry: Called with a robot and its odometry message, which is not checked.
            subscribed: Called with a robot and the subscriber to its odometry, in another thread.
            queue_size: Length of the subscribers' queues. With 0 only the newest message of each
                node counts, and waits for `read`.
            topic: Returns the name of the topic of a robot's odometry.
            only_published: Whether it is not known which robots there are: see `OwnTopics`.
        """
        self._robots, self._on_states, self._on_odometry = robots, on_states, on_odometry
        self._subscribed, self._queue_size = subscribed, queue_size or 1
        self._waiting: Dict[str, StatesMessage] = {}  # by the node
        self._reader, self._warnings = StatesReader(), ThrottledWarnings()
        self._topic = topic
        self._own = OwnTopics(
            robots, range(robots), self._subscribe, topic if only_published else None
        )
        self.subscriber = rospy.Subscriber(
            STATES_TOPIC,
            StatesMessage,
            self._on_message if queue_size else self._store,
            queue_size=self._queue_size,
            tcp_nodelay=True,
        )

    def check(self) -> None:
        """Hear robots that are not in the state messages from their odometry; call it often."""
        if self._own.is_due:
            self.read()
        self._own.check()

    def read(self) -> None:
        """Read the messages that wait."""
        while self._waiting:
            self._on_message(self._waiting.popitem()[1])

    def _store(self, message: StatesMessage) -> None:
        self._waiting[sender_of(message)] = message

    def _subscribe(self, robot: int) -> rospy.Subscriber:
        subscriber = rospy.Subscriber(
            self._topic(robot),
            Odometry,
            partial(self._on_own_odometry, robot),
            queue_size=self._queue_size,
        )
        self._subscribed(robot, subscriber)
        return subscriber

    def _on_own_odometry(self, robot: int, message: Odometry) -> None:
        if not self._own.is_in_bulk(robot):
            self._on_odometry(robot, message)

    def _on_message(self, message: StatesMessage) -> None:
        if sender_of(message) == rospy.get_name():
            return
        try:
            states = self._checked(self._reader.read(message))
        except ValueError as error:
            self._warn(str(error))
            return
        if len(states.robots) and self._on_states(states):
            self._own.hear(states.robots)

    def _checked(self, states: States) -> States:
        """Return the valid states of known robots.

        Raises:
            ValueError: If none can be used; says why.
        """
        problem = frame_problem(states.frame.lstrip("/")) or stamp_problem(
            states.stamp_s, rospy.get_time()
        )
        if problem:
            raise ValueError(problem)
        states = states.of((states.robots >= 0) & (states.robots < self._robots))
        valid, problem = valid_states(states.poses, states.twists)
        if problem:
            self._warn(f"quad{states.robots[np.argmin(valid)]}: {problem}")
            states = states.of(valid)
        return states

    def _warn(self, problem: str) -> None:
        self._warnings.warn(f"{STATES_TOPIC}: state dropped: {problem}", kind=STATES_TOPIC)
