"""Where two runs part: the first tick, the robot and the field, and what is behind it."""

from collections.abc import Iterable, Iterator, Mapping
from math import degrees
from typing import Any, Final, NamedTuple

import msgspec

from swarm.blackbox.explain.run_history import TakenAnswer
from swarm.blackbox.explain.tape_moment import answers_of
from swarm.blackbox.replay.answer_values import ReplayedTick
from swarm.blackbox.replay.replay import Replay
from swarm.errors import ConfigError
from swarm.messages import Command, Sense
from swarm.tape.reader import TapeFile

LEFT_OUT: Final = frozenset({"world", "took"})  # each world has another identity; what a robot took is compared itself
MOST_NAMED: Final = 5  # settings and rules
SHORTENED: Final = 60  # characters of a value
NOTHING: Final = "nothing"
AS_COMPUTED: Final = "as this code gives it"
ANOTHER: Final = "another one"


class Values(NamedTuple):
    """A field of two runs that differs."""

    field: str
    one: object
    other: object

    @property
    def text(self) -> str:
        """The field with both values."""
        return f"{self.field} {_shorten_value(self.one)} | {_shorten_value(self.other)}"


class Parting(NamedTuple):
    """The first difference of two runs."""

    tick: int
    time: float  # s
    robot: str
    values: Values
    cause: str
    timing: bool = False  # processes or the network were slower or faster in one of them


def differences_of_starts(one: TapeFile, other: TapeFile) -> list[Values]:
    """Return what differs between two runs before they begin: seed, pace, settings, map, rules; the code last.

    Raises:
        ConfigError: they are not runs of the same robots.
    """
    row, names = (one.head, other.head), []
    for head in row:
        starts = head.map.scenario.starts
        assert isinstance(starts, dict)
        names.append(list(starts))
    if names[0] != names[1]:
        text = f"expected two runs of the same robots, got {', '.join(names[0])} and {', '.join(names[1])}"
        raise ConfigError(f"diff: {text}; give two runs of one scenario with as many robots")
    parts = [{"seed": head.seed, "pace": head.pace, "starts": head.map.scenario.starts} for head in row]
    found = [*differences(parts[0], parts[1])]
    found += differences(row[0].map.scenario.settings, row[1].map.scenario.settings)
    found += differences(row[0].map.packed, row[1].map.packed, "map")
    found += differences(row[0].map.scenario.profile, row[1].map.scenario.profile, "rules")
    own = [{"rules": head.map.scenario.profiles or {}, "kinds": head.map.scenario.kinds or {}} for head in row]
    found += differences(own[0], own[1])
    return [*found, *differences({"code": row[0].code}, {"code": row[1].code})]


def find_parting(one: TapeFile, other: TapeFile) -> Parting | None:
    """Return where two runs part, by the order in which their worlds lived the ticks; None: one is the other's begin.

    Raises:
        ConfigError: a row is none.
    """
    known, runs = differences_of_starts(one, other), (Replay(one), Replay(other))
    while True:
        ticks = [run.step() for run in runs]
        if ticks[0] is None or ticks[1] is None:
            return None
        found = _of_a_tick(runs, (ticks[0], ticks[1]), known)
        if found is not None:
            return found


def find_parting_by_rules(one: TapeFile, other: TapeFile) -> Parting | None:
    """Return the first answer that the other run's rules and settings would have changed in the first run.

    None: they are the same, or would have changed nothing. So runs are compared that part by their timing.

    Raises:
        ConfigError: a row is none.
    """
    changed, scenario = TapeFile(one.path), other.head.map.scenario
    mine = msgspec.structs.replace(scenario, starts=one.head.map.scenario.starts)
    changed.head = msgspec.structs.replace(one.head, map=msgspec.structs.replace(one.head.map, scenario=mine))
    return find_parting(one, changed) if mine != one.head.map.scenario else None


def _of_a_tick(
    runs: tuple[Replay, Replay], ticks: tuple[ReplayedTick, ReplayedTick], known: list[Values]
) -> Parting | None:
    """Return the first difference of a tick: what robots sense, then who answers with what heard, then the answers."""
    now, dt = runs[0].world.tick - 1, runs[0].world.dt

    def at(robot: str, values: Values, cause: str, *, timing: bool = False) -> Parting:
        return Parting(now, now * dt, robot, values, cause, timing)

    for values in differences(
        {"run": runs[0].world.run, "tick": now}, {"run": runs[1].world.run, "tick": runs[1].world.tick - 1}
    ):
        return at("the world", values, "one was started again, or killed, and the other was not")
    for name in runs[0].world.robots:
        for values in differences(ticks[0].senses.get(name), ticks[1].senses.get(name), "sense"):
            return at(name, values, _of_a_sense(values.field, known))
    answers = [_answers(run, tick) for run, tick in zip(runs, ticks, strict=True)]
    for name in runs[0].world.robots:
        mine, theirs = (row.get(name, []) for row in answers)
        when = [[answer.command.tick for answer in row] for row in (mine, theirs)]
        for values in differences(when[0], when[1], "answers"):
            return at(
                name, values, "its process, the machine or the network was slower or faster, or was ended", timing=True
            )
        for first, second in zip(mine, theirs, strict=True):
            for values in differences(first.heard, second.heard, "heard"):
                return at(
                    name, values, "the network was slower or faster: it stepped with other broadcasts", timing=True
                )
        for first, second in zip(mine, theirs, strict=True):
            for values in differences(first.command, second.command, "command"):
                return at(name, values, _of_an_answer(runs, name, first.command, second.command, known))
            for values in differences(first.broadcast, second.broadcast, "broadcast"):
                return at(name, values, f"it was given the same until then: {_code(known)}")
    told = [run.difference for run in runs]
    found = told[0] or told[1]
    if found is None:
        return None
    both = told[0] is not None and told[1] is not None
    which = "both runs were" if both else f"the {'first' if told[0] is not None else 'second'} run was"
    values = Values("answer", *(AS_COMPUTED if one is None else ANOTHER for one in told))
    cause = f"{which} made by other code, {runs[told[0] is None].head.code}: {found.text}"
    return at(found.robot, values, f"{cause}; compare them with that code" if both else cause)


def _answers(run: Replay, tick: ReplayedTick) -> Mapping[str, list[TakenAnswer]]:
    found: dict[str, list[TakenAnswer]] = {}
    for answer in answers_of(run, tick):
        found.setdefault(answer.robot, []).append(answer)
    return found


def _of_a_sense(field: str, known: list[Values]) -> str:
    """Return what is behind another sense."""
    if any(part in field for part in ("assigned", "edits", "stopped")):
        return "somebody asked one of the runs for something"
    named = [values.text for values in known if values.field != "code"][:MOST_NAMED]
    return f"before they began: {'; '.join(named)}" if named else f"all was the same until then: {_code(known)}"


def _of_an_answer(runs: tuple[Replay, Replay], robot: str, one: Command, other: Command, known: list[Values]) -> str:
    """Return what is behind another answer of a robot that was given the same."""
    same = "it was given the same until then"
    sense = runs[0].steps[robot].sense if robot in runs[0].steps else None
    if sense is None or (one.heading, one.scale) != (other.heading, other.scale):
        return f"{same}, and its tables were given another aim: {_code(known)}"
    return f"{same}: {_of_the_tables(runs, robot, sense, one) or _code(known)}"


def _of_the_tables(runs: tuple[Replay, Replay], robot: str, sense: Sense, command: Command) -> str:
    """Return which rules make the tables say another thing for the same inputs; empty: they say the same."""
    rosters, number = [run.world.roster for run in runs], runs[0].world.number(robot)
    unit = [roster.bodies[number].distance_scale * command.scale for roster in rosters]
    if unit[0] != unit[1]:
        return ""
    inputs = sense.left / unit[0], sense.front / unit[0], sense.right / unit[0], -degrees(command.heading)
    said = [roster.controller(number).explain(*inputs) for roster in rosters]
    if (said[0].left_v, said[0].right_v) == (said[1].left_v, said[1].right_v):
        return ""
    fired = [{(rule.behaviour, rule.rule): rule for rule in one.rules} for one in said]
    rules = []
    for behaviour, number in dict.fromkeys((*fired[0], *fired[1])):
        pair = [one.get((behaviour, number)) for one in fired]
        if pair[0] != pair[1]:
            strengths = " | ".join(f"{rule.strength:.2f}" if rule is not None else "0.00" for rule in pair)
            texts = " | ".join(rule.text if rule is not None else NOTHING for rule in pair)
            rules.append(f"{behaviour} rule {number} (strength {strengths}): {texts}")
    speeds = " | ".join(f"{one.left_v:.3f}, {one.right_v:.3f}" for one in said)
    given = "left {:.2f} m, front {:.2f} m, right {:.2f} m, heading {:.1f} degrees".format(*inputs)
    because = (
        f", because of {'; '.join(rules[:MOST_NAMED])}"
        if rules
        else ", with the same rules: variables or outputs differ"
    )
    return f"the tables say {speeds} m/s for the same {given}{because}"


def _code(known: list[Values]) -> str:
    """Return what can be behind another answer to the same: settings, or else the code."""
    named = [values.text for values in known if values.field not in {"seed", "pace"}]
    return f"its settings or its code differ: {'; '.join(named[:MOST_NAMED])}" if named else "no reason is on the tapes"


def differences(one: object, other: object, at: str = "") -> Iterator[Values]:
    """Yield the fields at which two values differ, each by its path.

    >>> [values.text for values in differences({"seed": 1, "pace": [2, 3]}, {"seed": 1, "pace": [2, 4]})]
    ['pace[1] 3 | 4']
    """
    if one == other:
        return
    parts = _parts(one), _parts(other)
    if type(one) is not type(other) or parts[0] is None or parts[1] is None:
        yield Values(at, one, other)
        return
    if isinstance(one, list | tuple) and len(parts[0]) != len(parts[1]):
        yield Values(at, one, other)
        return
    for name in dict.fromkeys((*parts[0], *parts[1])):
        if name not in LEFT_OUT:
            path = f"{at}[{name}]" if isinstance(name, int) else f"{at}.{name}".lstrip(".")
            yield from differences(parts[0].get(name), parts[1].get(name), path)


def _parts(value: object) -> Mapping[Any, object] | None:
    """Return the parts of a value by name or place; None: it is one."""
    if isinstance(value, msgspec.Struct):
        return {name: getattr(value, name) for name in value.__struct_fields__}
    if isinstance(value, dict):
        return value
    if isinstance(value, str) and value.count("\n") > 1:  # a table of rules
        return dict(enumerate(value.splitlines()))
    if isinstance(value, list | tuple):
        names: Iterable[Any] = getattr(value, "_fields", range(len(value)))
        return dict(zip(names, value, strict=True))
    return None


def _shorten_value(value: object) -> str:
    text = str(value) if value is not None else NOTHING
    return text if len(text) <= SHORTENED else f"{text[:SHORTENED]}..."
