"""The loader of scenario files: it returns checked values, and says in one sentence what is wrong with a file."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from itertools import pairwise
from math import inf
from pathlib import Path
from typing import Any, Final, TypeVar

import msgspec

from swarm.errors import ConfigError
from swarm.fuzzy import Profile, load_profile
from swarm.geometry import distance
from swarm.kinds import (
    PLAIN,
    check_mix,
    complete_kinds,
    kind_of,
    merge_own_sensors,
    own_controllers,
    settings_of,
    targets_of,
    with_mix,
)
from swarm.maps.files import path_within, read_text, yaml_values
from swarm.maps.load import load_map
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.maps.text import from_text
from swarm.maps.wire import pack, unpack
from swarm.messages import PackedMap, ProfileOnWire, ScenarioOnWire
from swarm.messages.faults import in_words, quote_value
from swarm.scenario.shipped_scenarios import shipped_scenarios
from swarm.settings import HowMany, KindSettings, Settings

S = TypeVar("S", bound=msgspec.Struct)
SIZE_LIMIT: Final = 4_000_000  # bytes
LISTED_LIMIT: Final = 5000  # own targets of all robots


@dataclass(frozen=True, eq=False)
class Scenario:
    """Everything that a run needs to know, read from a file or received over the wire."""

    settings: Settings
    map: OccupancyMap
    profile: Profile
    profiles: Mapping[str, Profile] = field(default_factory=dict)  # those that kinds have of their own

    def of_kind(self, kind: str) -> "Scenario":
        """Return the scenario as it is for robots of a kind: its settings and its profile.

        Raises:
            ConfigError: there is no such kind.
        """
        if kind == PLAIN:
            return self
        return replace(self, settings=settings_of(self.settings, kind), profile=self.profiles.get(kind, self.profile))

    def with_settings(self, settings: Settings) -> "Scenario":
        """Return the scenario with other settings."""
        return replace(self, settings=settings)

    def of_robot(self, number: int) -> "Scenario":
        """Return the scenario as it is for a robot of the mix."""
        return self.of_kind(kind_of(self.settings, number))

    def with_robots(self, asked: int | Mapping[str, int] | None) -> tuple["Scenario", int]:
        """Return the scenario with so many robots, or so many of each kind, and their number; None: as it says.

        Raises:
            ConfigError: what is asked for does not fit the kinds.
        """
        settings = self.settings
        if isinstance(asked, int) and not settings.kinds:
            return self, asked
        own = self if asked is None else self.with_settings(with_mix(settings, asked))
        return own, own.settings.count

    def stops(self, robot: int, start: Point) -> tuple[Point, ...]:
        """Return the stops [m] of robot number ``robot`` in order: its targets, then home if the mission returns."""
        settings = self.settings
        targets = targets_of(settings, robot)
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
        profiles = {kind: _profile_on_wire(profile) for kind, profile in self.profiles.items()}
        own = profiles or msgspec.UNSET
        profile = _profile_on_wire(self.profile)
        return ScenarioOnWire(settings=self.settings, profile=profile, profiles=own), pack(self.map)

    @classmethod
    def from_wire(cls, scenario: ScenarioOnWire, packed: PackedMap) -> "Scenario":
        """Return the scenario that came over the wire.

        Raises:
            SwarmError: the settings contradict each other, or the profile or the map is not valid.
        """
        settings = check_values(msgspec.to_builtins(scenario.settings), "welcome")
        own = {} if scenario.profiles is msgspec.UNSET else scenario.profiles
        profiles = {kind: _profile_from_wire(profile) for kind, profile in own.items()}
        return cls(settings, unpack(packed), _profile_from_wire(scenario.profile), profiles)


def _profile_on_wire(profile: Profile) -> ProfileOnWire:
    return msgspec.convert(profile.to_builtins(), ProfileOnWire)


def _profile_from_wire(profile: ProfileOnWire) -> Profile:
    return Profile.from_builtins(msgspec.to_builtins(profile))


def load(path: Path, *, serve: bool = False) -> Scenario:
    """Load a scenario file with the map and the fuzzy profile it names; ``serve`` sets its field of that name.

    Raises:
        ConfigError: the file is wrong; the text says where, what and what to do.
    """
    raw = _read(path)
    settings = check_values(raw | {"serve": True} if serve else raw, str(path))
    where, base = settings.map, path.parent
    if (where.text is None) == (where.file is None):
        raise ConfigError(f"{path}: map: expected either `text` or `file`; draw the map in the file or name one")
    if where.text is not None:
        try:
            floor = from_text(where.text, where.cell)
        except ConfigError as fault:
            raise ConfigError(f"{path}: map.text: {fault}") from None
    else:
        floor = load_map(path_within(base, str(where.file), f"{path}: map.file"), cell=where.cell)
    own = load_own_profiles(settings, base)
    return Scenario(settings, floor, load_profile(settings.controller, base=base), own)


def load_own_profiles(settings: Settings, base: Path | None = None) -> dict[str, Profile]:
    """Load the fuzzy profiles that kinds have of their own, by kind; files are looked for in the folder ``base``.

    Raises:
        ConfigError: a profile is wrong, or there is none of that name.
    """
    return {kind: load_profile(name, base=base) for kind, name in own_controllers(settings).items()}


def check_values(raw: object, where: str) -> Settings:
    """Convert plain values to ``Settings``.

    Raises:
        ConfigError: a field is unknown, missing, of a wrong type or out of its bounds.
    """
    settings = _convert(raw, where)
    check_mix(settings, where)
    start = settings.start
    may_lack = settings.serve or start.circle is not None  # who serves waits for orders from the start
    may_lack |= bool(settings.kinds) and all(kind.targets is not None for kind in settings.kinds.values())
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
        if len(asked.headings) > (most := len(asked.targets or ())):
            raise ConfigError(
                f"{where}: orders[{number}].headings: expected at most {most}, one for each target, "
                f"got {len(asked.headings)}"
            )
    if sum(kind is not None for kind in (start.area, start.poses, start.circle)) != 1:
        raise ConfigError(f"{where}: start: expected either `area` or `poses` or `circle`; give one of them")
    _check_kinds(settings, where)
    if settings.patrol:
        _check_patrol(settings, where)
        settings = msgspec.structs.replace(settings, return_home=False)
    return settings


def _convert(raw: object, where: str) -> Settings:
    """Convert plain values; of a kind that is wrong its name is said, which msgspec leaves out."""
    raw = merge_own_sensors(raw)
    kinds = raw.get("kinds") if isinstance(raw, dict) else None
    for name, kind in kinds.items() if isinstance(kinds, dict) else ():
        _convert_to(KindSettings, kind, f"{where}: kinds.{name}")
    if isinstance(raw, dict) and not isinstance(count := raw.get("robots", 1), dict):
        _convert_to(RobotCount, {"robots": count}, where)
    return complete_kinds(_convert_to(Settings, raw, where))


class RobotCount(msgspec.Struct):
    """The field of a scenario that is a number, unless it is a mix: its faults are said without the other form."""

    robots: HowMany


def _convert_to(kind: type[S], raw: object, where: str) -> S:
    """Convert plain values to a type.

    Raises:
        ConfigError: they are not what it has.
    """
    try:
        return msgspec.convert(raw, kind)
    except msgspec.ValidationError as fault:
        raise ConfigError(f"{where}: {in_words(str(fault), raw, kind)}") from None


def _check_kinds(settings: Settings, where: str) -> None:
    """Check what kinds have of their own, apart from their fields' bounds."""
    for name, kind in settings.kinds.items():
        if kind.start is not None and (
            kind.start.circle is not None or (kind.start.area is None) == (kind.start.poses is None)
        ):
            raise ConfigError(f"{where}: kinds.{name}.start: expected either `area` or `poses`; give one of them")
        if kind.targets is not None and (settings.start.circle is not None or settings.own_targets):
            raise ConfigError(
                f"{where}: kinds.{name}.targets: expected none, each robot has its own by `own_targets` or "
                "`start.circle`; leave them out"
            )


def _only_pool(settings: Settings) -> bool:
    """Return True if all targets are those of the pool; a robot is then at its only stop, home, from the beginning."""
    return bool(settings.pool) and settings.return_home and not (settings.targets or settings.own_targets)


def _check_patrol(settings: Settings, where: str) -> None:
    own = [kind.targets for kind in settings.kinds.values() if kind.targets is not None]
    for targets in settings.own_targets or [*([settings.targets] if settings.targets else []), *own]:
        if not any(distance(one, other) > 2 * settings.reach for one, other in pairwise(targets)):
            raise ConfigError(
                f"{where}: patrol: expected at least two targets a robot, more than {2 * settings.reach:g} m apart "
                f"(twice `reach`), got {targets}; add one, or leave out `patrol`"
            )


def _suggest_scenario(path: Path) -> str:
    """Return the scenario that was perhaps meant: one that is shipped, or a file beside ``path`` with a ``map``."""
    known = {name: name for name in shipped_scenarios()}
    for file in path.parent.glob("*.yaml"):
        with suppress(ConfigError):
            if any(line.startswith("map:") for line in read_text(file, SIZE_LIMIT).splitlines()):
                known[file.stem] = file.name
    close = get_close_matches(path.stem, known, n=1)
    return f"did you mean {known[close[0]]!r}?" if close else "check the path; `swarm run` lists those it comes with"


def _read(path: Path) -> dict[str, Any]:
    if not path.exists():
        raise ConfigError(f"{path}: expected a scenario file, found none; {_suggest_scenario(path)}")
    raw = yaml_values(read_text(path, SIZE_LIMIT), str(path))
    if not isinstance(raw, dict):
        raise ConfigError(f"{path}: expected `name:`, `map:`, `start:`, `targets:`, got {quote_value(raw)}")
    if odd := [key for key in raw if not isinstance(key, str)]:
        raise ConfigError(f"{path}: expected names of fields, got {quote_value(odd[0])}; see scenarios/paper.yaml")
    return raw
