"""Navigators in the simulation's process: the loop that flies offline, with ROS around it.

Scans, poses and peers are handed over in memory; topics, services, actions and parameters of each
robot are those of a separate navigator. The first share of the robots flies in the simulator's
process, each further one in a worker process, which is a node of its own: `fleet1`, `fleet2`, ...

Reading order: `fleet` (the loop in the simulator's process), `group` (the robots of a process),
`robot` (one robot), `own_nodes` (topics that are not heard through sockets), `intentions` (robots
whose navigators are elsewhere).
"""
