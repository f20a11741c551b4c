"""The services and actions of ROS that the bridge speaks, as their definitions have them: no wheel has these packages.

The texts are those of the `.srv` and `.action` files without comments and constants, which neither bytes nor hashes
know. Sources: rcl_interfaces, lifecycle_msgs, action_msgs and nav2_msgs of Jazzy and Kilted, and nav2_msgs' main branch
of 2026 for Lyrical.
"""

from typing import Final, NamedTuple

CANCEL: Final = "action_msgs/srv/CancelGoal"
TO_POSE: Final = "nav2_msgs/action/NavigateToPose"
THROUGH_POSES: Final = "nav2_msgs/action/NavigateThroughPoses"


class ServiceText(NamedTuple):
    """The two parts of a service's definition."""

    request: str
    response: str


class ActionText(NamedTuple):
    """The three parts of an action's definition."""

    goal: str
    result: str
    feedback: str


SERVICES: Final = {
    CANCEL: ServiceText("action_msgs/GoalInfo goal_info", "int8 return_code\naction_msgs/GoalInfo[] goals_canceling"),
    "lifecycle_msgs/srv/GetState": ServiceText("", "lifecycle_msgs/State current_state"),
    "rcl_interfaces/srv/DescribeParameters": ServiceText(
        "string[] names", "rcl_interfaces/ParameterDescriptor[] descriptors"
    ),
    "rcl_interfaces/srv/GetParameterTypes": ServiceText("string[] names", "uint8[] types"),
    "rcl_interfaces/srv/GetParameters": ServiceText("string[] names", "rcl_interfaces/ParameterValue[] values"),
    "rcl_interfaces/srv/ListParameters": ServiceText(
        "string[] prefixes\nuint64 depth", "rcl_interfaces/ListParametersResult result"
    ),
    "rcl_interfaces/srv/SetParameters": ServiceText(
        "rcl_interfaces/Parameter[] parameters", "rcl_interfaces/SetParametersResult[] results"
    ),
    "rcl_interfaces/srv/SetParametersAtomically": ServiceText(
        "rcl_interfaces/Parameter[] parameters", "rcl_interfaces/SetParametersResult result"
    ),
}

FEEDBACK: Final = """\
geometry_msgs/PoseStamped current_pose
builtin_interfaces/Duration navigation_time
builtin_interfaces/Duration estimated_time_remaining
int16 number_of_recoveries
float32 distance_remaining"""
OF_WAYPOINTS: Final = "nav2_msgs/WaypointStatus[] waypoint_statuses"
OF_ERROR: Final = "uint16 error_code\nstring error_msg"

OF_TRACKING: Final = "float32 position_tracking_error\nfloat32 heading_tracking_error"
LEFT: Final = "int16 number_of_poses_remaining"

ONE_POSE: Final = "geometry_msgs/PoseStamped pose\nstring behavior_tree"
GOALS: Final = "nav_msgs/Goals poses\nstring behavior_tree"

ACTIONS: Final = {  # by distribution
    "jazzy": {
        TO_POSE: ActionText(ONE_POSE, OF_ERROR, FEEDBACK),
        THROUGH_POSES: ActionText(
            "geometry_msgs/PoseStamped[] poses\nstring behavior_tree", OF_ERROR, f"{FEEDBACK}\n{LEFT}"
        ),
    },
    "kilted": {
        TO_POSE: ActionText(ONE_POSE, OF_ERROR, FEEDBACK),
        THROUGH_POSES: ActionText(GOALS, f"{OF_ERROR}\n{OF_WAYPOINTS}", f"{FEEDBACK}\n{LEFT}\n{OF_WAYPOINTS}"),
    },
    "lyrical": {
        TO_POSE: ActionText(ONE_POSE, OF_ERROR, f"{FEEDBACK}\n{OF_TRACKING}"),
        THROUGH_POSES: ActionText(
            GOALS, f"{OF_ERROR}\n{OF_WAYPOINTS}", f"{FEEDBACK}\n{OF_TRACKING}\n{LEFT}\n{OF_WAYPOINTS}"
        ),
    },
}

MESSAGES: Final = {
    # the store of rosbags writes `char[16]` as ROS does, but hashes its char as another type than ROS, which has uint8
    "service_msgs/msg/ServiceEventInfo":
        "uint8 event_type\nbuiltin_interfaces/Time stamp\nuint8[16] client_gid\nint64 sequence_number",
    "nav2_msgs/msg/WaypointStatus":
        "uint8 waypoint_status\nuint32 waypoint_index\ngeometry_msgs/PoseStamped waypoint_pose\n"
        "uint16 error_code\nstring error_msg",
}  # fmt: skip
