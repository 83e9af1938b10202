"""What the ROS face says, without ROS: for the nodes and for what records a flight offline.

Each shell puts it into its own classes of messages.
"""
