"""What people do to an offline flight: its pace, goals, navigators and goal files."""

from __future__ import annotations

import math
from typing import Any, List, Mapping, Optional, Sequence

import numpy as np

from quad_nav import config
from quad_nav.config import Configuration
from quad_nav.config.files import below
from quad_nav.config.planners import planner_names
from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.mission.goal import MAX_COORDINATE_M, goal_faults
from quad_nav.offline.flight import Flight
from quad_nav.scenario.goal_checks import place_check
from quad_nav.sim.localization import Localization
from quad_web.view.actions import FLIGHT_ACTIONS, Answer, GoalChange, ParameterView
from quad_web.view.goal_files import GoalEditing, GoalFiles
from quad_web.view.localization import GIVEN_COVARIANCE, SEARCHES, given_text

STOPPED = "stopped by a person; Resume continues its mission"
STARTED_AGAIN = "started again by a person"
MAX_RATE = 1000.0
HAS_ENDED = "the flight has ended; reset starts it again"
_OF_ENDED = ("start", "reset", "parameters", "goal_files", "check_goals", "save_goals", "set_rate")
"""Actions that an ended flight has."""


class FlightActions(GoalEditing):
    """Carries out what people do, between two instants of odometry.

    Attributes:
        is_paused: The flight stands.
        is_stopped: The missions are stopped: the quadcopters hover.
        rate: Simulated seconds per second of wall time that are wanted; 0: as fast as it goes.
        stop_reason: Why a person ends the flight, "" to continue.
        done: What people did that changes the flight, one line each.
        version: Number of actions so far.
    """

    available = FLIGHT_ACTIONS

    def __init__(self, rate: float = 1.0) -> None:
        """Fly at a rate, in simulated seconds per second; 0 is as fast as it goes."""
        self.rate = rate
        self.version = 0
        self.is_paused = self.is_stopped = False
        self.stop_reason = ""
        self.done: List[str] = []
        self.lidars: List[bool] = []
        self._flight: Optional[Flight] = None
        self._has_ended = False

    @property
    def state(self) -> str:
        """State of the flight for the item ``flight``."""
        if self._has_ended:
            return "ended"
        if self.is_stopped:
            return "stopped"
        if self.is_paused:
            return "paused"
        return "running" if self.flight.now_s > 0.0 else "starting"

    @property
    def flight(self) -> Flight:
        """The flight."""
        assert self._flight is not None
        return self._flight

    def begin(self, flight: Flight) -> None:
        """Take over a flight at its start."""
        setup, self._flight = flight.setup, flight
        self.is_paused, self.is_stopped, self._has_ended = False, False, False
        self.stop_reason = ""
        self.done = []
        self.lidars = [True] * len(flight.robots)
        paths = {robot: goals.file.path for robot, goals in enumerate(setup.robots)}
        self._files = GoalFiles(
            {robot: path for robot, path in paths.items() if path.is_file()},
            lambda robot: place_check(
                setup.scene, setup.robot_radius_m, setup.configurations[robot]
            ),
        )

    def end(self) -> None:
        """Note that the flight has ended."""
        self._has_ended = True

    def call(self, name: str, *arguments: Any) -> Any:
        """Return what comes of an action of a person."""
        self.version += 1
        if self._has_ended and name not in _OF_ENDED:
            return Answer(False, HAS_ENDED)
        try:
            return super().call(name, *arguments)
        except InputError as error:
            return Answer(False, "; ".join(error.problems))

    # -- time ----------------------------------------------------------------------------

    def start(self) -> Answer:
        """Continue after a pause or a stop; after its end start the flight again."""
        if self._has_ended:
            return self.reset()
        self.is_paused = False
        if not self.is_stopped:
            return Answer(True, "the flight continues")
        self.is_stopped = False
        self.flight.release()
        return self._did(None, "missions resumed")

    def pause(self) -> Answer:
        """Let the flight stand."""
        self.is_paused = True
        return Answer(True, f"the flight stands at {self.flight.now_s:.2f} s")

    def reset(self) -> Answer:
        """End the flight and start it again, with the goal files as they are now."""
        self.stop_reason = STARTED_AGAIN
        return Answer(True, "the flight starts again")

    def set_rate(self, rate: float) -> Answer:
        """Set simulated seconds per second; 0 is as fast as it goes."""
        if not 0.0 <= rate <= MAX_RATE:
            return Answer(False, f"rate: {rate:g}; expected 0 to {MAX_RATE:g}")
        self.rate = rate
        text = f"{rate:g} simulated seconds per second" if rate else "as fast as it goes"
        return Answer(True, f"rate: {text}")

    # -- robots --------------------------------------------------------------------------

    def send_goal(self, robot: Optional[int], pose: Pose2D) -> Answer:
        """Send a robot to a pose in ``map``; None sends the nearest one."""
        numbers = (pose.x_m, pose.y_m, pose.yaw_rad)
        if not all(math.isfinite(n) and abs(n) <= MAX_COORDINATE_M for n in numbers):
            raise InputError([f"goal: {numbers}; expected finite numbers"])
        if robot is None:
            offsets_m = self.flight.states.poses[:, :2] - (pose.x_m, pose.y_m)
            robot = int(np.argmin(np.hypot(offsets_m[:, 0], offsets_m[:, 1])))
        name = self._name(robot)
        setup = self.flight.setup
        configuration = self.flight.robots[robot].configuration
        check = place_check(setup.scene, setup.robot_radius_m, configuration)
        fault = check(pose.x_m, pose.y_m)
        place = f"({pose.x_m:.2f}, {pose.y_m:.2f})"
        if fault:
            raise InputError([f"{name}: goal {place} {fault}"])
        self.flight.send_goal(robot, pose)
        return self._did(robot, f"sent to {place}")

    def cancel(self, robot: int) -> Answer:
        """Cancel the goal of a robot; the mission goes on with the next one."""
        name = self._name(robot)
        if not self.flight.robots[robot].has_navigator_goal:
            return Answer(False, f"{name}: has no goal")
        self.flight.cancel_goal(robot)
        return self._did(robot, "goal cancelled")

    def stop_all(self) -> Answer:
        """Cancel all goals and stop the missions, until they are resumed."""
        self.is_stopped, self.is_paused = True, False
        self.flight.hold()
        return self._did(None, "missions stopped: every quadcopter hovers; Resume continues them")

    def clear_costmaps(self, robot: int) -> Answer:
        """Clear the obstacles in a robot's costmaps."""
        self._name(robot)
        self.flight.clear_costmaps(robot)
        return self._did(robot, "costmaps cleared")

    def enable_lidar(self, robot: int, is_on: bool) -> Answer:
        """Switch a robot's LIDAR on or off."""
        self._name(robot)
        self.flight.loop.enable_lidar(robot, is_on)
        self.lidars[robot] = is_on
        return self._did(robot, f"LIDAR switched {'on' if is_on else 'off'}")

    def set_pose(self, robot: int, pose: Pose2D) -> Answer:
        """Tell a robot where it is."""
        faults = list(goal_faults([pose.x_m, pose.y_m, pose.yaw_rad]))
        if faults:
            raise InputError([f"pose{faults[0]}"])
        if not self._localization(robot).set_pose(robot, pose, GIVEN_COVARIANCE):
            return Answer(False, f"{self._name(robot)}: its localization takes no pose")
        return self._did(robot, given_text(pose))

    def set_uniform(self, robot: int) -> Answer:
        """Let a robot search the whole map."""
        if not self._localization(robot).set_uniform(robot):
            return Answer(False, f"{self._name(robot)}: its localization cannot search the map")
        return self._did(robot, SEARCHES)

    def _localization(self, robot: int) -> Localization:
        name, found = self._name(robot), self.flight.loop.group.localization
        if found is None:
            raise InputError([f"{name}: knows its pose; quad fly --localization amcl estimates it"])
        return found

    # -- parameters and goal files -------------------------------------------------------

    def parameters(self, robot: int) -> Sequence[ParameterView]:
        """Return the parameters of a robot's navigator that can be changed in flight."""
        self._name(robot)
        return parameter_views(self.flight.robots[robot].configuration)

    def set_parameters(self, robot: int, namespace: str, values: Mapping[str, Any]) -> Answer:
        """Change parameters of one namespace."""
        self._name(robot)
        before = self.flight.robots[robot].configuration
        changed = config.updated(before, namespace, values)
        self.flight.reconfigure(robot, changed)
        in_force = config.values(changed, namespace)
        named = ", ".join(f"{name} {in_force[name]}" for name in values if name in in_force)
        return self._did(robot, f"{namespace or 'move_base'}: {named}")

    def save_goals(self, robot: int, version: str, goals: Sequence[GoalChange]) -> Answer:
        """Check the goals of a robot, write its file, and fly it from now on."""
        answer = super().save_goals(robot, version, goals)
        if not answer.ok or self._has_ended:
            return answer
        self.flight.replace_goals(robot, self.flight.setup.robots[robot].file.load())
        self._did(robot, "goals edited")
        return answer

    def _name(self, robot: int) -> str:
        robots = self.flight.robots
        if not 0 <= robot < len(robots):
            raise InputError([f"robot: {robot}; expected 0 to {len(robots) - 1}"])
        return robots[robot].name

    def _did(self, robot: Optional[int], text: str) -> Answer:
        """Keep what a person did for the summary."""
        line = text if robot is None else f"{self._name(robot)}: {text}"
        self.done.append(f"{self.flight.now_s:.2f} s: {line}")
        return Answer(True, line)


def parameter_views(configuration: Configuration) -> List[ParameterView]:
    """Return the parameters that can change, with the values in force and those of the files."""
    views: List[ParameterView] = []
    for namespace, parameters in config.reconfigurable(configuration).items():
        values = config.values(configuration, namespace)
        start = below(configuration.tree_at_start, namespace)
        views += [
            ParameterView(
                namespace,
                one.name,
                one.kind,
                values[one.name],
                start[one.name],
                one.low,
                one.high,
                tuple((choice.name, choice.value) for choice in one.choices)
                or tuple((name, name) for name in planner_names(namespace, one.name)),
                one.description,
            )
            for one in parameters
        ]
    return views
