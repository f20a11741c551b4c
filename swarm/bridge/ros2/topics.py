"""The table of all topics that the bridge offers to ROS, and of those that it hears."""

from enum import StrEnum
from typing import Final, NamedTuple


class Qos(StrEnum):
    """The qualities of service that the bridge offers, in the text of a token: empty is rmw_zenoh's default.

    The parts are reliability (2: best effort), durability (1: transient local), history and depth; then deadline,
    lifespan and liveliness.
    """

    DEFAULT = "::,10:,:,:,,"
    LATCHED = ":1:,1:,:,:,,"
    SENSOR = "2::,5:,:,:,,"
    TF = "::,100:,:,:,,"  # tf2's own

    @property
    def is_latched(self) -> bool:
        """True if who comes late gets the last message."""
        return self is Qos.LATCHED


class RosTopic(NamedTuple):
    """A topic of ROS, below the namespace of its node."""

    name: str
    type: str
    qos: Qos = Qos.DEFAULT


class RosService(NamedTuple):
    """A service of ROS, below the namespace of its node."""

    name: str
    type: str
    qos: Qos = Qos.DEFAULT


# fmt: off
#                       name           type                                        QoS
MAP         = RosTopic("map",         "nav_msgs/msg/OccupancyGrid",               Qos.LATCHED)
CLOCK       = RosTopic("clock",       "rosgraph_msgs/msg/Clock")
TF          = RosTopic("tf",          "tf2_msgs/msg/TFMessage",                   Qos.TF)
TF_STATIC   = RosTopic("tf_static",   "tf2_msgs/msg/TFMessage",                   Qos.LATCHED)
MARKERS     = RosTopic("markers",     "visualization_msgs/msg/MarkerArray")
DIAGNOSTICS = RosTopic("diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
ODOMETRY    = RosTopic("odom",        "nav_msgs/msg/Odometry")
SCAN        = RosTopic("scan",        "sensor_msgs/msg/LaserScan",                Qos.SENSOR)
PLAN        = RosTopic("plan",        "nav_msgs/msg/Path",                        Qos.LATCHED)  # told on change only
POSE        = RosTopic("amcl_pose",   "geometry_msgs/msg/PoseWithCovarianceStamped", Qos.LATCHED)  # as Nav2's AMCL
BATTERY     = RosTopic("battery_state", "sensor_msgs/msg/BatteryState")
GOAL        = RosTopic("goal_pose",   "geometry_msgs/msg/PoseStamped")
INITIAL_POSE = RosTopic("initialpose", "geometry_msgs/msg/PoseWithCovarianceStamped")  # refused
# fmt: on

OF_FLEET: Final = (MAP, CLOCK, TF, TF_STATIC, MARKERS, DIAGNOSTICS)  # in the namespace /
OF_ROBOT: Final = (ODOMETRY, SCAN, PLAN, POSE, BATTERY, TF, TF_STATIC)  # in the namespace of each robot
HEARD: Final = (GOAL, INITIAL_POSE)  # in the namespace of each robot
