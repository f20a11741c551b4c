"""The bridge to ROS 2 over rmw_zenoh: it needs no ROS on this machine. Nothing outside this package imports rosbags."""
