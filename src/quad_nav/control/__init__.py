"""Local planners: velocity commands that follow a global plan over the local costmap.

Reading order: ``controller`` (the interface), ``plan_follower`` (what both planners share: plan
and goal), ``map_grid`` (distances to plan and goal), then trajectory rollout
(``trajectory_planner``, ``velocity_search``, ``rollout``, ``oscillation``) or the dynamic window
approach (``dwa_planner``, ``dwa_critics``, ``dwa_oscillation``); ``escape`` (out of a collision).
Their loops are in ``rollout_kernel``, ``sample_motion`` and ``lanes``; ``dwa_search`` and
``dwa_kernel``.
"""
