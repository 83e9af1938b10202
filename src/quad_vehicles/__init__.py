"""Bridge from velocity commands to the autopilots of real quadcopters, without ROS.

Nothing here reads a clock or starts a thread: the time is an argument. ``mavlink_link`` is the
only module with a socket.

Reading order: `vehicle_file`, `ranges`, `frames`, `telemetry`, `orders`, `states`, `inputs`,
`safety`, `setpoints`.
"""
