"""A controller whose parameters are held down for a while, to go slowly or to dare more."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Dict, List, Tuple

from quad_nav.geometry import Pose2D
from quad_nav.recovery import ParameterLimit


class ParameterLimiter:
    """Sets a controller's parameters: the usual ones, or the usual ones limited.

    A limit holds until the robot has moved far enough, whatever becomes of the goal: what
    makes it necessary is around the robot. Limits of different parameters hold side by
    side; one of the same parameters takes the other's place. The controller has
    ``params``, a frozen dataclass, and ``set_params``; one that has not cannot be limited.
    """

    def __init__(self, controller: Any):
        self._controller = controller
        self._limits: Dict[Tuple[str, ...], Tuple[ParameterLimit, Pose2D]] = {}
        self._usual: Any = None  # the parameters without limits, while there are any

    @property
    def usual(self) -> Any:
        """The controller's parameters without limits; None if it has none."""
        if self._limits:
            return self._usual
        return getattr(self._controller, "params", None)

    def set_params(self, params: Any) -> None:
        """Takes other usual parameters; limits stay in force."""
        self._usual = params
        for limit, _ in self._limits.values():
            params = _limited(params, limit)
        self._controller.set_params(params)

    def impose(self, limit: ParameterLimit, pose: Pose2D) -> None:
        """Begins a limit; ``pose`` is where the robot is."""
        if not limit.greatest:
            return
        usual = self.usual
        self._limits[tuple(field for field, _ in limit.greatest)] = limit, pose
        self.set_params(usual)

    def follow(self, pose: Pose2D) -> None:
        """To be called with the robot's pose in every control cycle."""
        over = [
            fields
            for fields, (limit, since) in self._limits.items()
            if pose.distance_to(since) >= limit.distance_m
        ]
        self._lift(over)

    def lift(self) -> None:
        """Ends all limits."""
        self._lift(list(self._limits))

    def _lift(self, over: List[Tuple[str, ...]]) -> None:
        if over:
            usual = self.usual
            for fields in over:
                del self._limits[fields]
            self.set_params(usual)


def _limited(params: Any, limit: ParameterLimit) -> Any:
    return replace(
        params,
        **{
            field: max(-greatest, min(getattr(params, field), greatest))
            for field, greatest in limit.greatest
        },
    )
