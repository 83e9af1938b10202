"""Fly among people and other things that move without telling.

``Tracker`` is a scan filter: it finds and tracks moving obstacles. ``Evasion`` is a command filter:
it keeps the robot clear of them. Reading order: ``tracker``, ``moving_points`` with
``earlier_scans``, ``discs``, ``association``, ``kalman``, ``halted_obstacles``; ``evasion`` with
``reachable``.
"""

from __future__ import annotations

from quad_moving.evasion import Evasion
from quad_moving.tracker import Tracker

__all__ = ["Evasion", "Tracker"]
