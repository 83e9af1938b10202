"""Numba loops, and nothing else.

Kernels take arrays, numbers and named tuples, never objects with behaviour. The concept's module
holds the maths and the reasons, the kernel's module the loops. Every kernel also runs as plain
Python, with ``NUMBA_DISABLE_JIT=1``.

Reading order: ``jit``, ``library`` and ``build_library`` (compiled kernels without numba),
``numba_cache``; ``cost_grid`` (cells and costmaps);
``projection``, ``observations``, ``raytrace`` with ``obstructed_cells``, ``voxels``, ``inflation``
(``costmap``);
``wave``, ``descent``, ``global_planner`` (``plan``); ``collision``, ``map_grid``, ``rollout``,
``dwa`` (``control``); ``peers``;
``flight_law``, ``rigid_body``, ``rays``, ``sectors``, ``lidar``, ``rectangles`` (``sim``).
"""
