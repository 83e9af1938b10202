"""Local planners: velocity commands that follow a global plan over the local costmap.

Reading order: ``controller`` (the interface), ``plan_follower`` (what both planners share),
``map_grid`` (distances to plan and goal), then trajectory rollout (``trajectory_planner``,
``velocity_search``, ``rollout``, ``oscillation``) or the dynamic window approach
(``dwa_planner``, ``dwa_samples``, ``dwa_critics``, ``dwa_oscillation``); ``goal`` (stop and turn at
the goal), ``escape`` (out of a collision). Their loops are in ``map_grid_kernel``;
``velocity_search_kernel``, ``rollout_kernel``, ``sample_motion`` and ``lanes``; ``dwa_search`` and
``dwa_kernel``.
"""
