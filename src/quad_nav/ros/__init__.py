"""The ROS shell: nodes, topics and services around the core.

Sub-packages: `common` (messages, transforms, names), `navigator` (the nodes `move_base` and
`fleet`), `simulator` (the node that owns the bodies and the clock), `sequencer` (the node that
sends the goals and writes the summary). No other package imports rospy or messages.
"""
