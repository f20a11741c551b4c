"""A plan: everything one run of a storm needs, as plain data that a person can read, edit and run again."""

from pathlib import Path
from typing import Annotated, Any, Final, Literal, get_args

import msgspec
import yaml
from msgspec import Meta

from swarm.errors import ConfigError
from swarm.fuzzy import load_profile
from swarm.maps.files import read_text
from swarm.maps.text import from_text
from swarm.scenario.check import check
from swarm.scenario.load import Scenario, check_values, load_own_profiles
from swarm.scenario.prepare import settle_lattice
from swarm.settings import Section, Settings
from world.faults import Faults, Health, Spell

LARGEST: Final = 1_000_000  # bytes of a plan file

Tick = Annotated[int, Meta(ge=0, le=10_000_000)]
Name = Annotated[str, Meta(pattern=r"^[A-Za-z0-9_.:-]{1,64}\Z")]


FaultKind = Literal["held_up", "suspended", "away", "dead"]
FAULTS: Final = {kind: kind.replace("_", " ") for kind in get_args(FaultKind)}  # and how a summary names them


class PlannedFault(Section, frozen=True, kw_only=True):
    """One fault of one robot. ``ticks`` says how long it lasts; a killed robot stays dead."""

    robot: Name
    kind: FaultKind
    tick: Tick
    ticks: Tick = 0


class StormPlan(Section, frozen=True, kw_only=True):
    """One run: the scenario, and what goes wrong in it at which tick."""

    storm: Literal[1] = 1  # version of this form
    profile: Name  # the profile that drew it
    seed: Annotated[int, Meta(ge=0, le=2**53)]  # the seed that drew it; the run itself uses the scenario's
    scenario: Settings
    faults: Annotated[list[PlannedFault], Meta(max_length=10_000)] = []  # noqa: RUF012, msgspec copies it
    kill_leader_at: Tick | None = None  # the first robot that leads a joint plan at or after this tick dies
    mute: Annotated[list[Name], Meta(max_length=100)] = []  # noqa: RUF012, robots that say nothing of traffic
    late: Annotated[int, Meta(ge=0, le=100)] = 0  # ticks between what robots sense and what they answer
    slow: Annotated[int, Meta(ge=0, le=100)] = 0  # ticks by which answers are later at most; it changes for each robot

    @property
    def robots(self) -> int:
        """Number of robots."""
        return self.scenario.count

    @property
    def dead(self) -> bool:
        """True if a robot dies in the run."""
        return self.kill_leader_at is not None or any(fault.kind == "dead" for fault in self.faults)

    def features(self) -> frozenset[str]:
        """Return the names of what the plan has besides driving, for the summary."""
        settings = self.scenario
        kinds = {fault.kind for fault in self.faults}
        flags = {
            "loss": settings.radio.loss > 0.0,
            "short radio": settings.radio.range < 8.0,
            "line of sight": settings.radio.line_of_sight,
            "late": self.late > 0,
            "slow": self.slow > 0,
            "mute": bool(self.mute),
            "leader killed": self.kill_leader_at is not None,
            "edits": bool(settings.edits),
            "movers": bool(settings.movers),
            "orders": bool(settings.orders),
            "pool": bool(settings.pool),
            "shared targets": bool(settings.targets),
            "unknown floor": not settings.map.known,
            "kinds": bool(settings.kinds),
            **{name: kind in kinds for kind, name in FAULTS.items()},
        }
        return frozenset(name for name, there in flags.items() if there)

    def to_scenario(self) -> Scenario:
        """Return the scenario with its lattice placed.

        Raises:
            ConfigError: the plan has no map as text, or the text is not a map.
        """
        settings = self.scenario
        if settings.map.text is None:
            raise ConfigError("a plan's map: expected `text`, got a file; draw the map in the plan")
        floor = from_text(settings.map.text, settings.map.cell)
        own = load_own_profiles(settings)
        return settle_lattice(Scenario(settings, floor, load_profile(settings.controller), own))

    def to_faults(self) -> Faults:
        """Return the faults in the simulation's form."""
        dt = 1.0 / self.scenario.rate
        killed = {fault.robot: fault.tick * dt for fault in self.faults if fault.kind == "dead"}
        spells = [
            Spell(fault.robot, Health(fault.kind), fault.tick, fault.ticks)
            for fault in self.faults
            if fault.kind != "dead"
        ]
        leader = {} if self.kill_leader_at is None else {"kill_leader_at": self.kill_leader_at * dt}
        return Faults(killed=killed, spells=tuple(spells), late=self.late * dt, slow=self.slow * dt, **leader)

    def to_yaml(self) -> str:
        """Return the plan as the text of a file."""
        raw = _without_defaults(self)
        return str(yaml.dump(raw, Dumper=_Dumper, sort_keys=False, default_flow_style=None, width=118))


class _Dumper(yaml.SafeDumper):
    """The writer of plans: a text of several lines, such as a map, is written line by line."""


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style="|" if "\n" in text else None)


_Dumper.add_representer(str, _text)


def _without_defaults(section: Section) -> dict[str, Any]:
    """Return a section's fields that differ from their defaults."""
    found: dict[str, Any] = {}
    for info in msgspec.structs.fields(type(section)):
        value = getattr(section, info.name)
        default = info.default if info.default_factory is msgspec.NODEFAULT else info.default_factory()
        if info.name not in {"storm", "profile", "seed"} and value == default:
            continue
        if isinstance(value, Section):
            inner = _without_defaults(value)
            if inner:
                found[info.name] = inner
        elif isinstance(value, list) and value and isinstance(value[0], Section):
            found[info.name] = [_without_defaults(item) for item in value]
        else:
            found[info.name] = msgspec.to_builtins(value)
    return found


def only_simulated(plan: StormPlan) -> str:
    """Return why a plan can run only in the simulation, or "" if processes can run it too."""
    features = {"late", "slow", "leader killed", "mute", *FAULTS.values()} & plan.features()
    return f"only the simulation has robots that are {' or '.join(sorted(features))}" if features else ""


def read(path: Path) -> StormPlan:
    """Read a plan file.

    Raises:
        ConfigError: the file cannot be read or is not a plan; the text says where and what to do.
    """
    try:
        raw = yaml.load(read_text(path, LARGEST), yaml.CSafeLoader)
    except (yaml.YAMLError, RecursionError, ValueError) as fault:
        raise ConfigError(f"{path}: expected YAML, got {str(fault).splitlines()[0]}; correct that line") from None
    if not isinstance(raw, dict) or "storm" not in raw:
        raise ConfigError(
            f"{path}: expected a storm plan (`storm: 1`, `scenario:`), got something else; swarm storm writes them"
        )
    return valid(raw, str(path))


def valid(raw: object, where: str) -> StormPlan:
    """Return the plan in plain values.

    Raises:
        ConfigError: they are none; the text begins with ``where``.
    """
    try:
        plan = msgspec.convert(raw, StormPlan)
    except msgspec.ValidationError as fault:
        raise ConfigError(f"{where}: {fault}; swarm storm --show SEED prints a valid plan") from None
    check_values(msgspec.to_builtins(plan.scenario), where)
    names = {f"r{number}" for number in range(1, plan.robots + 1)}
    if unknown := {*[fault.robot for fault in plan.faults], *plan.mute} - names:
        raise ConfigError(
            f"{where}: faults and mute: expected robots r1 to r{plan.robots}, got {', '.join(sorted(unknown))}"
        )
    try:
        check(plan.to_scenario(), plan.robots, plan.scenario.seed)
    except ConfigError as fault:
        raise ConfigError(f"{where}: {fault}") from None
    return plan
