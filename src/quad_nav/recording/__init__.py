"""Flights as data: recorded as bags, read back, and traced as arrays.

Reading order: ``trace`` (a flight as arrays) and ``messages`` (ROS messages without ROS).
Writing: ``record_file`` (the files), ``action_topics`` and ``navigator_topics`` (what a
``move_base`` publishes), ``recorder`` (a whole flight). Reading: ``bag_file`` (messages of a
recording), ``bag_robot`` (one robot), ``bag_trace`` (the trace).
"""
