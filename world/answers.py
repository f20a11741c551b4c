"""What the robots of one run said last: commands to this tick, states, plans; and who did not answer."""

from collections.abc import Sequence
from typing import Final

import msgspec

from swarm.messages import Command, Plan, State

SILENT: Final = 5.0  # s that lockstep waits for a robot that is there and does not answer
AGAIN: Final = 1.0  # s after which it is sent its sense again


class Asked:
    """Who was sent the sense of this tick, and when [s, of one clock of the caller's]."""

    def __init__(self, robots: Sequence[str], now: float) -> None:
        self._first = dict.fromkeys(robots, now)
        self._last = dict.fromkeys(robots, now)

    def again(self, lacking: Sequence[str], now: float) -> list[str]:
        """Return those of ``lacking`` that were never sent it, or long ago: it is sent to them now."""
        due = [name for name in lacking if now - self._last.get(name, float("-inf")) >= AGAIN]
        for name in due:
            self._first.setdefault(name, now)
            self._last[name] = now
        return due

    def overdue(self, lacking: Sequence[str], now: float) -> list[str]:
        """Return those of ``lacking`` that have not answered for so long that nobody waits for them any more."""
        return [name for name in lacking if now - self._first.get(name, now) > SILENT]


class Answers:
    """One run's; a restart begins with a new one."""

    def __init__(self) -> None:
        self.commands: dict[str, Command] = {}  # to this tick, or late to an earlier one
        self.states: dict[str, State] = {}
        self.plans: dict[str, Plan] = {}
        self.deaf: set[str] = set()  # there, but they did not answer in time
        self._answered: dict[str, int] = {}  # the newest tick that each robot has answered
        self.late = 0  # commands that came after their tick

    def take(self, name: str, message: Command | State | Plan, run: int, tick: int) -> None:
        """Note a message. One of another run, or of a tick that has not begun, is dropped, as is a repeated answer."""
        if message.run != run or message.tick > tick:
            return
        match message:
            case Command():
                self.deaf.discard(name)
                if message.tick <= self._answered.get(name, -1):
                    return
                self._answered[name] = message.tick
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

    def lacking(self, present: Sequence[str], tick: int) -> list[str]:
        """List those that still have to answer this tick."""
        return [name for name in self.awaited(present) if self._answered.get(name) != tick]


def merged(one: Command, other: Command) -> Command:
    """Return the later of two commands of one robot (the second, of one tick), with all that either tells only once.

    A robot that was late answers twice within one tick of the world: of its speeds the latest count, but neither
    what happened nor that it broadcast may be lost.
    """
    older, newer = sorted((one, other), key=lambda command: command.tick)
    return msgspec.structs.replace(newer, notes=[*older.notes, *newer.notes], sent=older.sent or newer.sent)
