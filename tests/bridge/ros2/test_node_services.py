"""What tools of ROS ask any node: each answer is one that ROS's types have."""

from typing import Any

import pytest

from swarm.bridge.ros2.node_services import BOOL, FIXED, NOT_SET, WITH_STATE, list_services, make_answer_fields
from swarm.bridge.ros2.types import DISTROS, Types

KNOWN = {"use_sim_time": True}
NAMES = ["use_sim_time", "other"]


def parameter(ros: Types, name: str) -> Any:  # noqa: ANN401
    (get,) = [one for one in list_services("n") if one.name == "n/get_parameters"]
    request = ros.make_message(f"{get.type}_Request", names=[name])
    (value,) = make_answer_fields(ros, get, request, KNOWN)["values"]
    return ros.make_message("rcl_interfaces/msg/Parameter", name=name, value=value)


def asked(ros: Types, name: str, **fields: Any) -> Any:  # noqa: ANN401
    """Return the answer to a request after both have been bytes."""
    node = name.split("/")[0]
    (service,) = [one for one in list_services(node) if one.name == name]
    kind = f"{service.type}_Request"
    request = ros.deserialize(kind, ros.serialize(kind, ros.make_message(kind, **fields)))
    kind = f"{service.type}_Response"
    return ros.deserialize(
        kind, ros.serialize(kind, ros.make_message(kind, **make_answer_fields(ros, service, request, KNOWN)))
    )


@pytest.mark.parametrize("distro", DISTROS)
def test_parameters_are_listed_told_and_not_set(distro: str) -> None:
    ros = Types(distro)
    assert asked(ros, "n/list_parameters", prefixes=[], depth=0).result.names == ["use_sim_time"]
    assert asked(ros, "n/list_parameters", prefixes=["qos"], depth=0).result.names == []
    values = asked(ros, "n/get_parameters", names=NAMES).values
    assert [(one.type, one.bool_value) for one in values] == [(BOOL, True), (NOT_SET, False)]
    assert asked(ros, "n/get_parameter_types", names=NAMES).types.tolist() == [BOOL, NOT_SET]
    told = asked(ros, "n/describe_parameters", names=NAMES).descriptors
    assert [(one.name, one.type, one.read_only) for one in told] == [
        ("use_sim_time", BOOL, True), ("other", NOT_SET, True)
    ]  # fmt: skip
    wanted = [parameter(ros, name) for name in NAMES]
    results = asked(ros, "n/set_parameters", parameters=wanted).results
    assert [(one.successful, one.reason) for one in results] == [(False, FIXED)] * 2
    result = asked(ros, "n/set_parameters_atomically", parameters=wanted).result
    assert (result.successful, result.reason) == (False, FIXED)


@pytest.mark.parametrize("node", WITH_STATE)
def test_nodes_of_nav2_are_active(node: str) -> None:
    state = asked(Types("jazzy"), f"{node}/get_state", structure_needs_at_least_one_member=0).current_state
    assert (state.id, state.label) == (3, "active")
