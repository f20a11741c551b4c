"""The cells that robots take in a recorded run, tick by tick: the laws about taking cells judge them."""

from collections.abc import Iterator
from typing import Final

from swarm.traffic.lattice.cell_map import OUTSIDE
from world.faults import SILENT, Health
from world.storm.history.history import History, Moment
from world.storm.history.seen import pushes, was_pushed

AWAY: Final = 20  # ticks without a step after which a robot starts with new reservations


def growth(history: History) -> Iterator[tuple[Moment, dict[str, frozenset[int]]]]:
    """Return each moment with the cells that each robot holds and did not hold before.

    A robot is left out if it just began or was away, drives unconstrained because nobody is in range, or was pushed.
    """
    pushed = pushes(history)
    before: dict[str, tuple[int, frozenset[int], bool]] = {}  # tick, held, unconstrained
    said: dict[str, list[int]] = {}  # what each said last that it holds
    for moment in history.moments:
        grown: dict[str, frozenset[int]] = {}
        for name, command in moment.commands.items():
            was = before.get(name)
            if was is not None and command.held == said[name]:
                before[name] = moment.tick, was[1], command.unconstrained
                continue
            said[name], held = command.held, frozenset(command.held) - {OUTSIDE}
            before[name] = moment.tick, held, command.unconstrained
            if was is None or begins(history, moment, name, was[0]) or command.unconstrained or was[2]:
                continue
            if held - was[1] and not was_pushed(pushed, history.robots.index(name), moment.tick):
                grown[name] = held - was[1]
        yield moment, grown


def begins(history: History, moment: Moment, name: str, last: int) -> bool:
    """Return True if a robot whose last step was at tick ``last`` starts again: it was away, or has a new process."""
    return moment.tick - last > AWAY or _health_before(history, moment, name) in SILENT


def has_new_process(history: History, moment: Moment, name: str) -> bool:
    """Return True in the first tick of a robot's new process."""
    return name in moment.commands and _health_before(history, moment, name) is Health.AWAY


def _health_before(history: History, moment: Moment, name: str) -> Health | None:
    index = moment.tick - history.moments[0].tick
    return history.moments[index - 1].health.get(name) if index > 0 else None
