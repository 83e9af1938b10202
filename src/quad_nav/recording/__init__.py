"""Flights as data: recorded as bags or MCAP, read back, traced as arrays, and viewed in 3D.

Reading order: ``trace`` (a flight as arrays) and ``messages`` (ROS messages without ROS).
Writing: ``record_file`` (the files), ``action_topics`` and ``navigator_topics`` (what a
``move_base`` publishes), ``recorder`` (a whole flight). Reading: ``bag_file`` (messages of a
recording), ``bag_checks`` (validation), ``bag_robot`` (one robot), ``bag_trace`` (the trace).
``viewer`` and ``viewer_solids`` show a flight in rerun. ``web_view``, ``web_items`` and
``web_actions`` show a running flight on a page; ``bag_index``, ``recorded_costmaps``,
``recorded_robot``, ``recorded_flight`` and ``replay`` a recorded one.
"""
