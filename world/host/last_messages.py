"""The last messages of the robots in one run: commands, states and plans; and the robots that did not answer."""

from collections.abc import Sequence
from typing import Final

import msgspec

from swarm.messages import BodyReport, Command, Plan, State

SILENT: Final = 5.0  # s that lockstep waits for a robot that is there and does not answer
AGAIN: Final = 1.0  # s after which it is sent its sense again

Sent = tuple[str, int]  # a robot and the tick of its broadcast, which is that of the sense it was sent after


class SenseTimes:
    """When each robot was sent the sense of this tick [s, on the caller's clock]."""

    def __init__(self, robots: Sequence[str], now: float) -> None:
        self._first = dict.fromkeys(robots, now)
        self._last = dict.fromkeys(robots, now)

    def robots_to_send_again(self, lacking: Sequence[str], now: float) -> list[str]:
        """Return the robots of ``lacking`` that are to be sent the sense now: never sent before, or long ago."""
        due = [name for name in lacking if now - self._last.get(name, float("-inf")) >= AGAIN]
        for name in due:
            self._first.setdefault(name, now)
            self._last[name] = now
        return due

    def forget(self, name: str) -> None:
        """Count a robot as never sent: it has just come, or come back."""
        self._first.pop(name, None)
        self._last.pop(name, None)

    def overdue(self, lacking: Sequence[str], now: float) -> list[str]:
        """Return the robots of ``lacking`` that have been silent for longer than the world waits."""
        return [name for name in lacking if now - self._first.get(name, now) > SILENT]


class LastMessages:
    """The last messages of the robots in one run. A restart begins with a new object."""

    def __init__(self) -> None:
        self.commands: dict[str, Command] = {}  # for this tick, or late ones for an earlier tick
        self.sent: list[Sent] = []  # broadcasts that were sent with them
        self.states: dict[str, State] = {}
        self.plans: dict[str, Plan] = {}
        self.deaf: set[str] = set()  # present robots that did not answer in time
        self.bodies: dict[str, BodyReport] = {}  # the newest report of each body that is outside
        self.bodiless: set[str] = set()  # robots whose body did not report in time
        self._answered: dict[str, int] = {}  # the newest tick that each robot has answered
        self.late = 0  # commands that came after their tick
        self.in_time = 0  # robots that have answered the present tick

    def take(self, name: str, message: Command | State | Plan | BodyReport, run: int, tick: int) -> bool:
        """Take in a message; ignore one of another run or of a future tick, and an answer that was given before.

        Return False if it was ignored.
        """
        if message.run != run or message.tick > tick:
            return False
        match message:
            case Command():
                self.deaf.discard(name)
                if message.tick <= self._answered.get(name, -1):
                    return False
                self._answered[name] = message.tick
                self.late += message.tick < tick
                self.in_time += message.tick == tick
                if message.sent:
                    self.sent.append((name, message.tick))
                known = self.commands.get(name)
                self.commands[name] = message if known is None else merge_commands(message, known)
            case BodyReport():
                known_body = self.bodies.get(name)
                if known_body is not None and message.tick <= known_body.tick:
                    return False
                self.bodiless.discard(name)
                self.bodies[name] = message
            case State():
                self.states[name] = message
            case Plan():
                self.plans[name] = message
        return True

    def forget_commands(self) -> None:
        """Forget the commands of a tick that is over."""
        self.commands, self.sent, self.in_time = {}, [], 0

    def robots_awaited(self, present: Sequence[str]) -> list[str]:
        """Return the present robots that are expected to answer."""
        return [name for name in present if name not in self.deaf]

    def robots_without_answer(self, present: Sequence[str], tick: int) -> list[str]:
        """Return the robots that still have to answer this tick."""
        return [name for name in self.robots_awaited(present) if self._answered.get(name) != tick]

    def lacking_bodies(self, outside: Sequence[str], present: Sequence[str], tick: int) -> list[str]:
        """Return the present robots whose body is outside and still has to report that it carried out this tick."""
        awaited = [name for name in outside if name in present and name not in self.bodiless and name not in self.deaf]
        return [name for name in awaited if name not in self.bodies or self.bodies[name].tick != tick]


def merge_commands(one: Command, other: Command) -> Command:
    """Return the later of two commands of one robot, or the second of one tick, with the notes of both.

    A robot that was late answers twice within one tick of the world. Only its latest speeds count, but no note is lost,
    nor that it broadcast.
    """
    older, newer = sorted((one, other), key=lambda command: command.tick)
    return msgspec.structs.replace(newer, notes=[*older.notes, *newer.notes], sent=older.sent or newer.sent)
