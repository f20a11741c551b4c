"""The set-up of a fleet as a request: scenario, robots, speed, starts, targets, floor; checked like a scenario file."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec

from swarm.bus import Request
from swarm.errors import ConfigError, PeerError, SwarmError
from swarm.launch.options import Options, ready
from swarm.maps.text import from_text
from swarm.messages import Accepted, Phase, Setup
from swarm.scenario.load import Scenario, checked, load
from swarm.scenario.shipped import found, shipped
from swarm.scenario.starts import starts

MAY_CHANGE = (Phase.WAITING, Phase.PAUSED)  # phases in which nobody drives


def as_set(options: Options) -> Setup:
    """Return the set-up of a fleet as it is."""
    settings = options.scenario.settings
    return Setup(
        scenario=settings.name,
        robots=options.robots,
        speed=settings.robot.speed_scale,
        starts=[(x, y, yaw) for x, y, yaw in starts(options.scenario, options.robots, options.seed)],
        targets=settings.targets,
        map=settings.map.text,
        cell=settings.map.cell if settings.map.text is not None else None,
    )


def answered(request: Request, options: Options, phase: Phase | None) -> Options | None:
    """Answer a request for another set-up; return the options to start the fleet with, or None if it was refused."""
    asked = request.message
    assert isinstance(asked, Setup)
    try:
        if phase not in MAY_CHANGE:
            was = "no world that answers" if phase is None else f"one that is {phase.value}"
            raise PeerError(f"setup: expected a run that waits or is paused, got {was}; pause it first")
        other = changed(asked, options)
    except SwarmError as fault:
        request.refuse(str(fault))
        return None
    name = other.scenario.settings.name
    request.accept(
        Accepted(text=f"{name} with {other.robots} robot{'s' * (other.robots > 1)} is set up; it waits for go")
    )
    return other


def changed(asked: Setup, options: Options) -> Options:
    """Return the options with what is asked for in place of what is set.

    Raises:
        ConfigError: it cannot be driven; the errors are those of a scenario file.
    """
    base = _base(asked.scenario, options)
    raw: dict[str, Any] = msgspec.to_builtins(base.settings)
    robots = base.settings.robots if asked.scenario is not None else options.robots
    floor = base.map
    if asked.starts is not None:
        raw["start"], robots = {"poses": asked.starts}, len(asked.starts)
    if asked.robots is not None:
        robots = asked.robots
    if asked.targets is not None:
        raw["targets"], raw["own_targets"] = asked.targets, []
    if asked.speed is not None:
        raw["robot"]["speed_scale"] = asked.speed
    if asked.map is not None:
        raw["map"] |= {"text": asked.map, "file": None}
        raw["map"] |= {} if asked.cell is None else {"cell": asked.cell}
        floor = from_text(asked.map, raw["map"]["cell"], "setup: map")
    elif asked.cell is not None and asked.cell != raw["map"]["cell"]:
        raise ConfigError(f"setup: cell: expected a map with it, got {asked.cell:g} m alone; send both")
    if not 1 <= robots <= 1000:
        raise ConfigError(f"setup: robots: expected 1 to 1000, got {robots}")
    scenario = Scenario(checked(raw, "setup"), floor, base.profile)
    return ready(replace(options, scenario=scenario, robots=robots, wait=True))


def _base(name: str | None, options: Options) -> Scenario:
    """Return the scenario that a set-up changes: the one of a name that comes with the project, or that of now."""
    now = options.loaded or options.scenario
    if name in {None, now.settings.name}:
        return now
    if name not in shipped():
        raise ConfigError(f"setup: scenario: expected one of {', '.join(shipped())}, got {name!r}")
    return load(found(Path(str(name))), serve=now.settings.serve)
