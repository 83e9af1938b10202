"""The navigator: move_base's state machine without ROS.

Reading order: ``params`` (move_base's parameters), ``tick`` (input and output of one step),
``navigator`` (the states and their transitions), and its parts: ``costmap_updates``,
``plan_search``, ``control_supervisor``, ``parameter_limiter`` and ``recovery_sequence``.
"""
