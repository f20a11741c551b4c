"""What happens when on a tape, by its rows alone: the ticks that it has, and when each robot answers next."""

from collections.abc import Iterator

from swarm.blackbox.explain.run_history import Next
from swarm.errors import ConfigError
from swarm.messages import Command
from swarm.tape.reader import Answered, Mark, TapeFile, TapeRow
from swarm.tape.rows import GIVEN, JOIN, RESTART, RESUME, SAVE

When = tuple[int, int]  # run and tick


class Timeline:
    """The ticks of a tape, in the order in which the world lived them. Give it every row of the file, in order."""

    def __init__(self, file: TapeFile) -> None:
        self._file = file
        self._saved: dict[int, When] = {}  # by row: what the world has saved there
        self._next: When = file.head.run, 0  # where the next row begins
        self.ticks: list[When] = []

    @classmethod
    def read_timeline(cls, file: TapeFile) -> "Timeline":
        """Read a tape once.

        Raises:
            ConfigError: a row is none.
        """
        timeline = cls(file)
        for row in file.rows():
            timeline.take(row)
        return timeline

    def take(self, row: TapeRow) -> None:
        """Take in the next row of the tape."""
        when, self._next = self._place(row, self._next)
        if row.whole:
            self.ticks.append(when)

    def last(self, run: int | None, tick: int | None) -> int:
        """Return how many ticks the world has lived at the end of a tick: the last life counts, and the last run.

        ``tick`` None is the newest one.

        Raises:
            ConfigError: there is no such tick.
        """
        runs = {one for one, _ in self.ticks}
        if not runs:
            raise ConfigError(f"tape {self._file.path}: expected ticks, got none; the run has not begun")
        run = max(runs) if run is None else run
        if run not in runs:
            known = f"{min(runs)} to {max(runs)}" if len(runs) > 1 else str(max(runs))
            raise ConfigError(f"--run: expected {known}, got {run}; the tape has no other")
        rate, newest = self._file.head.map.scenario.settings.rate, max(at for one, at in self.ticks if one == run)
        tick = newest if tick is None else tick
        if not 0 <= tick <= newest:
            text = f"expected 0 to {newest / rate:.2f} s, got {tick / rate:g}; the tape ends there"
            raise ConfigError(f"--at: {text}")
        return len(self.ticks) - self.ticks[::-1].index((run, tick))

    def next_answers(self, mark: Mark) -> dict[int, Next]:
        """Return what robots, by number, do next after the end of a tick; others do not answer again in its run."""
        found, born = dict[int, Next](), set[int]()
        run, tick = self.ticks[mark.ticks - 1] if mark.ticks else (self._file.head.run, -1)
        ahead = run, tick + 1
        for row in self._file.rows(mark):
            (now, at), ahead = self._place(row, ahead)
            if now != run or len(found) == len(self._file.head.starts):
                break
            for robot, sensed in _answers(row, at, born):
                found.setdefault(robot, Next(at, sensed, robot in born))
        return found

    def _place(self, row: TapeRow, when: When) -> tuple[When, When]:
        """Return the run and tick in which a row ends that begins at ``when``, and those in which the next begins."""
        run, tick = when
        for item in row.items:
            if item == RESTART:
                run, tick = run + 1, 0
            elif isinstance(item, list) and item[0] == RESUME:
                run, tick = self._saved.get(item[1], (run, tick))
        if SAVE in row.items:
            self._saved[row.number] = run, tick
        return (run, tick), (run, tick + row.whole)


def _answers(row: TapeRow, tick: int, born: set[int]) -> Iterator[tuple[int, int]]:
    """Yield the robots that answer in a row, and the ticks that they answer; ``born`` gets those that join in it."""
    for item in row.items:
        match item:
            case Answered():
                yield item.robot, tick - item.lag
            case [kind, int(robot), Command() as command] if kind == GIVEN:
                yield robot, command.tick
            case [kind, int(robot), bool()] if kind == JOIN:
                born.add(robot)
