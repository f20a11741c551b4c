"""What the world notices about robots by itself at a tick, and tells as events."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from swarm.geometry import Pose
from swarm.maps.occupancy import Point
from swarm.messages import Command, Event
from swarm.messages.naming import long_id, shortened
from world.measure.progress import STALLED
from world.views.standing import why

if TYPE_CHECKING:
    from world.world import World


def told(world: "World", kind: str, text: str, robot: str | None, at: Point | None) -> Event:
    """Return an event of this tick. Of a long id its text has 8 digits, and ``request`` all; ``at`` is in m."""
    return Event(
        run=world.run, tick=world.tick, time=world.time, robot=robot, kind=kind, text=shortened(text), at=at,
        request=long_id(text),
    )  # fmt: skip


def arrivals(world: "World") -> list[Event]:
    """Record the stops that robots are at: by their poses, whatever they say; return an event for each."""
    events = []
    for number, (name, pose) in enumerate(zip(world.robots, world.poses(), strict=True)):
        given_up = world.commands[number].unreachable
        for kind, text in world.missions.tick_off(number, pose, given_up, world.time):
            world.verdict.clear()  # the jam did not stop the whole fleet
            events.append(world.event(kind, text, name))
    return events


def stalls(world: "World", poses: Sequence[Pose]) -> list[Event]:
    """Record who stands; return events about robots that have stops left and make no progress for long."""
    events, stops = [], world.missions.under_way
    world.recorder.stood(stops, world.wheels)
    for number in world.progress.look(world.time, poses, stops):
        stop, reason = world.missions.label(number, world.missions.left[number] or 0), why(world, number)
        text = f"made no progress towards {stop} for {STALLED:g} s{f': {reason}' if reason else ''}"
        events.append(world.event("stalled", text, world.robots[number]))
    return events


def traffic(world: "World", commands: Mapping[str, Command]) -> list[Event]:
    """Return what robots note with their commands, and what the world's own check of traffic finds."""
    events = []
    for name, command in sorted(commands.items()):
        for kind, text in command.notes:
            if world.verdict.take(name, kind, text, world.time):
                events.append(world.event(kind, text, name))
    for fault in world.traffic.look(world.tick, world.poses(), commands, world.commands):
        cells = ", ".join(map(str, fault.where))
        said = f"{fault.kind} of {' and '.join(fault.robots)} in cell {cells}"
        events.append(world.event("traffic_fault", said, fault.robots[0]))
    return events


def errands(world: "World") -> list[Event]:
    """Hand out errands of the pool, and take back those of robots that do not drive to them; return what changed."""
    cells, standing = world.traffic.watch.cells, world.progress.standing(world.time)
    said = world.dispatch.step(world.poses(), cells, world.commands, standing, world.tick)
    if said:
        world.commands = [*map(world.missions.of_these_stops, range(len(world.robots)), world.commands)]
        world.verdict.clear()
        world.due = True
    return [world.event(kind, text, name) for kind, text, name in said]
