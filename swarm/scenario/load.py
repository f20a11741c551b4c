"""The loader of scenario files: it returns checked values, and says in one sentence what is wrong with a file."""

import re
from collections.abc import Hashable
from contextlib import suppress
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import pairwise
from math import inf
from pathlib import Path
from typing import Any, Final

import msgspec
import yaml

from swarm.errors import ConfigError, nearest
from swarm.fuzzy import Profile, load_profile
from swarm.geometry import distance
from swarm.maps.files import read_text, within
from swarm.maps.load import load_map
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.maps.text import from_text
from swarm.maps.wire import pack, unpack
from swarm.messages import PackedMap, ProfileOnWire, ScenarioOnWire
from swarm.messages.faults import explained, shown
from swarm.scenario.shipped import shipped
from swarm.settings import Section, Settings

SIZE_LIMIT: Final = 4_000_000  # bytes
EVENTS_LIMIT: Final = 60_000  # values, lists and ends of lists in YAML; a target is four; read in about a second
DEPTH_LIMIT: Final = 50  # lists in lists
LISTED_LIMIT: Final = 5000  # own targets of all robots


@dataclass(frozen=True, eq=False)
class Scenario:
    """Everything that a run needs to know, read from a file or received over the wire."""

    settings: Settings
    map: OccupancyMap
    profile: Profile

    def stops(self, robot: int, start: Point) -> tuple[Point, ...]:
        """Return the stops [m] of robot number ``robot`` in order: its targets, then home if the mission returns."""
        settings = self.settings
        own = settings.own_targets[robot : robot + 1]  # none for a robot whose place was opened later
        targets = own[0] if own else settings.targets
        if settings.start.circle is not None:
            x, y, _ = settings.start.circle
            targets = [(2 * x - start[0], 2 * y - start[1])]
        return (*targets, *((start[:2],) if settings.return_home else ()))

    def limit(self, asked: float | None) -> float:
        """Return the simulated time [s] after which a run ends: what is asked for, else the scenario's.

        A fleet that stays has none of its own.
        """
        return asked if asked is not None else inf if self.settings.serve else self.settings.limit

    def to_wire(self) -> tuple[ScenarioOnWire, PackedMap]:
        """Return settings and profile, and the packed map, as they cross the wire."""
        profile = msgspec.convert(self.profile.to_builtins(), ProfileOnWire)
        return ScenarioOnWire(settings=self.settings, profile=profile), pack(self.map)

    @classmethod
    def from_wire(cls, scenario: ScenarioOnWire, packed: PackedMap) -> "Scenario":
        """Return the scenario that came over the wire.

        Raises:
            SwarmError: the settings contradict each other, or the profile or the map is not valid.
        """
        settings = checked(msgspec.to_builtins(scenario.settings), "welcome")
        return cls(settings, unpack(packed), Profile.from_builtins(msgspec.to_builtins(scenario.profile)))


def load(path: Path, *, serve: bool = False) -> Scenario:
    """Load a scenario file with the map and the fuzzy profile it names; ``serve`` sets its field of that name.

    Raises:
        ConfigError: the file is wrong; the text says where, what and what to do.
    """
    raw = _read(path)
    settings = checked(raw | {"serve": True} if serve else raw, str(path))
    where, base = settings.map, path.parent
    if (where.text is None) == (where.file is None):
        raise ConfigError(f"{path}: map: expected either `text` or `file`; draw the map in the file or name one")
    if where.text is not None:
        try:
            floor = from_text(where.text, where.cell)
        except ConfigError as fault:
            raise ConfigError(f"{path}: map.text: {fault}") from None
    else:
        floor = load_map(within(base, str(where.file), f"{path}: map.file"), cell=where.cell)
    return Scenario(settings, floor, load_profile(settings.controller, base=base))


def checked(raw: object, where: str) -> Settings:
    """Convert plain values to ``Settings``.

    Raises:
        ConfigError: a field is unknown, missing, of a wrong type or out of its bounds.
    """
    try:
        settings = msgspec.convert(raw, Settings)
    except msgspec.ValidationError as fault:
        raise ConfigError(f"{where}: {_explain(str(fault), raw)}") from None
    start = settings.start
    may_lack = settings.serve or start.circle is not None  # who serves waits for orders from the start
    if start.circle is not None and (settings.targets or settings.own_targets):
        raise ConfigError(f"{where}: start.circle: expected no targets, they are the points opposite; leave them out")
    may_lack |= _only_pool(settings)
    given = bool(settings.targets) + bool(settings.own_targets)
    if given > 1 or not (given or may_lack):
        raise ConfigError(f"{where}: expected either `targets` (for all) or `own_targets` (a list a robot); give one")
    if (listed := sum(map(len, settings.own_targets))) > LISTED_LIMIT:
        raise ConfigError(
            f"{where}: own_targets: expected at most {LISTED_LIMIT} targets of all robots together, got {listed}; "
            "list fewer"
        )
    for number, mover in enumerate(settings.movers):
        if (mover.radius is None) == (mover.size is None) or (mover.size is not None and min(mover.size) <= 0):
            raise ConfigError(f"{where}: movers[{number}]: expected either `radius` or `size`, above 0 m; give one")
        if any(a == b for a, b in pairwise(mover.waypoints)):
            raise ConfigError(f"{where}: movers[{number}].waypoints: expected no point twice in a row; leave one out")
    if not settings.map.known and settings.radio.line_of_sight:
        raise ConfigError(
            f"{where}: radio.line_of_sight: expected false where `map.known` is false, got true: a robot that has "
            "not learned a corner does not know that nobody hears it behind the corner; change one of them"
        )
    for number, asked in enumerate(settings.orders):
        if (asked.targets is None) == (asked.do is None):
            raise ConfigError(f"{where}: orders[{number}]: expected either `targets` or `do`; give one")
    if sum(kind is not None for kind in (start.area, start.poses, start.circle)) != 1:
        raise ConfigError(f"{where}: start: expected either `area` or `poses` or `circle`; give one of them")
    if settings.patrol:
        _check_patrol(settings, where)
        settings = msgspec.structs.replace(settings, return_home=False)
    return settings


def _only_pool(settings: Settings) -> bool:
    """Return True if all targets are those of the pool; a robot is then at its only stop, home, from the beginning."""
    return bool(settings.pool) and settings.return_home and not (settings.targets or settings.own_targets)


def _check_patrol(settings: Settings, where: str) -> None:
    for targets in settings.own_targets or [settings.targets]:
        if not any(distance(one, other) > 2 * settings.reach for one, other in pairwise(targets)):
            raise ConfigError(
                f"{where}: patrol: expected at least two targets a robot, more than {2 * settings.reach:g} m apart "
                f"(twice `reach`), got {targets}; add one, or leave out `patrol`"
            )


class _Loader(yaml.CSafeLoader):
    """A YAML loader that refuses a key given twice; the plain loader silently keeps the last."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        seen = set()
        for key, _ in node.value if isinstance(node, yaml.MappingNode) else ():
            if not isinstance(key, yaml.ScalarNode):
                raise yaml.constructor.ConstructorError(None, None, "a key that is not a text", key.start_mark)
            if key.value in seen:
                raise yaml.constructor.ConstructorError(None, None, f"key {key.value!r} is given twice", key.start_mark)
            seen.add(key.value)
        return super().construct_mapping(node, deep)


def _meant(path: Path) -> str:
    """Return the scenario that was perhaps meant: one that is shipped, or a file beside ``path`` with a ``map``."""
    known = {name: name for name in shipped()}
    for file in path.parent.glob("*.yaml"):
        with suppress(ConfigError):
            if any(line.startswith("map:") for line in read_text(file, SIZE_LIMIT).splitlines()):
                known[file.stem] = file.name
    close = get_close_matches(path.stem, known, n=1)
    return f"did you mean {known[close[0]]!r}?" if close else "check the path; `swarm run` lists those it comes with"


def _read(path: Path) -> dict[str, Any]:
    if not path.exists():
        raise ConfigError(f"{path}: expected a scenario file, found none; {_meant(path)}")
    text = read_text(path, SIZE_LIMIT)
    try:
        depth = 0
        for number, event in enumerate(yaml.parse(text, Loader=_Loader)):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if number > EVENTS_LIMIT or depth > DEPTH_LIMIT:
                raise ConfigError(
                    f"{path}: expected at most {EVENTS_LIMIT} values, {DEPTH_LIMIT} deep, got more; put a large map "
                    "into a file of its own, list fewer targets"
                )
        raw = yaml.load(text, Loader=_Loader)
    except (yaml.YAMLError, RecursionError, ValueError) as fault:
        mark = getattr(fault, "problem_mark", None)
        at = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        said = getattr(fault, "problem", None) or str(fault).split("\n")[0]
        raise ConfigError(f"{path}: {at}expected YAML, got {said}; correct that line") from None
    if not isinstance(raw, dict):
        raise ConfigError(f"{path}: expected `name:`, `map:`, `start:`, `targets:`, got {shown(raw)}")
    if odd := [key for key in raw if not isinstance(key, str)]:
        raise ConfigError(f"{path}: expected names of fields, got {shown(odd[0])}; see scenarios/paper.yaml")
    return raw


def _explain(fault: str, raw: object) -> str:
    """Return msgspec's error in this project's form: where, what was expected, what came, what to do."""
    where, names, said, value = wrong = explained(fault, raw)
    section, unit = _described(names)
    if match := re.match(r"Object contains unknown field `(.*)`", said):
        prefix = f"{where}: " if where else ""
        return f"{prefix}unknown field {match[1]!r}; {nearest(match[1], section.__struct_fields__)}"
    if match := re.match(r"Object missing required field `(.*)`", said):
        return f"{where + ': ' if where else ''}field {match[1]!r} is missing; add it"
    hint = f" ({unit})" if unit else ""
    if isinstance(value, str) and ("float" in said or "int" in said):
        hint += "; write the bare number, without a unit"
    return f"{wrong}{hint}"


def _described(names: list[str]) -> tuple[type[Section], str]:
    """Return the section that a path of names leads to, and the last field's description."""
    section: type[Section] = Settings
    text = ""
    for name in names:
        info = {f.name: f.type for f in msgspec.inspect.type_info(section).fields}.get(name)  # type: ignore[attr-defined]
        while info is not None and not isinstance(info, msgspec.inspect.StructType):
            if isinstance(info, msgspec.inspect.Metadata):
                text = (info.extra_json_schema or {}).get("description", text)
                info = info.type
            else:
                break
        if isinstance(info, msgspec.inspect.StructType):
            section = info.cls  # type: ignore[assignment]
    return section, text
