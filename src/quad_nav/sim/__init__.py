"""Simulator: scenes, rigid bodies, flight controller, LIDARs and contacts, without ROS.

Reading order: ``obstacles`` (their shapes), ``scene`` (the arena), ``simulation`` (the steps),
``flight`` (controller), ``body`` (pybullet) and ``free_flight`` (without it), ``contacts``,
``lidar`` and ``casters`` with ``solids``. Their loops are in ``flight_law``, ``rigid_body``,
``lidar_kernel``, ``rays`` and ``sectors``. ``scene_file`` reads scenes, ``scene_writer`` writes
them, and ``imported_scene`` makes them of Gazebo worlds (``world_file``, ``sdf``, ``mesh``), Stage
worlds (``stage_world``) and maps (``map_file``). ``pacing`` relates simulated time to wall time.
"""
