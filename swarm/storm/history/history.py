"""The record of one run, tick by tick, as it is seen from outside: the laws judge it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isinf
from time import perf_counter
from traceback import format_exc
from typing import Any, Final, NamedTuple

from swarm.geometry import Pose
from swarm.kinds import kind_of, settings_of
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages import Broadcast, Command, Event, Sense
from swarm.settings import RobotSettings, Settings
from swarm.storm.plans.plan import StormPlan
from swarm.storm.uncooperative import make_mute
from world.bodies.shapes import Contact
from world.faults import Health
from world.simulate import Simulation

HOPELESS: Final = 240.0  # s; a run in which no robot has made progress for so long is over


class Moment(NamedTuple):
    """One tick. Poses are those at its beginning, in the order of the robots' numbers."""

    tick: int
    poses: tuple[Pose, ...]
    health: Mapping[str, Health]
    senses: Mapping[str, Sense]
    commands: Mapping[str, Command]  # answered in this tick
    spoken: Mapping[str, Broadcast]  # put on the radio in this tick
    events: tuple[Event, ...]
    obeyed: tuple[int, ...]  # tick of the command that each robot's wheels follow in this tick
    touching: frozenset[int]  # numbers of the robots that something touches


@dataclass
class History:
    """The record of a whole run."""

    settings: Settings
    robots: tuple[str, ...]
    stops: tuple[tuple[Point, ...], ...]  # of each robot
    floors: list[tuple[int, OccupancyMap]]  # first tick and floor, oldest first
    mute: frozenset[str] = frozenset()  # robots that say nothing of traffic
    late: int = 0  # ticks by which answers come late at most
    is_drawn: bool = False  # cells were chosen for the drawing, which says what is possible; else the plan names them
    put_back: dict[int, list[int]] = field(default_factory=dict)  # by robot number, ticks at which a new world has it
    # elsewhere than it was when the last world died
    moments: list[Moment] = field(default_factory=list)
    contacts: list[tuple[int, Contact, bool]] = field(default_factory=list)  # tick, contact, was it avoidable
    report: dict[str, Any] = field(default_factory=dict)
    crash: str = ""  # the traceback of an exception
    wall_time: float = 0.0  # s

    def settings_of(self, number: int) -> Settings:
        """Return the settings as they are for a robot: its body and its sensors are those of its kind."""
        return settings_of(self.settings, kind_of(self.settings, number))

    def body(self, number: int) -> RobotSettings:
        """Return what a robot's body is."""
        return self.settings_of(number).robot

    @property
    def bodies(self) -> list[RobotSettings]:
        """What each robot's body is."""
        return [self.body(number) for number in range(len(self.robots))]

    @property
    def dt(self) -> float:
        """Seconds in a tick."""
        return 1.0 / self.settings.rate


def record(plan: StormPlan) -> History:
    """Run a plan in one process and record it; an exception ends the run and is recorded too."""
    began = perf_counter()
    scenario = plan.to_scenario()
    simulation = Simulation.of(scenario, plan.robots, scenario.settings.seed, plan.to_faults())
    make_mute(simulation, plan.mute)
    world = simulation.world
    history = History(
        settings=scenario.settings,
        robots=tuple(world.robots),
        stops=tuple(map(world.tasks.missions.stops, range(len(world.robots)))),
        floors=[(0, world.bodies.floor)],
        mute=frozenset(plan.mute),
        late=simulation.drill.slowest,
        is_drawn=plan.scenario.traffic.offset is None,
    )
    limit = scenario.settings.limit
    try:
        while not world.is_finished and world.time < limit and not _is_hopeless(simulation):
            poses = tuple(world.poses())
            tick = simulation.step()
            history.moments.append(
                Moment(
                    world.tick - 1, poses, tick.health, tick.senses, tick.commands, tick.spoken,
                    tuple(tick.events), tuple(command.tick for command in world.tasks.commands),
                    frozenset(contact.robot for contact in world.bodies.physics.touching),
                )
            )  # fmt: skip
            if world.bodies.floor is not history.floors[-1][1]:
                history.floors.append((world.tick, world.bodies.floor))
        history.moments.append(Moment(world.tick, tuple(world.poses()), {}, {}, {}, {}, (), (), frozenset()))
        history.report = simulation.report(perf_counter() - began, limit)
    except Exception:
        history.crash = format_exc()
    history.contacts = world.measures.recorder.counts.begun
    history.wall_time = perf_counter() - began
    return history


def _is_hopeless(simulation: Simulation) -> bool:
    """Return True if each robot with stops left is dead or has made no progress for ``HOPELESS``."""
    world = simulation.world
    if world.tasks.missions.any_stopped or world.tasks.planned_orders.plans_left:
        return False
    dead = simulation.drill.dead
    if world.tasks.complete and not dead:
        return False  # it ends by itself, and soon: a law looks at that
    stands = world.measures.progress.standing(world.time)
    # free is also who has just reached its last stop, and has not said so yet
    free = any(isinf(seconds) for name, seconds in zip(world.robots, stands, strict=True) if name not in dead)
    has_just_got_one = any(isinf(stands[one.robot]) for one in world.tasks.pool.taken_errands if one.robot is not None)
    # an errand of a dead robot goes back to the pool once that one is silent for long
    comes_back = any(world.robots[one.robot] in dead for one in world.tasks.pool.taken_errands if one.robot is not None)
    if has_just_got_one or (free and (world.plans_matter or comes_back)):
        return False  # errands go on
    return all(name in dead or stands[number] >= HOPELESS for number, name in enumerate(world.robots)) or (
        len(dead) == len(world.robots)
    )
