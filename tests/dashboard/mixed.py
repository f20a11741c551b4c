"""A fleet of two kinds, as a dashboard hears of it: two carts and six scouts, all at their starts."""

from typing import Final

from msgspec.structs import replace

from swarm.messages import Activity, Body, Clock, Map, Mover, Phase, Truth
from swarm.scenario.load import Scenario, load
from swarm.scenario.prepare import prepare
from swarm.scenario.starts import robot_names
from tests.shared import ROOT

NAMES: Final = robot_names(8)
KINDS: Final = {name: "cart" if number < 2 else "scout" for number, name in enumerate(NAMES)}
FILE: Final = ROOT / "scenarios" / "mixed.yaml"
RADII: Final = {"cart": 0.35, "scout": 0.2}  # m
STARTED: Final = prepare(load(FILE), len(NAMES), 1)
STARTS: Final = {name: (pose.x, pose.y, pose.yaw) for name, pose in zip(NAMES, STARTED.starts, strict=True)}


def floor(scenario: Scenario = STARTED.scenario, *, told: bool = True) -> Map:
    """Return the map of it, as the world sends it; without the kinds of the robots if they are not ``told``."""
    settings, packed = scenario.to_wire()
    settings = replace(settings, starts=STARTS)
    return Map(packed=packed, scenario=replace(settings, kinds=KINDS) if told else settings)


def clock(tick: int = 0) -> Clock:
    names = list(NAMES)
    return Clock(run=0, tick=tick, time=tick / 20, phase=Phase.RUNNING, robots=names, present=names)


def truth(tick: int = 0, movers: list[Mover] | None = None, **loads: float) -> Truth:
    """Return where all robots are; ``loads`` are the radii [m] of those that carry something."""
    bodies = [
        Body(
            robot=name, x=x, y=y, yaw=yaw, left_v=0.0, right_v=0.0, left=1.0, front=0.5, right=1.6, heading=0.0,
            steering=None, activity=Activity.DRIVE, radius=loads.get(name, 0.0),
        )
        for name, (x, y, yaw) in STARTS.items()
    ]  # fmt: skip
    return Truth(run=0, tick=tick, time=tick / 20, bodies=bodies, movers=movers or [])
