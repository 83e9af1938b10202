"""The original's faults, mended: one switch each.

What each fault is, and what is done about it, is in ``docs/upstream_bugs.md``.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Fixes:
    """Which faults of the original are mended. ``ORIGINAL`` has them all.

    ``progress_timeout_s``: seconds within ``progress_distance_m`` before a new plan,
    and as many again before recoveries; 0 never. With the new plan obstacle costs weigh
    ``stuck_cost_factor`` of what they did, until the robot has got away.
    ``sensor_timeout_s``: silence of a sensor that stops the robot; 0 leaves it to the
    sensor's own period. With ``reject_implausible_scans`` a scan that cannot be true counts as silence,
    see ``costmap.trust``.
    ``escape_collision``: a round robot that has no legal trajectory goes to where costs are lower.
    ``avoid_peers``: see ``docs/peers.md``. Footprints stay twice ``peer_margin_m`` apart, and a
    peer of which nothing was heard for ``peer_timeout_s`` is not reckoned with. With
    ``yield_when_idle`` a robot without a goal gets out of the way too, and comes back.
    """

    progress_timeout_s: float = 10.0
    progress_distance_m: float = 0.1
    stuck_cost_factor: float = 0.1
    sensor_timeout_s: float = 1.0
    reject_implausible_scans: bool = True
    clear_any_obstacle_layer: bool = True
    reject_colliding_escape: bool = True
    escape_collision: bool = True
    predict_goal_turn: bool = True
    stop_after_rotation: bool = True
    respect_meter_scoring: bool = False
    avoid_peers: bool = True
    peer_margin_m: float = 0.05
    peer_timeout_s: float = 0.5
    yield_when_idle: bool = True


ORIGINAL = Fixes(
    progress_timeout_s=0.0,
    stuck_cost_factor=1.0,
    sensor_timeout_s=0.0,
    reject_implausible_scans=False,
    clear_any_obstacle_layer=False,
    reject_colliding_escape=False,
    escape_collision=False,
    predict_goal_turn=False,
    stop_after_rotation=False,
    avoid_peers=False,
    yield_when_idle=False,
)
