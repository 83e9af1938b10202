"""Command filters: parts that change a velocity command before it is published.

The local planner, a recovery or a stop proposes a command; each filter in turn may change what it
was given, and says so. The filters of a robot are a list in YAML, ``command_filters``;
``docs/plugins.md`` has an example. Nav2's collision monitor and velocity smoother are such parts.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Any, Optional, Sequence

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.tracks import Tracks
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.peers.coordinator import PeerCoordinator
from quad_nav.timing import Schedule


class StopReason(enum.Enum):
    """Reasons for which a robot stands."""

    IDLE = "it has no goal"
    CANCELLED = "its goal was cancelled"
    GOAL_ENDED = "its goal has ended"
    PEER = "a peer goes first"
    NO_PLAN = "it has no plan"
    NO_PROGRESS = "it makes no progress"
    NO_TRAJECTORY = "the local planner has no valid trajectory"
    RECOVERY = "a recovery begins"
    FILTER = "a command filter stops it"
    NO_DATA = "data is missing"


@dataclass(frozen=True)
class Command:
    """A velocity command on its way through the filters.

    Attributes:
        velocity: Velocity in the robot's frame.
        stop: Why it is a stop, None if it is none.
        limited_by: Name of the peer or thing for which the robot holds back, "" if it does not.
            The navigator does not count the time as missing progress.
    """

    velocity: Twist2D
    stop: Optional[StopReason] = None
    limited_by: str = ""


@dataclass(frozen=True)
class Situation:
    """Circumstances of a command.

    Attributes:
        now_s: Time of the step.
        period_s: Time between two control cycles.
        pose: Pose of the robot in the local costmap's frame.
        map_pose: The same in the global costmap's frame.
        local_from_global: Transform between the two.
        velocity: Velocity of the robot, in its own frame.
        last: The last command, in the robot's frame then.
        plan: float64[n, 3], the plan that the robot follows, in the global costmap's frame; None
            if it follows none.
        costmap: The local costmap.
        planner_params: Parameters of the local planner without temporary limits, None if it has
            none.
        tracks: Moving obstacles in the local costmap's frame, None if nothing tracks them.
        peers: The peers.
    """

    now_s: float
    period_s: float
    pose: Pose2D
    map_pose: Pose2D
    local_from_global: Pose2D
    velocity: Twist2D
    last: Twist2D
    plan: Optional[NDArray[np.float64]]
    costmap: LayeredCostmap
    planner_params: Any
    tracks: Optional[Tracks]
    peers: PeerCoordinator


class CommandFilter:
    """Base of command filters.

    Attributes:
        acts_when_idle: The filter is asked in each control period of a robot without a goal, too;
            what it is given then is a stop.
        params_class: Dataclass that declares the parameters, see ``quad_nav.parameter``; None for
            a filter that checks its parameters itself.
    """

    acts_when_idle: bool = False
    params_class: Optional[type] = None

    def filter(self, command: Command, situation: Situation) -> Command:
        """Return the command with what this filter changes of it; by default nothing."""
        return command

    def reset(self) -> None:
        """Forget earlier commands: the robot has stopped for lack of data, or the clock jumped."""


class CommandFilters:
    """The command filters of one robot, in the order of the YAML.

    Attributes:
        filters: The filters.
        last: The last command that was published, in the robot's frame then.
    """

    def __init__(self, filters: Sequence[CommandFilter], frequency_hz: float) -> None:
        self.filters = tuple(filters)
        self.last = Twist2D()
        self._act_when_idle = any(one.acts_when_idle for one in self.filters)
        self._idle_cycle = Schedule(frequency_hz)

    def start(self, now_s: float) -> None:
        """Start the control periods of a robot without a goal."""
        self._idle_cycle.start(now_s)

    @property
    def idle_due_s(self) -> float:
        """Time at which the filters are to be asked for a robot without a goal; +inf for never."""
        return self._idle_cycle.due_s if self._act_when_idle else math.inf

    def pop_idle_cycle(self, now_s: float, frequency_hz: float) -> bool:
        """Return whether the filters are to be asked now for a robot without a goal."""
        if not self._act_when_idle:
            return False
        self._idle_cycle.set_frequency(frequency_hz, now_s)
        return self._idle_cycle.pop(now_s)

    def filter(self, command: Optional[Command], situation: Situation) -> Optional[Command]:
        """Pass a command through the filters; None is that of a robot without a goal, to stand.

        Returns:
            The command to publish, None if a robot without a goal just stands on.
        """
        given = Command(Twist2D(), StopReason.IDLE) if command is None else command
        changed = given
        for command_filter in self.filters:
            changed = command_filter.filter(changed, situation)
        stands_on = command is None and changed is given and self.last.is_zero
        return None if stands_on else changed

    def reset(self) -> None:
        """Let the filters forget earlier commands."""
        for command_filter in self.filters:
            command_filter.reset()


class VoronoiCell(CommandFilter):
    """Keeps the robot in its Voronoi cell, so that no command leads into a peer."""

    def __init__(self, params: Any = None) -> None:
        """Take no parameters: those of the peers are the coordinator's."""

    def filter(self, command: Command, situation: Situation) -> Command:
        """Return the command, slower if it would leave the cell."""
        cell = situation.peers.cell(situation.map_pose, situation.velocity, situation.period_s)
        velocity, limited_by = cell.limit(command.velocity)
        return Command(velocity, command.stop, limited_by) if limited_by else command
