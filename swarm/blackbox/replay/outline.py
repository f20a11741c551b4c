"""What has to be known of a tape before it is replayed."""

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from swarm.messages import Broadcast
from swarm.tape.reader import Answered, TapeFile, TapeRow
from swarm.tape.rows import GIVEN, RESUME

SPARE: Final = 100  # ticks for which senses and broadcasts are kept beside those that are needed


class Outline(NamedTuple):
    """The length of a tape, and what later rows need of earlier ones."""

    ticks: int
    resumed: frozenset[int]  # rows at whose end a world saved that was killed later
    slowest: int  # ticks by which an answer was late, at most
    memory: int  # ticks for which senses and broadcasts are kept
    foreign: Mapping[tuple[int, str, int], Broadcast]  # by run, robot and tick

    @classmethod
    def read_outline(cls, file: TapeFile, each: Callable[[TapeRow], None] = lambda row: None) -> "Outline":
        """Read a tape once; ``each`` is called with every row.

        Raises:
            ConfigError: a row is none.
        """
        ticks, resumed, slowest, memory = 0, set[int](), 0, 0
        foreign = dict[tuple[int, str, int], Broadcast]()
        for row in file.rows():
            each(row)
            ticks += row.whole
            for item in row.items:
                if isinstance(item, Answered):
                    slowest = max(slowest, item.lag)
                    for lag, heard, _ in ((item.lag, item.heard or (), None), *item.before):
                        memory = max(memory, lag + max((age for _, age in heard), default=0))
                elif item[0] == RESUME:
                    resumed.add(item[1])
                elif item[0] == GIVEN and isinstance(one := item[2], Broadcast):
                    foreign[one.run, one.robot, one.tick] = one
        return cls(ticks, frozenset(resumed), slowest, memory + SPARE, foreign)
