"""The scenario file of what was drawn: the floor as it is now, the starts, the targets, and all that differs."""

from typing import Any, Final

import msgspec
import yaml

from swarm.maps.text import floor_as_text
from swarm.maps.wire import unpack
from swarm.messages import Map, Setup
from swarm.settings import MapSettings, Settings, StartSettings

EMPTY: Final = Settings(name="-", map=MapSettings(), start=StartSettings())  # all defaults
WRITTEN: Final = {"name", "map", "start", "targets", "own_targets", "kinds", "robots", "serve", "edits"}  # or left out
PLACED: Final = {"text", "file", "cell", "offset"}  # the floor is drawn, and the lattice is laid over it when it is run


class _Block(str):
    """A text that is written as a block of lines."""

    __slots__ = ()


class _Dumper(yaml.SafeDumper):
    """Writes blocks of lines as such."""


_Dumper.add_representer(_Block, lambda dumper, text: dumper.represent_scalar("tag:yaml.org,2002:str", text, style="|"))


def scenario_file(floor: Map, setup: Setup) -> str:
    """Return the text of a scenario file that drives the same.

    Raises:
        PeerError: the packed map is not valid.
        ConfigError: no text can say the floor.
    """
    settings, known = floor.scenario.settings, unpack(floor.packed)
    raw: dict[str, Any] = msgspec.to_builtins(settings)
    default: dict[str, Any] = msgspec.to_builtins(EMPTY)
    told: dict[str, Any] = {
        "name": settings.name,
        "map": {"cell": known.resolution, "text": _Block(floor_as_text(known))}
        | _settings_beyond_defaults(raw["map"], default["map"]),
        "start": {"poses": [list(start) for start in setup.starts or ()]},
    }
    told |= {name: raw[name] for name in ("targets", "own_targets") if raw[name]}
    if raw["kinds"]:
        told |= {"kinds": {name: _own_parts(kind, raw) for name, kind in raw["kinds"].items()}}
        told |= {"robots": setup.mix or raw["robots"]}
    else:
        told |= {"robots": setup.robots or len(setup.starts or ())}
    of_kinds = bool(settings.kinds) and all(kind.targets is not None for kind in settings.kinds.values())
    if not (raw["targets"] or raw["own_targets"] or of_kinds):
        told |= {"serve": True}  # whoever drives it gives orders
    rest = {name: value for name, value in raw.items() if name not in WRITTEN}
    return yaml.dump(
        told | _settings_beyond_defaults(rest, default), Dumper=_Dumper, sort_keys=False, default_flow_style=None
    )


def _own_parts(kind: dict[str, Any], raw: dict[str, Any]) -> dict[str, Any]:
    """Return what a kind has of its own; the starts of all robots are in the scenario's, in their order."""
    shared = {**raw["robot"], "controller": raw["controller"], "sensors": raw["sensors"]}
    own = {name: value for name, value in kind.items() if value not in (None, shared.get(name)) and name != "start"}
    if "sensors" in own:
        own["sensors"] = {name: value for name, value in own["sensors"].items() if value != raw["sensors"][name]}
    return own


def _settings_beyond_defaults(raw: dict[str, Any], default: dict[str, Any]) -> dict[str, Any]:
    """Return what differs from the defaults, without the places of floor and lattice."""
    found: dict[str, Any] = {}
    for name, value in raw.items():
        if isinstance(value, dict):
            if inner := _settings_beyond_defaults(value, default[name]):
                found[name] = inner
        elif value != default[name] and name not in PLACED:
            found[name] = value
    return found
