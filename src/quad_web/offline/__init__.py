"""The page of a flight without ROS: one that flies, and one that has not begun."""
