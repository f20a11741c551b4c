"""The rows of a tape: MessagePack values one after the other; the first is the head, each later one a tick or a part.

The head is ``[bytes, crc32]`` with the bytes of a ``Head``.

A row is ``[items, checks]``, and ``[items, checks, 0]`` if the tick goes on in the next row. ``items`` is nil if the
same robots have answered as in the tick before, as late as then, with what their senses list. ``checks`` has two bytes
for each item, in order: of the command for an answer, else of the item. The table has all items; a robot is its number.

=============================  ==================================================================================
item                           meaning
=============================  ==================================================================================
``n``                          robot n has answered the sense of this tick, and had heard what that lists
``[n, lag]``                   it has answered the sense of ``lag`` ticks ago
``[n, lag, heard, e, again]``  it had heard other broadcasts, ``[robot, age in ticks, ...]``, had fetched the map with
                               e edits (nil: none), or says again what it had answered before
``[n, ..., again, before]``    its last steps too, whose answers may be lost: ``[lag, heard, e]`` of each
``["join", n, ours]``          a process without memory has taken robot n's place; ``ours``: of the world's code
``["given", n, kind, bytes]``  a message of a robot of other code, or of a body outside, whole
``["ask", n, kind, bytes]``    a request that the world has carried out; n is nil if it is to no robot
``"sense"``                    the senses of this tick are made here; without it, before all other items
``"save"``                     the world has saved its state here
``"restart"``                  a new run has begun
``["resume", row]``            the world was started again, and goes on from what it saved at the end of that row
=============================  ==================================================================================
"""

from collections.abc import Callable, Sequence
from typing import Annotated, Any, Final
from zlib import crc32

from msgspec import Meta, Struct
from msgspec.msgpack import Encoder

from swarm.bus.codec import encode
from swarm.messages import (
    BodyReport,
    Broadcast,
    Command,
    Edit,
    Id,
    Map,
    Message,
    Order,
    Places,
    PoolTargets,
    RobotAction,
)
from swarm.messages.fields import Count

FORMAT: Final = "zenoh-swarm tape 1"
CHECK: Final = 2  # bytes for each answer
SENSE, SAVE, RESTART, RESUME, JOIN, GIVEN, ASK = "sense", "save", "restart", "resume", "join", "given", "ask"
PACKER: Final = Encoder()
ASKED: Final[dict[str, type[Message]]] = {one.__name__: one for one in (Edit, Order, Places, PoolTargets, RobotAction)}
MESSAGES: Final[dict[str, type[Message]]] = {one.__name__: one for one in (BodyReport, Broadcast, Command)}


class Head(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The first row: all that a run begins with."""

    format: str
    version: str  # of this package
    code: str  # fingerprint
    seed: Annotated[int, Meta(ge=0, le=2**53)]
    pace: str  # max: lockstep
    limit: float  # s
    identity: Id  # of the world
    run: Count  # number of the first one
    outside: list[Id]  # robots whose body is outside
    map: Map  # with scenario, rules and the start of each robot

    @property
    def starts(self) -> dict[str, tuple[float, float, float]]:
        """The start of each robot [m, m, rad]."""
        starts = self.map.scenario.starts
        assert isinstance(starts, dict)
        return starts


def check_of(command: Command) -> bytes:
    """Return the two bytes that stand for an answer."""
    return (crc32(encode(command)) & 0xFFFF).to_bytes(CHECK)


def check_of_item(item: object) -> bytes:
    """Return the two bytes that stand for an item that is no answer."""
    return (crc32(PACKER.encode(item)) & 0xFFFF).to_bytes(CHECK)


def first_row(head: Head) -> bytes:
    """Return the first row."""
    packed = PACKER.encode(head)
    return PACKER.encode([packed, crc32(packed)])


def answer(number: int, command: Command, now: int, numbers: Callable[[str], int]) -> int | list[Any]:
    """Return the item for an answer that came at a tick of the world; ``numbers`` has the number of each robot."""
    lag, took = now - command.tick, command.took
    if took is None:
        return [number, lag] if lag else number

    def flat(tick: int, heard: Sequence[tuple[str, int]]) -> list[int]:
        return [part for name, one in heard for part in (numbers(name), tick - one)]

    item = [number, lag, flat(command.tick, took.heard), took.edits, took.again]
    before = [[now - tick, flat(tick, heard), edits] for tick, heard, edits in took.before]
    return [*item, before] if before else item


def is_plain(item: object) -> bool:
    """Return True for an answer to what the sense lists: it may come again in the next tick."""
    return isinstance(item, int) or (isinstance(item, list) and len(item) == 2 and isinstance(item[0], int))


def plain_answers_of(items: Sequence[object]) -> list[Any]:
    """Return the plain answers of a tick, in order: nil in the row of the next tick stands for them."""
    return sorted((item for item in items if is_plain(item)), key=order_by_robot)


def order_by_robot(item: Any) -> tuple[int, int]:  # noqa: ANN401
    """Return the order of plain answers in a tick: by robot, the earlier sense first."""
    return (item, 0) if isinstance(item, int) else (item[0], -item[1])
