"""The page of a flight without ROS."""
