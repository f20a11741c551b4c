"""The set-up of a fleet as a request: scenario, robots, speed, starts, targets, floor; checked like a scenario file."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import msgspec

from swarm.bus import Request
from swarm.errors import ConfigError, PeerError, SwarmError, suggest
from swarm.kinds import kind_targets
from swarm.launch.options import Options, ready
from swarm.maps.text import from_text
from swarm.messages import DRAWING_LIMIT, Accepted, Clock, Phase, Setup
from swarm.scenario.load import Scenario, check_values, load
from swarm.scenario.shipped_scenarios import file_of, shipped_scenarios
from swarm.scenario.starts import starts
from swarm.settings import MOST_ROBOTS

MAY_CHANGE = (Phase.WAITING, Phase.PAUSED)  # phases in which nobody drives
BUSY = "setup: expected no other set-up in progress, got one; ask again once the fleet waits for go"


class Another(NamedTuple):
    """A set-up that was accepted."""

    options: Options
    run: int  # number of its first run


def as_set(options: Options) -> Setup:
    """Return the set-up of a fleet as it is; what it cannot say is null, which keeps that part in a request."""
    settings = options.scenario.settings
    drawn = settings.map.text is not None and len(settings.map.text) <= DRAWING_LIMIT
    on_circle = settings.start.circle is not None
    poses = [(x, y, yaw) for x, y, yaw in starts(options.scenario, options.robots, options.seed)]
    return Setup(
        scenario=settings.name,
        robots=options.robots,
        mix=settings.robots if isinstance(settings.robots, dict) else None,
        speed=None if settings.kinds else settings.robot.speed_scale,
        starts=None if on_circle else poses,
        targets=None if on_circle or settings.own_targets or kind_targets(settings) else settings.targets,
        map=settings.map.text if drawn else None,
        cell=settings.map.cell if drawn else None,
    )


def answer_setup(
    request: Request, options: Options, ask_clock: Callable[[], Clock | None], added: int = 0
) -> Another | None:
    """Answer a request for another set-up; return it, or None if it was refused.

    The clock is asked for last: nothing but the answer comes between its phase and what is done.
    ``added`` robots have come since the fleet began.
    """
    asked = request.message
    assert isinstance(asked, Setup)
    try:
        other = change_options(asked, options)
        clock = ask_clock()
        if clock is None or clock.phase not in MAY_CHANGE:
            was = "no world that answers" if clock is None else f"one that is {clock.phase.value}"
            raise PeerError(f"setup: expected a run that waits or is paused, got {was}; pause it first")
    except SwarmError as fault:
        request.refuse(str(fault))
        return None
    text = f"{other.scenario.settings.name} with {in_words(other.robots)} is set up; it waits for go"
    if added:
        text += f". It is without the {in_words(added)} added to the fleet before; add them again"
    request.accept(Accepted(text=text))
    return Another(other, clock.run + 1)


def in_words(number: int) -> str:
    """Return a number of robots in words."""
    return f"{number} robot{'s' * (number > 1)}"


def change_options(asked: Setup, options: Options) -> Options:
    """Return the options with what is asked for in place of what is set.

    Raises:
        ConfigError: it cannot be driven; the errors are those of a scenario file.
    """
    now = options.loaded or options.scenario
    same = asked.scenario in {None, now.settings.name}
    base = now if same else _shipped_scenario(str(asked.scenario), now.settings.serve)
    raw: dict[str, Any] = msgspec.to_builtins(base.settings)
    mix = base.settings.robots
    robots: int | dict[str, int] = options.robots if same and isinstance(mix, int) else mix
    floor = base.map
    if asked.starts is not None:
        raw["start"], robots = {"poses": asked.starts}, len(asked.starts) if isinstance(mix, int) else mix
        for kind in raw["kinds"].values():
            kind["start"] = None
    if asked.robots is not None:
        robots = asked.robots
    if asked.mix is not None:
        robots = raw["robots"] = asked.mix
    if asked.targets is not None:
        raw["targets"], raw["own_targets"] = asked.targets, []
        for kind in raw["kinds"].values():
            kind["targets"] = None
    if asked.speed is not None:
        for body in (raw["robot"], *raw["kinds"].values()):
            body["speed_scale"] = asked.speed
    if asked.map is not None:
        raw["map"] |= {"text": asked.map, "file": None}
        raw["map"] |= {} if asked.cell is None else {"cell": asked.cell}
        floor = from_text(asked.map, raw["map"]["cell"], "setup: map")
    elif asked.cell is not None and asked.cell != raw["map"]["cell"]:
        raise ConfigError(f"setup: cell: expected a map with it, got {asked.cell:g} m alone; send both")
    count = robots if isinstance(robots, int) else sum(robots.values())
    if not 1 <= count <= MOST_ROBOTS:
        raise ConfigError(f"setup: robots: expected 1 to {MOST_ROBOTS}, got {count}")
    if base.settings.kinds and isinstance(robots, int) and robots != base.settings.count:
        known = ", ".join(base.settings.kinds)
        raise ConfigError(f"setup: robots: expected `mix`, how many of each kind of {known}, got {robots} robots")
    scenario = Scenario(check_values(raw, "setup"), floor, base.profile, base.profiles)
    return ready(replace(options, scenario=scenario, robots=count, wait=True))


def _shipped_scenario(name: str, serve: bool) -> Scenario:
    """Return a scenario that comes with the project; no other file is read for a request."""
    known = shipped_scenarios()
    if name not in known:
        raise ConfigError(
            f"setup: scenario: expected one that comes with the project, got {name!r}; {suggest(name, known)}"
        )
    return load(file_of(name), serve=serve)
