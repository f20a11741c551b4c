"""Which records of others a robot relays: those that a robot near it may not hear itself.

A robot in range speaks for itself, so most records need no relay. One that somebody near may not hear is relayed now
and then, and at once if it says something new about joint plans; not if two others have just relayed it, but never
held back twice running (after Trickle: Levis, Patel, Culler and Shenker 2004, RFC 6206). It takes two others, so that
one robot that lies silences nobody.
"""

from collections.abc import Mapping
from math import hypot
from typing import Final, NamedTuple

import numpy as np

from swarm.messages.traffic import Record, Relayed
from swarm.traffic.peers.radio_range import find_hidden_robots
from swarm.traffic.settings import TrafficConstants

ENOUGH: Final = 2  # others that have relayed a record, after which I need not
WELCOME: Final = 12  # ticks after meeting a robot in which it is told of all silent ones
NEVER: Final = -(10**9)  # tick


class KnownRecord(NamedTuple):
    """The newest record of a robot."""

    record: Record
    hops: int  # 1: heard from the robot itself


class RelayTurn(NamedTuple):
    """My last turn to relay a robot's record."""

    tick: int
    record: Record | None  # None: there was no turn yet
    held_back: bool  # I did not relay it, since others had


NO_TURN: Final = RelayTurn(NEVER, None, held_back=False)


class RelayChooser:
    """Chooses what one robot relays."""

    def __init__(self, settings: TrafficConstants) -> None:
        self._settings = settings
        self._turns: dict[str, RelayTurn] = {}
        self._echoes: dict[str, dict[str, int]] = {}  # by robot and relayer: stamp of the record relayed last
        self._met = NEVER

    def note_new_robot(self, tick: int) -> None:
        """Record that a robot is heard that was not heard before, or not for long."""
        self._met = tick

    def hear(self, relayer: str, record: Record) -> None:
        """Record that another robot has relayed a record."""
        echoes = self._echoes.get(record.robot)
        if echoes is None:
            echoes = self._echoes[record.robot] = {}
        echoes[relayer] = record.stamp

    def choose(
        self, tick: int, x: float, y: float, known: Mapping[str, KnownRecord], *, listens: bool
    ) -> tuple[Relayed, ...]:
        """Return the records to relay from a place [m], nearest robots first; ``listens``: a robot has just started."""
        settings = self._settings
        welcome = listens or tick - self._met <= WELCOME
        fresh = [robot for robot, one in known.items() if one.record.stamp >= tick - settings.fresh]
        hidden = self._hidden(x, y, [known[robot].record for robot in fresh])
        chosen: list[tuple[float, str, KnownRecord]] = []
        live = set(fresh)
        for robot, one in known.items():
            if one.hops > settings.hops or (robot in live and robot not in hidden):
                continue
            if self._is_due(tick, one.record, silent=robot not in live, welcome=welcome):
                chosen.append((hypot(one.record.x - x, one.record.y - y), robot, one))
        nearest = sorted(chosen)[: settings.relayed]
        for _, robot, one in nearest:
            self._turns[robot] = RelayTurn(tick, one.record, held_back=False)
        return tuple([Relayed(one.hops, one.record) for _, _, one in nearest])

    def _hidden(self, x: float, y: float, records: list[Record]) -> set[str]:
        """Return the robots that another one in range of (x, y) [m] may not hear: too far off, or behind a wall."""
        settings = self._settings
        if len(records) < 2:
            return set()
        places = np.array([(record.x, record.y) for record in records])
        heard = -1.0 if settings.in_sight else settings.radio_range - 1.0  # m; if walls stop the radio: perhaps nobody
        found = find_hidden_robots(places, x, y, settings.radio_range, heard).tolist()
        return {record.robot for record, hidden in zip(records, found, strict=True) if hidden}

    def _is_due(self, tick: int, record: Record, *, silent: bool, welcome: bool) -> bool:
        """Return True if a record is to be relayed now, and others have not just done it."""
        settings = self._settings
        last = self._turns.get(record.robot, NO_TURN)
        if silent:
            pause = settings.relay_silent if record.stamp >= tick - settings.keep else 2 * settings.relay_silent
            return welcome or (tick - last.tick >= pause and not self._is_held_back(tick, record, record.stamp))
        if last.record is None or _urgent_news(record, sight=settings.in_sight) != _urgent_news(
            last.record, sight=settings.in_sight
        ):
            return not self._is_held_back(tick, record, record.stamp)
        if record.stamp - last.record.stamp < settings.relay:
            return False
        return not self._is_held_back(tick, record, record.stamp - settings.every)

    def _is_held_back(self, tick: int, record: Record, oldest: int) -> bool:
        """Return True if enough others have relayed a record of the tick ``oldest`` or later; not twice running."""
        last = self._turns.get(record.robot, NO_TURN)
        echoes = self._echoes.get(record.robot, {})
        if last.held_back or [stamp >= oldest for stamp in echoes.values()].count(True) < ENOUGH:
            return False
        self._turns[record.robot] = RelayTurn(tick, record, held_back=True)
        return True


def _urgent_news(record: Record, *, sight: bool) -> tuple[object, ...]:
    """Return what robots that do not hear each other must soon know of each other."""
    about_plans = (record.epoch, record.frozen, record.need, record.collect, record.plan, record.refusal)
    return (*about_plans, record.held, record.claims, record.acks) if sight else about_plans
