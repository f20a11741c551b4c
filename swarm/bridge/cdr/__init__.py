"""Messages of ROS 2 as bytes, written by hand: those that go out often, or that are long."""
