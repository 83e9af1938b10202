"""Costmaps: what sensors, maps and peers know, as costs for the planners.

    scans -> layers' own grids -> master grid -> planners

Reading order: ``cost_grid`` (grids, windows, bounds), ``layer`` (the interface of a layer),
``layered`` (the costmap), ``observation`` and ``obstacle`` (what sensors see), ``voxel``,
``static``, ``inflation``, ``peer_layer``, ``projection`` (scan to points), ``scan_validator``
and ``scan_intake`` (how a scan reaches the layers). Their loops are in ``cost_grid_kernel`` and
``collision`` (cells and costs under a footprint), ``observation_kernel``, ``raytrace`` with
``obstructed_cells``, and ``voxel_kernel``.
"""
