"""Follows one sense through the files of a robot, for architecture.md: what was called is written down, not remembered.

Robot r1 of the meeting in ``concepts`` drives a second time, now in the host that a robot's process has. The bus is
replaced by a list of what arrives. The host gets the senses and broadcasts of the meeting; the commands that it sends
must be those of the meeting.
"""

import ast
import sys
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any, Final, NamedTuple
from unittest.mock import Mock

from docs.concepts import SEED, STARTS, Meeting, meeting
from docs.markdown import rows
from swarm.bus import Arrival, Bus, Presence
from swarm.kernels import KERNELS
from swarm.messages import COMMAND, RADIO, SENSE, Command, Message, Topic, Welcome
from swarm.robot.host.process import RobotHost

ROOT: Final = Path(__file__).parents[1]
ROOMS: Final = tuple(str(ROOT / top) for top in ("swarm", "world"))
ME: Final = "r1"
SESSION: Final = "world"
TABLES: Final = "swarm/fuzzy/controller.py"


class Entry(NamedTuple):
    """How a file was entered in a tick."""

    file: str
    caller: str  # the file that called it first; "" for the first file
    functions: dict[str, None]  # that other files called, in order


class Hosted:
    """A host with one robot, on a bus that hands over what it is given."""

    def __init__(self, met: Meeting) -> None:
        settings, packed = met.scenario.to_wire()
        welcome = Welcome(
            robot=ME, world=met.ticks[0].senses[ME].world, session=SESSION, scenario=settings, packed=packed, edits=0,
            start=STARTS[0], state=None,
        )  # fmt: skip
        self._arrivals: list[Arrival | Presence] = [Presence("world", "world", SESSION, alive=True)]
        self._sent: dict[Topic[Any], Message] = {}
        self._bus = Mock(spec=Bus, id="robot", receive=self._receive, send=self._send)
        self._bus.ask.return_value = welcome
        self._host = RobotHost(self._bus, [ME], log=lambda line: None)
        self._host.serve(Mock(is_set=lambda: self._bus.ask.called))

    def _receive(self, wait: float) -> Arrival | Presence | None:
        return self._arrivals.pop(0) if self._arrivals else None

    def _send(self, topic: Topic[Any], message: Message, **ids: object) -> None:
        self._sent[topic] = message

    def answer(self, *arrivals: Arrival) -> dict[Topic[Any], Message]:
        """Return what the robot sends when messages arrive, a sense as the last."""
        self._arrivals += arrivals
        self._sent = {}
        self._host.serve(Mock(is_set=lambda: COMMAND in self._sent))
        return self._sent


class Trace:
    """The files entered while it is in force, in order."""

    def __init__(self) -> None:
        self.entries: dict[str, Entry] = {}

    def __enter__(self) -> "Trace":
        self._before = sys.getprofile()
        sys.setprofile(self._note)
        return self

    def __exit__(self, *fault: object) -> None:
        sys.setprofile(self._before)

    def _note(self, frame: FrameType, event: str, given: object) -> None:
        above = frame.f_back  # None for a kernel that numba compiled, which some versions of Python report
        if event != "call" or above is None or not _is_ours(frame) or "<" in frame.f_code.co_name:
            return
        file = _file(frame)
        while above is not None and not _is_ours(above):
            above = above.f_back
        caller = "" if above is None else _file(above)
        if caller != file:
            entry = self.entries.setdefault(file, Entry(file, caller, {}))
            entry.functions[frame.f_code.co_qualname] = None


def _is_ours(frame: FrameType) -> bool:
    return frame.f_code.co_filename.startswith(ROOMS)


def _file(frame: FrameType) -> str:
    return Path(frame.f_code.co_filename).relative_to(ROOT).as_posix()


@cache
def traces() -> tuple[list[Entry], list[str]]:
    """Return how the files of a tick are entered, and the files that only other ticks of the meeting enter.

    It is the first tick in which the robot drives by a joint plan, asks the fuzzy tables and sends a broadcast.
    """
    met = meeting()
    hosted, shown, entered = Hosted(met), list[Entry](), set[str]()
    spoken = {(name, tick): one for tick, moment in enumerate(met.ticks) for name, one in moment.spoken.items()}
    for moment in met.ticks:
        sense = moment.senses[ME]
        heard = [Arrival(RADIO, {"robot": pair[0]}, spoken[pair]) for pair in sense.hears]
        with Trace() as trace:
            sent = hosted.answer(*heard, Arrival(SENSE, {"robot": ME}, sense))
        command = sent[COMMAND]
        assert isinstance(command, Command)
        assert command == moment.commands[ME], f"tick {sense.tick}: the host and the meeting differ, seed {SEED}"
        entered |= trace.entries.keys()
        if not shown and heard and command.members and RADIO in sent and TABLES in trace.entries:
            shown = list(trace.entries.values())
    assert shown, "in the meeting, the robot drives by a joint plan"
    return shown, sorted(entered - {one.file for one in shown})


def table() -> str:
    """Return the table of the files that one sense passes, and the names of those that other ticks pass."""
    shown, others = traces()
    body = [
        (f"`{one.file}`", f"`{one.caller}`" if one.caller else "", _listed(one.functions), _what(one.file))
        for one in shown
    ]
    head = ("file", "first called from", "what others call in it", "what it is for")
    more = f"Other ticks of the same robot enter {len(others)} more files: {_marked(others)}."
    compiled = f"Compiled kernels leave no trace; those that these files may call are in {_marked(_kernels(shown))}."
    return f"{rows(head, *body)}\n\n{more} {compiled}"


def _kernels(shown: Sequence[Entry]) -> list[str]:
    """Return the files with compiled kernels that files of the tick import and that have no row of their own."""
    sources = "".join((ROOT / one.file).read_text(encoding="utf-8") for one in shown)
    files = [module.replace(".", "/") + ".py" for module in KERNELS if f"from {module} import" in sources]
    return [file for file in files if file not in {one.file for one in shown}]


def _marked(files: Iterable[str]) -> str:
    return ", ".join(f"`{file}`" for file in files)


def _listed(functions: Iterable[str]) -> str:
    """Return names in code marks; a method of the class named before goes without its class."""
    found, before = [], ""
    for name in functions:
        owner, _, own = name.rpartition(".")
        found.append(f"`.{own}`" if owner and owner == before else f"`{name}`")
        before = owner
    return ", ".join(found)


def _what(file: str) -> str:
    """Return the first line of a file's docstring."""
    text = ast.get_docstring(ast.parse((ROOT / file).read_text(encoding="utf-8"))) or ""
    return text.split("\n")[0].replace("``", "`")
