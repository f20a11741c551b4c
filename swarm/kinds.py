"""Robots unlike each other in one fleet: of which kind each is, and the settings that are its own.

The robots of a mix ``{cart: 2, scout: 6}`` have their numbers in that order: r1 and r2 are carts. Everything that is
about one robot reads ``settings_of`` its kind: ``robot``, ``sensors`` and ``controller`` in them are those of the kind.
"""

import re
from collections.abc import Iterable, Mapping
from typing import Final

import msgspec
from msgspec import UNSET, UnsetType
from msgspec.structs import replace

from swarm.errors import ConfigError, suggest
from swarm.settings import (
    MOST_ROBOTS,
    Coordinates,
    KindSettings,
    RobotSettings,
    Settings,
    StartSettings,
)

PLAIN: Final = ""  # the kind of all robots of a fleet that names no kinds
MIX_PART: Final = re.compile(r"([A-Za-z0-9_.:-]{1,64})=([0-9]{1,4})")
OWN_BODY: Final = ("radius", "track_width", "wheel_acceleration", "speed_scale", "distance_scale")


def list_kinds(settings: Settings) -> list[str]:
    """Return the kind of each robot, in the order of their numbers."""
    if isinstance(settings.robots, int):
        return [PLAIN] * settings.robots
    return [kind for kind, count in settings.robots.items() for _ in range(count)]


def kind_of(settings: Settings, number: int) -> str:
    """Return the kind of robot ``number``, from 0; of one that came later, that is not known here: the first kind."""
    kinds = list_kinds(settings)
    return kinds[number] if number < len(kinds) else next(iter(settings.kinds), PLAIN)


def settings_of(settings: Settings, kind: str) -> Settings:
    """Return the settings as they are for robots of a kind; those of a fleet without kinds are the settings.

    Raises:
        ConfigError: there is no such kind.
    """
    if kind == PLAIN:
        return settings
    if kind not in settings.kinds:
        raise ConfigError(
            f"kind: expected {', '.join(settings.kinds) or 'none'}, got {kind!r}; {_help(kind, settings)}"
        )
    own = settings.kinds[kind]
    return replace(
        settings,
        robot=_body_of(own, settings),
        sensors=own.sensors or settings.sensors,
        controller=own.controller or settings.controller,
    )


def settings_of_named(settings: Settings, kinds: Mapping[str, str] | UnsetType, name: str) -> Settings:
    """Return the settings as they are for a robot of a fleet that tells its map: ``kinds`` are those of its robots.

    A robot whose kind is not told has the scenario's.
    """
    return settings if kinds is UNSET else settings_of(settings, kinds.get(name, PLAIN))


def complete_kinds(settings: Settings) -> Settings:
    """Return the settings with everything in their kinds that was left out: body, sensors and controller."""
    if not settings.kinds:
        return settings
    kinds = {
        name: replace(
            own,
            sensors=own.sensors or settings.sensors,
            controller=own.controller or settings.controller,
            **msgspec.structs.asdict(_body_of(own, settings)),
        )
        for name, own in settings.kinds.items()
    }
    return replace(settings, kinds=kinds)


def _body_of(own: KindSettings, settings: Settings) -> RobotSettings:
    return replace(settings.robot, **{field: value for field in OWN_BODY if (value := getattr(own, field)) is not None})


def start_of(settings: Settings, number: int) -> tuple[StartSettings, int]:
    """Return the section that says where a robot starts, and its place among the robots that start by it, from 0."""
    kinds = list_kinds(settings)
    if not settings.kinds or number >= len(kinds):
        return settings.start, number
    section = settings.kinds[kinds[number]].start
    before = [settings.kinds[kind].start for kind in kinds[:number]]
    return section or settings.start, sum(one is section for one in before)


def targets_of(settings: Settings, number: int) -> list[Coordinates]:
    """Return the targets [m] of a robot: its own, those of its kind, or those of all."""
    own = settings.own_targets[number : number + 1]  # none for a robot whose place was opened later
    if own:
        return own[0]
    kind = settings.kinds.get(kind_of(settings, number))
    return settings.targets if kind is None or kind.targets is None else kind.targets


def kind_targets(settings: Settings) -> list[Coordinates]:
    """Return the targets [m] that kinds have of their own."""
    return [target for kind in settings.kinds.values() for target in kind.targets or ()]


def kind_starts(settings: Settings) -> list[StartSettings]:
    """Return the start sections that kinds have of their own."""
    return [kind.start for kind in settings.kinds.values() if kind.start is not None]


def all_bodies(settings: Settings) -> list[RobotSettings]:
    """Return the bodies that robots of this fleet may have: of each kind, or the scenario's one."""
    return [settings_of(settings, kind).robot for kind in settings.kinds] or [settings.robot]


def settings_of_widest(settings: Settings) -> Settings:
    """Return the settings as they are for the widest robots of the mix."""
    if not settings.kinds:
        return settings
    kinds = dict.fromkeys(list_kinds(settings))
    return max((settings_of(settings, kind) for kind in kinds), key=lambda one: one.robot.radius)


def list_views(settings: Settings) -> list[Settings]:
    """Return for each kind of the mix the settings of a fleet of its robots alone, with their starts and targets.

    Those of a fleet without kinds are the settings.
    """
    if not settings.kinds:
        return [settings]
    kinds, views = list_kinds(settings), []
    for kind in dict.fromkeys(kinds):
        numbers = [number for number, own in enumerate(kinds) if own == kind]
        placed = [start_of(settings, number) for number in numbers]
        section = placed[0][0]
        poses = [section.poses[place] for _, place in placed if place < len(section.poses)] if section.poses else None
        own_targets = [settings.own_targets[number] for number in numbers if number < len(settings.own_targets)]
        views.append(
            replace(
                settings_of(settings, kind), kinds={}, robots=len(numbers), start=replace(section, poses=poses),
                targets=[] if own_targets else targets_of(settings, numbers[0]), own_targets=own_targets,
            )
        )  # fmt: skip
    return views


def with_mix(settings: Settings, robots: int | Mapping[str, int]) -> Settings:
    """Return the settings with another number of robots, or other numbers of each kind.

    Raises:
        ConfigError: the mix names kinds that there are not, or a fleet of kinds gets a mere number.
    """
    settings = replace(settings, robots=robots if isinstance(robots, int) else dict(robots))
    check_mix(settings, settings.name)
    return settings


def check_mix(settings: Settings, where: str) -> None:
    """Check that the mix of robots and the kinds fit each other.

    Raises:
        ConfigError: they do not; the text says what to write.
    """
    robots, kinds = settings.robots, settings.kinds
    if isinstance(robots, int):
        if kinds:
            mix = ",".join(f"{kind}=1" for kind in kinds)
            raise ConfigError(
                f"{where}: robots: expected how many of each kind, got {robots}; say it as {mix}, or in a file as "
                f"{{{mix.replace('=', ': ').replace(',', ', ')}}}"
            )
        return
    if not robots:
        raise ConfigError(f"{where}: robots: expected at least one robot, got none; name a kind and its number")
    for kind in robots:
        if kind not in kinds:
            raise ConfigError(f"{where}: robots: expected kinds of `kinds`, got {kind!r}; {_help(kind, settings)}")


def parse_mix(text: str) -> int | dict[str, int]:
    """Return a number of robots, or of a text such as ``scout=6,cart=2`` the number of each kind.

    >>> parse_mix("8"), parse_mix("scout=6,cart=2")
    (8, {'scout': 6, 'cart': 2})

    Raises:
        ConfigError: it is neither, or it is too many robots.
    """
    pairs = [MIX_PART.fullmatch(part.strip()) for part in text.split(",")]
    mix = {pair[1]: int(pair[2]) for pair in pairs if pair is not None}
    robots = int(text) if text.isdecimal() else mix
    counts = [robots] if isinstance(robots, int) else list(robots.values())
    if len(counts) == len(pairs) and min(counts) >= 1 and sum(counts) <= MOST_ROBOTS:
        return robots
    raise ConfigError(
        f"--robots: expected 1 to {MOST_ROBOTS}, or how many of each kind, such as scout=6,cart=2, got {text!r}"
    )


def format_mix(robots: int | Mapping[str, int]) -> str:
    """Return a number or a mix as ``parse_mix`` reads it.

    >>> format_mix({"scout": 6, "cart": 2})
    'scout=6,cart=2'
    """
    return str(robots) if isinstance(robots, int) else ",".join(f"{kind}={count}" for kind, count in robots.items())


def merge_own_sensors(raw: object) -> object:
    """Return plain values of a scenario with the sensors of each kind completed from the scenario's.

    Values of other types are left for the check to find.
    """
    if not isinstance(raw, dict):
        return raw
    kinds, shared = raw.get("kinds"), raw.get("sensors")
    if not isinstance(kinds, dict) or not isinstance(shared, dict):
        return raw
    merged = {
        name: {**kind, "sensors": shared | kind["sensors"]}
        if isinstance(kind, dict) and isinstance(kind.get("sensors"), dict)
        else kind
        for name, kind in kinds.items()
    }
    whole: dict[object, object] = dict(raw)
    return whole | {"kinds": merged}


def own_controllers(settings: Settings) -> dict[str, str]:
    """Return the fuzzy profiles that kinds have instead of the scenario's, by kind."""
    kinds = settings.kinds.items()
    return {name: kind.controller for name, kind in kinds if kind.controller not in (None, settings.controller)}


def _help(kind: str, settings: Settings) -> str:
    names: Iterable[str] = settings.kinds
    return suggest(kind, list(names)) if settings.kinds else "the scenario has no `kinds`; add them or give a number"
