"""Draws a robot's way through a door whose pose has an error: what it is told, where it takes itself to be, and is."""

from dataclasses import replace
from pathlib import Path
from typing import Final

from msgspec.structs import replace as changed

from docs.drawing import Sheet
from swarm.geometry import Pose, distance
from swarm.scenario.load import load
from swarm.settings import LocalisationSettings
from world.simulate import Simulation

ROOT: Final = Path(__file__).parents[1]
ERROR: Final = LocalisationSettings(error=0.03, yaw_error_deg=1.5)
LOW, HIGH, SCALE = (9.6, 5.4), (15.0, 10.2), 120.0  # m, m, px/m: around the door
UNTIL: Final = 40.0  # s
EVERY: Final = 4  # ticks between two poses that are drawn
TOLD, BELIEVED, TRUE = "#c8662b", "#4a6fa5", "#2f8f4e"


def svg() -> str:
    """Return the picture of r3 in the scenario `doorway`."""
    scenario = load(ROOT / "scenarios" / "doorway.yaml")
    settings = changed(scenario.settings, localisation=ERROR)
    simulation = Simulation.of(replace(scenario, settings=settings), 4, 1)
    told, believed, true, rings = list[Pose](), list[Pose](), list[Pose](), list[tuple[Pose, float]]()
    while not simulation.world.is_finished and simulation.world.time < UNTIL:
        pose = simulation.world.poses()[2]
        tick = simulation.step()
        sense, command = tick.senses["r3"], tick.commands["r3"]
        if not (LOW[0] < pose.x < HIGH[0] and LOW[1] < pose.y < HIGH[1]):
            continue
        told.append(Pose(sense.x, sense.y, sense.yaw))
        true.append(pose)
        x, y, yaw, off = command.believed or (*pose, 0.0)
        believed.append(Pose(x, y, yaw))
        rings.append((believed[-1], off))
    off_told, off_believed = (max(map(distance, poses, true)) for poses in (told, believed))
    lines = (
        f"Orange: what r3 is told, up to {100 * off_told:.0f} cm off. Blue: where it takes itself to be, up to "
        f"{100 * off_believed:.0f} cm off.",
        "Green: where it is. Rings: its body is in them, wherever in its error it is.",
    )
    sheet = Sheet("A robot that knows its pose to 3 cm drives through a door", LOW, HIGH, SCALE, lines)
    sheet.floor(simulation.world.bodies.floor)
    for at, off in rings[:: EVERY * 6]:
        sheet.disc(at[:2], settings.robot.radius + off, f'fill="none" stroke="{BELIEVED}" stroke-dasharray="3 3"')
    for poses, colour, width in ((told, TOLD, 1.0), (true, TRUE, 2.5), (believed, BELIEVED, 1.5)):
        sheet.line([pose[:2] for pose in poses[::EVERY]], f'stroke="{colour}" stroke-width="{width}"')
    return sheet.svg()
