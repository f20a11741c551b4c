"""The bridge to ROS 2."""
