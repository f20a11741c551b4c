"""What goes wrong in a plan: which robots fail, and when."""

from collections.abc import Iterator
from random import Random
from typing import Final

from swarm.scenario.starts import robot_names
from swarm.storm.plans.plan import FaultKind, PlannedFault
from swarm.storm.plans.profiles import StormProfile

RATE: Final = 20  # Hz
BUSY: Final = 60.0  # s; no drawn hold-up or suspension begins later


def draw_faults(profile: StormProfile, robots: int, chance: Random) -> list[PlannedFault]:
    """Draw which robots are held up, suspended, away or dead, and when."""
    everybody = robot_names(robots)
    found: list[PlannedFault] = []
    often: tuple[tuple[FaultKind, float], ...] = (("held_up", profile.held_up), ("suspended", profile.suspended))
    for kind, share in often:
        if chance.random() < share:
            for robot in everybody:
                found += [
                    PlannedFault(robot=robot, kind=kind, tick=tick, ticks=chance.choice((30, 60, 100, 200)))
                    for tick in _moments(profile.every, chance)
                ]
    if chance.random() < profile.away:
        robot = chance.choice(everybody)
        found.append(
            PlannedFault(robot=robot, kind="away", tick=chance.randrange(40, 800), ticks=chance.randrange(4, 60))
        )
    if chance.random() < profile.dead:
        for robot in chance.sample(everybody, chance.randint(1, max(1, robots // 3))):
            found.append(PlannedFault(robot=robot, kind="dead", tick=chance.randrange(20, 800)))
    return sorted(found, key=lambda fault: (fault.tick, fault.robot))


def draw_mute(profile: StormProfile, robots: int, chance: Random) -> list[str]:
    """Draw the robots that say nothing of traffic."""
    if not profile.mute or chance.random() >= profile.mute:
        return []
    return sorted(chance.sample(robot_names(robots), chance.randint(1, 2)))


def _moments(every: float, chance: Random) -> Iterator[int]:
    time = chance.expovariate(1.0 / every)
    while time < BUSY:
        yield round(time * RATE)
        time += 1.0 + chance.expovariate(1.0 / every)
