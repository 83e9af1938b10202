"""A controller whose parameters are held down for a while, to go slowly or to dare more."""
from __future__ import annotations

from dataclasses import replace
from typing import Any, Optional

from quad_nav.geometry import Pose2D
from quad_nav.recovery import ParameterLimit


class ParameterLimiter:
    """Sets a controller's parameters: the usual ones, or the usual ones limited.

    A limit holds until the robot has moved far enough, whatever becomes of the goal: what
    makes it necessary is around the robot. The controller has ``params``, a frozen
    dataclass, and ``set_params``; one that has not cannot be limited.
    """

    def __init__(self, controller: Any):
        self._controller = controller
        self._limit: Optional[ParameterLimit] = None
        self._usual: Any = None  # the parameters without the limit; None while there is none
        self._since = Pose2D(0.0, 0.0, 0.0)

    def set_params(self, params: Any) -> None:
        """Takes other usual parameters; a limit stays in force."""
        if self._limit is None:
            self._controller.set_params(params)
            return
        self._usual = params
        self._controller.set_params(_limited(params, self._limit))

    def impose(self, limit: ParameterLimit, pose: Pose2D) -> None:
        """Begins a limit, in place of one that is in force; ``pose`` is where the robot is."""
        if not limit.greatest:
            return
        usual = self._controller.params if self._limit is None else self._usual
        self._limit, self._since = limit, pose
        self.set_params(usual)

    def follow(self, pose: Pose2D) -> None:
        """To be called with the robot's pose in every control cycle."""
        if self._limit is not None and pose.distance_to(self._since) >= self._limit.distance_m:
            self.lift()

    def lift(self) -> None:
        """Ends the limit, if there is one."""
        if self._limit is not None:
            self._limit = None
            self.set_params(self._usual)
            self._usual = None


def _limited(params: Any, limit: ParameterLimit) -> Any:
    return replace(params, **{
        field: max(-greatest, min(getattr(params, field), greatest))
        for field, greatest in limit.greatest})
