"""The services that tools of ROS ask of any node: its parameters, and the state of those that have a lifecycle. Pure.

Nothing can be set: what a robot does is the fleet's. `ros2 param` asks the bridge's own node in each namespace, and
Nav2's `BasicNavigator.waitUntilNav2Active` the state of `bt_navigator` and `amcl`, so nodes of these names are there.
"""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from swarm.bridge.ros2.topics import RosService
from swarm.bridge.ros2.types import Types

WITH_STATE: Final = ("bt_navigator", "amcl")  # nodes that are there for their state
NOT_SET, BOOL = 0, 1  # rcl_interfaces/msg/ParameterType
ACTIVE: Final = {"id": 3, "label": "active"}  # lifecycle_msgs/msg/State
FIXED: Final = "the bridge's parameters are fixed when it starts: see `swarm bridge ros2 --help`"
PARAMETERS: Final = {
    "describe_parameters": "rcl_interfaces/srv/DescribeParameters",
    "get_parameter_types": "rcl_interfaces/srv/GetParameterTypes",
    "get_parameters": "rcl_interfaces/srv/GetParameters",
    "list_parameters": "rcl_interfaces/srv/ListParameters",
    "set_parameters": "rcl_interfaces/srv/SetParameters",
    "set_parameters_atomically": "rcl_interfaces/srv/SetParametersAtomically",
}


def list_services(node: str) -> tuple[RosService, ...]:
    """Return the services of a node: its state if it is there for that, else its parameters."""
    if node in WITH_STATE:
        return (RosService(f"{node}/get_state", "lifecycle_msgs/srv/GetState"),)
    return tuple(RosService(f"{node}/{name}", kind) for name, kind in PARAMETERS.items())


def make_answer_fields(ros: Types, service: RosService, request: Any, known: Mapping[str, bool]) -> dict[str, Any]:  # noqa: ANN401
    """Return the fields of the answer to a request; ``known`` are the parameters of the node."""
    match service.name.rsplit("/", 1)[1]:
        case "get_state":
            return {"current_state": ros.make_message("lifecycle_msgs/msg/State", **ACTIVE)}
        case "describe_parameters":
            return {"descriptors": [_make_descriptor(ros, name, known) for name in request.names]}
        case "get_parameter_types":
            return {"types": np.array([BOOL if name in known else NOT_SET for name in request.names], np.uint8)}
        case "get_parameters":
            return {"values": [_make_parameter_value(ros, known.get(name)) for name in request.names]}
        case "list_parameters":
            names = [name for name in known if not request.prefixes or name in request.prefixes]
            return {"result": ros.make_message("rcl_interfaces/msg/ListParametersResult", names=names, prefixes=[])}
        case "set_parameters":
            return {"results": [_make_set_refusal(ros) for _ in request.parameters]}
        case _:
            return {"result": _make_set_refusal(ros)}


def _make_descriptor(ros: Types, name: str, known: Mapping[str, bool]) -> Any:  # noqa: ANN401
    return ros.make_message(
        "rcl_interfaces/msg/ParameterDescriptor", name=name, type=BOOL if name in known else NOT_SET,
        description="", additional_constraints=FIXED, read_only=True, dynamic_typing=False,
        floating_point_range=[], integer_range=[],
    )  # fmt: skip


def _make_parameter_value(ros: Types, value: bool | None) -> Any:  # noqa: ANN401
    none = {
        "byte_array_value": np.zeros(0, np.uint8), "bool_array_value": np.zeros(0, np.bool_),
        "integer_array_value": np.zeros(0, np.int64), "double_array_value": np.zeros(0, np.float64),
        "string_array_value": [],
    }  # fmt: skip
    return ros.make_message(
        "rcl_interfaces/msg/ParameterValue", type=NOT_SET if value is None else BOOL, bool_value=bool(value),
        integer_value=0, double_value=0.0, string_value="", **none,
    )  # fmt: skip


def _make_set_refusal(ros: Types) -> Any:  # noqa: ANN401
    return ros.make_message("rcl_interfaces/msg/SetParametersResult", successful=False, reason=FIXED)
