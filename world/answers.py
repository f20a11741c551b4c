"""What the robots of one run said last: commands to this tick, states, plans; and who did not answer."""

from collections.abc import Sequence

import msgspec

from swarm.messages import Command, Plan, State


class Answers:
    """One run's; a restart begins with a new one."""

    def __init__(self) -> None:
        self.commands: dict[str, Command] = {}  # to this tick, or late to an earlier one
        self.states: dict[str, State] = {}
        self.plans: dict[str, Plan] = {}
        self.deaf: set[str] = set()  # there, but they did not answer in time
        self.late = 0  # commands that came after their tick

    def take(self, name: str, message: Command | State | Plan, run: int, tick: int) -> None:
        """Note a message; one of another run, or of a tick that nobody was told of, counts as nothing."""
        if message.run != run or message.tick > tick:
            return
        match message:
            case Command():
                self.deaf.discard(name)
                self.late += message.tick < tick
                known = self.commands.get(name)
                self.commands[name] = message if known is None else merged(message, known)
            case State():
                self.states[name] = message
            case Plan():
                self.plans[name] = message

    def awaited(self, present: Sequence[str]) -> list[str]:
        """List the robots that are there and are expected to answer."""
        return [name for name in present if name not in self.deaf]

    def lacking(self, present: Sequence[str]) -> list[str]:
        """List those that still have to answer this tick."""
        return [name for name in self.awaited(present) if name not in self.commands]


def merged(one: Command, other: Command) -> Command:
    """Return the later of two commands of one robot (the second, of one tick), with all that either tells only once.

    A robot that was late answers twice within one tick of the world: of its speeds the latest count, but neither
    what happened nor that it broadcast may be lost.
    """
    older, newer = sorted((one, other), key=lambda command: command.tick)
    return msgspec.structs.replace(newer, notes=[*older.notes, *newer.notes], sent=older.sent or newer.sent)
