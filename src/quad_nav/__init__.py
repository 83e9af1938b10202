"""Fleets of LIDAR quadcopters on the ROS navigation stack.

The project is one loop: scan -> costmap -> global plan -> velocity -> body -> scan. The loop is
plain Python and takes the time as an argument. ``offline`` runs it in one process on a virtual
clock. ``ros`` cuts it at the topics.

Reading order: ``geometry`` and ``grid`` (poses, cells), ``costmap`` (scan to costs), ``plan``
(costs to path), ``control`` (path to velocity), ``recovery`` and ``peers`` (stuck robots, other
robots), ``navigator`` (move_base's state machine), ``sim`` (velocity to body to scan), ``mission``
(goals and results), ``config`` (move_base's YAML), ``scenario`` (a checked set-up), ``offline``
and ``ros`` (the two shells), ``cli`` (the command line). ``docs/architecture.md`` has a picture.
"""

from __future__ import annotations

from quad_nav.versions import package_version

__version__ = package_version()
