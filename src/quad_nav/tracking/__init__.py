"""Moving obstacles from the LIDAR alone: what moves, where it is and where it goes."""
