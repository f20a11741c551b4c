"""What a browser, or curl, asks for: the wire's requests as JSON, checked against the wire's own types.

The box commands a fleet only with these requests, so a script can do all that the page does.
"""

import json
from collections.abc import Callable
from typing import Any, Final

import msgspec

from dashboard.box.saving import scenario_file
from swarm.bus import Bus
from swarm.errors import ConfigError, PeerError, nearest
from swarm.messages import ACTION, EDIT, MAP, ORDER, PLACES, POOL, REPLIES, ROBOT_ACTION, SETUP, STATUS, Id, Topic
from swarm.messages.schema import index

# path -> topic of the wire; a path below /robot/ has the robot's name behind it
REQUESTS: Final[dict[str, Topic[Any]]] = {
    "action": ACTION,
    "edit": EDIT,
    "setup": SETUP,
    "order": ORDER,
    "robot_action": ROBOT_ACTION,
    "places": PLACES,
    "pool": POOL,
}
OF_A_ROBOT: Final = frozenset({ORDER.key, ROBOT_ACTION.key})
ANSWER: Final = 30.0  # s; a large floor is checked before the answer
LOOK: Final = 2.0  # s in which a world that lives tells what it keeps


class Asking:
    """What browsers ask, handed to a fleet's wire; each call may take seconds, and several are made at once.

    ``viewer`` starts Rerun's viewer and returns its address.
    """

    def __init__(self, bus: Bus, viewer: Callable[[], str]) -> None:
        self._bus, self._viewer = bus, viewer

    def ask(self, name: str, robot: str | None, body: bytes) -> bytes:
        """Carry out a request and return the answer as JSON.

        Raises:
            ConfigError: the request is not of the wire's type.
            PeerError: the fleet has refused it, or does not answer.
        """
        topic = REQUESTS[name]
        try:
            asked = msgspec.convert(robot, Id) if topic.key in OF_A_ROBOT else ""
        except msgspec.ValidationError:
            raise ConfigError(f"/{name}: expected ?robot=NAME, such as ?robot=r1, got {robot!r:.100}") from None
        try:
            message = msgspec.json.decode(body, type=topic.message)
        except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as fault:
            raise ConfigError(
                f"/{name}: expected {topic.message.__name__} as JSON, {fault}; "
                f"`swarm schema {topic.message.__name__}` prints the type"
            ) from None
        _check_fields(name, topic.message, body)
        return msgspec.json.encode(self._bus.ask(topic, message, ANSWER, robot=asked))

    def status(self) -> bytes:
        """Return the world's status as JSON.

        Raises:
            PeerError: no world answers.
        """
        if not (found := self._bus.fetch(STATUS, LOOK)):
            raise PeerError("status: expected a world in that fleet, found none; is it starting?")
        return msgspec.json.encode(found[0])

    def topics(self) -> bytes:
        """Return the table of topics as JSON; ``paths`` says which path asks on which topic."""
        paths = {
            f"/{name}{'?robot=NAME' if topic.key in OF_A_ROBOT else ''}": {
                "topic": topic.key,
                "message": topic.message.__name__,
                "answer": REPLIES[topic.key].__name__,
            }
            for name, topic in REQUESTS.items()
        }
        return json.dumps(json.loads(index()) | {"paths": paths}, indent=1).encode()

    def scenario(self) -> bytes:
        """Return a scenario file of the floor as it is now, and of the set-up.

        Raises:
            PeerError: no world or no launcher answers.
            ConfigError: the floor cannot be drawn in a scenario file.
        """
        floors, setups = self._bus.fetch(MAP, LOOK), self._bus.fetch(SETUP, LOOK)
        if not floors or not setups:
            raise PeerError("scenario: expected a world and a launcher, found none; is the fleet starting?")
        return scenario_file(floors[0], setups[0]).encode()

    def viewer(self) -> bytes:
        """Return where Rerun's viewer is.

        Raises:
            PeerError: it is not installed, or it did not start.
        """
        return msgspec.json.encode({"address": self._viewer()})


def _check_fields(name: str, kind: type[msgspec.Struct], body: bytes) -> None:
    """Check that a request says nothing else than its type: on the wire newer fields pass, but who types here errs.

    Raises:
        ConfigError: a field is unknown.
    """
    known, what = kind.__struct_fields__, kind.__name__
    for field in msgspec.json.decode(body, type=dict[str, Any]):
        if field not in {*known, "v"}:
            raise ConfigError(f"/{name}: expected the fields of {what}, got {field!r:.100}; {nearest(field, known)}")
