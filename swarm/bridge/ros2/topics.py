"""The table of all topics that the bridge offers to ROS, and of those that it hears."""

from typing import Final

from swarm.bridge.ros2.wire import Qos, RosTopic

# fmt: off
#                     name         type                                        QoS
MAP       = RosTopic("map",       "nav_msgs/msg/OccupancyGrid",               Qos.LATCHED)
CLOCK     = RosTopic("clock",     "rosgraph_msgs/msg/Clock")
TF        = RosTopic("tf",        "tf2_msgs/msg/TFMessage",                   Qos.TF)
ODOMETRY  = RosTopic("odom",      "nav_msgs/msg/Odometry")
SCAN      = RosTopic("scan",      "sensor_msgs/msg/LaserScan",                Qos.SENSOR)
PLAN      = RosTopic("plan",      "nav_msgs/msg/Path",                        Qos.LATCHED)  # told on change only
POSE      = RosTopic("amcl_pose", "geometry_msgs/msg/PoseWithCovarianceStamped", Qos.LATCHED)  # as Nav2's AMCL
GOAL      = RosTopic("goal_pose", "geometry_msgs/msg/PoseStamped")
INITIAL_POSE = RosTopic("initialpose", "geometry_msgs/msg/PoseWithCovarianceStamped")  # refused
# fmt: on

OF_FLEET: Final = (MAP, CLOCK, TF)  # in the namespace /
OF_ROBOT: Final = (ODOMETRY, SCAN, PLAN, POSE, TF)  # in the namespace of each robot
HEARD: Final = (GOAL, INITIAL_POSE)  # in the namespace of each robot
