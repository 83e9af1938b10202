"""Global planners: from the robot's pose to the goal over the global costmap.

Reading order: ``planner`` (the interface, and plans to points near the goal), ``navfn``,
``global_planner`` with ``orientations``, ``carrot``. Their loops are in ``wavefront_kernel``,
``descent`` and ``global_planner_kernel``.
"""
