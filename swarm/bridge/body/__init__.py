"""A robot of ROS 2 as the body of one robot of the fleet: odometry and a scan come in, twists go out."""
