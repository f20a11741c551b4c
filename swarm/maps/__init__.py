"""Map formats (text, ROS, MovingAI) and their loaders; every loader returns the same occupancy map."""
