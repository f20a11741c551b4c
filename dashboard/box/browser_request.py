"""What a browser, or curl, asks for: the wire's requests as JSON, checked against the wire's own types.

The box commands a fleet only with these requests, so a script can do all that the page does.
"""

import json
from collections.abc import Callable
from typing import Any, Final, TypeVar

import msgspec

from dashboard.box.questions import Question, What
from dashboard.box.scenario_file import scenario_file
from dashboard.box.tape_process import TapeProcess
from swarm.bus import Bus
from swarm.errors import ConfigError, PeerError, suggest
from swarm.messages import ACTION, EDIT, MAP, ORDER, PLACES, POOL, REPLIES, ROBOT_ACTION, SETUP, STATUS, Id, Topic
from swarm.messages.schema import build_index

Asked = TypeVar("Asked", bound=msgspec.Struct)

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

    ``viewer`` starts Rerun's viewer and returns its address; ``past`` answers for the tape.
    """

    def __init__(self, bus: Bus, viewer: Callable[[], str], past: TapeProcess) -> None:
        self._bus, self._viewer, self._past = bus, viewer, past

    def ask(self, name: str, robot: str | None, body: bytes) -> bytes:
        """Carry out a request and return the answer as JSON.

        Raises:
            ConfigError: the request is not of the wire's type.
            PeerError: the fleet has refused it, or does not answer.
        """
        topic = REQUESTS[name]
        asked = _find_robot(name, robot) if topic.key in OF_A_ROBOT else ""
        hint = f"`swarm schema {topic.message.__name__}` prints the type"
        message = _parse_request(name, topic.message, body, hint)
        return msgspec.json.encode(self._bus.ask(topic, message, ANSWER, robot=asked))

    def of_the_past(self, name: What, robot: str | None, body: bytes) -> bytes:
        """Return the answer of the run's tape to a question, as JSON.

        Raises:
            ConfigError: the body is no question.
            PeerError: the tape does not say, or there is none.
        """
        about = None if robot is None else _find_robot(name, robot)
        return self._past.ask(name, about, _parse_request(name, Question, body, "docs/box.md has its fields"))

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
        return json.dumps(json.loads(build_index()) | {"paths": paths}, indent=1).encode()

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


def _find_robot(path: str, robot: str | None) -> str:
    """Return the robot that an address names.

    Raises:
        ConfigError: it names none.
    """
    try:
        return msgspec.convert(robot, Id)
    except msgspec.ValidationError:
        raise ConfigError(f"/{path}: expected ?robot=NAME, such as ?robot=r1, got {robot!r:.100}") from None


def _parse_request(name: str, kind: type[Asked], body: bytes, hint: str) -> Asked:
    """Return a request that says nothing else than its type: on the wire newer fields pass, but who types here errs.

    Raises:
        ConfigError: it is not of that type, or a field is unknown.
    """
    try:
        message = msgspec.json.decode(body, type=kind)
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as fault:
        raise ConfigError(f"/{name}: expected {kind.__name__} as JSON, {fault}; {hint}") from None
    known, what = kind.__struct_fields__, kind.__name__
    for field in msgspec.json.decode(body, type=dict[str, Any]):
        if field not in {*known, "v"}:
            raise ConfigError(f"/{name}: expected the fields of {what}, got {field!r:.100}; {suggest(field, known)}")
    return message
