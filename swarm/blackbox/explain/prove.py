"""The proof of an explanation: what it names is changed, and the run goes on in memory."""

from collections.abc import Callable, Iterator
from typing import Any, Final, NamedTuple

from swarm.blackbox.explain.clauses import Cause, Clause
from swarm.blackbox.explain.continuation import Onward
from swarm.blackbox.explain.moment import Instant
from swarm.errors import ConfigError
from swarm.robot.brain import Robot

HORIZON: Final = 20.0  # s for which the run goes on
MOST: Final = 3  # changes that are tried
MOVES: Final = frozenset({Clause.DRIVES, Clause.REACHES})  # the robot is stopped: does the wait last longer then?


class Change(NamedTuple):
    """One change of what a chain of causes names."""

    text: str  # with ...
    how: dict[str, Any]  # arguments of ``Onward``


class Proof(NamedTuple):
    """What a change makes of a wait."""

    text: str
    change: str  # with ..., as in the text
    before: float | None  # s from the moment on that the robot waits as it is; None: longer than the horizon
    after: float | None  # s that it waits with the change

    @property
    def changes_wait(self) -> bool:
        """Return True if the wait is another one."""
        return self.before != self.after


def list_changes(robot: str, causes: list[Cause], moment: Instant) -> list[Change]:
    """Return what can be changed of what a chain names, other than the robot that was asked about; the root first."""
    found = dict.fromkeys(change for cause in reversed(causes) for change in _of(cause, robot, moment))
    return [Change(text, how) for text, how in ((text, dict(parts)) for text, parts in found)][:MOST]


def _of(cause: Cause, asked: str, moment: Instant) -> Iterator[tuple[str, tuple[tuple[str, Any], ...]]]:
    name = cause.robot
    match cause.clause:
        case Clause.LOST | Clause.FAR if cause.other is not None:
            at = moment.past.clock(moment.past.said[name][-1].tick)
            yield f"{name}'s broadcast of {at} delivered to {cause.other}", (("told", ((cause.other, name),)),)
        case Clause.GONE | Clause.LATE if name in moment.robots:
            yield f"{name} answering", (("awake", (name,)),)
        case Clause.ORDER:
            yield f"{name} told to go on", (("goes_on", (name,)),)
        case clause if clause in MOVES and name != asked:
            yield f"{name} stopped", (("stopped", (name,)),)


def prove(robot: str, causes: list[Cause], moment: Instant, again: Callable[[], Instant]) -> list[Proof]:
    """Return what each change of what an explanation names makes of the wait.

    ``again`` returns the same moment anew; ``moment`` itself goes on.

    Nothing is tried if the robot does not wait, or nothing that can be changed is named.

    Raises:
        ConfigError: what robots of other code, or bodies outside, would have done is not known.
    """
    unknown = [name for name in moment.world.robots if name not in moment.robots]
    unknown += moment.outside
    if unknown:
        text = f"expected only robots whose code and body are here, got {', '.join(unknown)}"
        raise ConfigError(f"--prove: {text}; what they would have done is not known")
    waits = causes[0].clause is not Clause.DRIVES or len(causes) > 1
    tried = list_changes(robot, causes, moment) if waits else []
    if not tried:
        return []
    before = _wait(robot, moment, {})
    proofs = []
    for change in tried:
        after = _wait(robot, again(), change.how)
        proofs.append(Proof(f"With {change.text}, {_format_proof(robot, before, after)}", change.text, before, after))
    return proofs


def _wait(robot: str, moment: Instant, how: dict[str, Any]) -> float | None:
    """Return for how long [s] a robot gets no other cell and no other stop; None: longer than the horizon."""
    how = {name: dict(value) if name == "told" else value for name, value in how.items()}
    onward = Onward(moment, **how)
    begin, dt = _where(onward.robots[robot]), onward.world.dt
    for ticks in range(1, round(HORIZON / dt) + 1):
        onward.step()
        if _where(onward.robots[robot]) != begin:
            return ticks * dt
    return None


def _where(robot: Robot) -> tuple[int | None, int]:
    decided = robot.last_decision
    return decided.progress.head if decided is not None else None, robot.mission.target


def _format_proof(robot: str, before: float | None, after: float | None) -> str:
    if before == after:
        same = f"waits {before:.2f} s more" if before is not None else f"waits longer than {HORIZON:g} s"
        return f"nothing changes: {robot} {same}, as without it."
    if after is None:
        return f"{robot} waits longer than {HORIZON:g} s, instead of {before:.2f} s."
    if before is None:
        return f"{robot} waits {after:.2f} s more, instead of longer than {HORIZON:g} s."
    word = "longer" if after > before else "shorter"
    return f"{robot} waits {abs(after - before):.2f} s {word}: {after:.2f} s instead of {before:.2f} s."
