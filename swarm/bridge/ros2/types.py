"""The message types of ROS 2: how to make, serialize (CDR) and hash them, without ROS."""

import struct
from collections.abc import Iterator
from types import MappingProxyType
from typing import Any, Final

from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from swarm.bridge.cdr.layouts import CDR_HEADER
from swarm.bridge.ros2.interfaces import ACTIONS, MESSAGES, SERVICES, ActionText, ServiceText
from swarm.errors import PeerError

DISTROS: Final = MappingProxyType(
    {"jazzy": Stores.ROS2_JAZZY, "kilted": Stores.ROS2_KILTED, "lyrical": Stores.ROS2_LYRICAL}
)
BROKEN: Final = (SerdeError, struct.error, ValueError, IndexError, AssertionError)  # what rosbags raises for no CDR


EVENT_INFO: Final = "service_msgs/msg/ServiceEventInfo"


class Types:
    """The types of a ROS distribution, named as in ``nav_msgs/msg/Odometry``; those of the bridge's services too."""

    def __init__(self, distro: str) -> None:
        self._store = get_typestore(DISTROS[distro])
        del self._store.fielddefs[EVENT_INFO]
        for name, text in MESSAGES.items():
            self._store.register({name: _parse_definition(text)})
        for name, service in SERVICES.items():
            self.add_service(name, service)
        for name, action in ACTIONS[distro].items():
            self.add_action(name, action)

    def add_service(self, name: str, text: ServiceText) -> None:
        """Add a service; the type of that name has its hash (rosidl's service type descriptions)."""
        self._store.register(
            dict(_make_service_types(name, _parse_definition(text.request), _parse_definition(text.response)))
        )

    def add_action(self, name: str, text: ActionText) -> None:
        """Add an action: its parts, its two services and its feedback message."""
        self._store.register(dict(_make_action_types(name, text)))

    def make_message(self, name: str, /, **fields: Any) -> Any:  # noqa: ANN401, rosbags makes the classes when it starts
        """Return a message with all its fields."""
        return self._store.types[name](**fields)

    def make_message_from_known(self, name: str, fields: dict[str, Any]) -> Any:  # noqa: ANN401
        """Return a message with those of the fields that the distribution's type has; it has no others."""
        return self._store.types[name](**{field: fields[field] for field, _ in self._store.fielddefs[name][1]})

    def serialize(self, name: str, message: Any) -> bytes:  # noqa: ANN401
        """Return a message as CDR."""
        return bytes(self._store.serialize_cdr(message, name))

    def deserialize(self, name: str, payload: bytes) -> Any:  # noqa: ANN401
        """Return the message in a payload from outside.

        Raises:
            PeerError: the payload is no little-endian CDR of that type.
        """
        if payload[:4] != CDR_HEADER:
            raise PeerError(f"expected CDR of {name}, which begins with 00 01 00 00, got {payload[:4].hex(' ')!r}")
        try:
            return self._store.deserialize_cdr(payload, name)
        except BROKEN as fault:
            raise PeerError(
                f"expected CDR of {name}, got {len(payload)} bytes that are none ({fault or type(fault).__name__})"
            ) from None

    def type_hash(self, name: str) -> str:
        """Return the type hash of REP-2016, ``RIHS01_`` and 64 hex digits: it is a part of a topic's key."""
        found: str = self._store.hash_rihs01(name)
        return found

    def type_definition(self, name: str) -> str:
        """Return the text of a type with those of its parts, as bags and Foxglove have it (``ros2msg``)."""
        text: str = self._store.generate_msgdef(name, ros_version=2)[0]
        return text


def _parse_definition(text: str) -> tuple[Any, Any]:
    """Return the constants and the fields of a definition, as rosbags has them; one without fields gets ROS's own."""
    ((_, found),) = get_types_from_msg(text or "uint8 structure_needs_at_least_one_member", "any/msg/Part").items()
    return found


def _make_action_types(name: str, text: ActionText) -> Iterator[tuple[str, Any]]:
    """Yield the types of an action (https://design.ros2.org/articles/actions.html)."""
    for part, definition in zip(("Goal", "Result", "Feedback"), text, strict=True):
        yield f"{name}_{part}", _parse_definition(definition)
    goal_id = "goal_id", (Nodetype.NAME, "unique_identifier_msgs/msg/UUID")
    yield from _make_service_types(
        f"{name}_SendGoal",
        ([], [goal_id, ("goal", (Nodetype.NAME, f"{name}_Goal"))]),
        _parse_definition("bool accepted\nbuiltin_interfaces/Time stamp"),
    )
    status = "status", (Nodetype.BASE, ("int8", 0))
    yield from _make_service_types(
        f"{name}_GetResult", ([], [goal_id]), ([], [status, ("result", (Nodetype.NAME, f"{name}_Result"))])
    )
    yield f"{name}_FeedbackMessage", ([], [goal_id, ("feedback", (Nodetype.NAME, f"{name}_Feedback"))])


def _make_service_types(name: str, request: Any, response: Any) -> Iterator[tuple[str, Any]]:  # noqa: ANN401
    parts = {part: (Nodetype.NAME, f"{name}_{part.capitalize()}") for part in ("request", "response", "event")}
    yield f"{name}_Request", request
    yield f"{name}_Response", response
    at_most_one = [(part, (Nodetype.SEQUENCE, (parts[part], 1))) for part in ("request", "response")]
    yield f"{name}_Event", ([], [("info", (Nodetype.NAME, EVENT_INFO)), *at_most_one])
    yield name, ([], [(f"{part}_message", kind) for part, kind in parts.items()])
