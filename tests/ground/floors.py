"""Small floors for edits, and a listener to the broadcasts of robots that drive on them."""

from dataclasses import dataclass, field
from typing import Any

import shapely

from swarm.maps.occupancy import Point
from swarm.messages import Edit, Kind, Sense
from swarm.robot.brain import Inputs, Robot
from swarm.robot.outputs import Outputs
from swarm.scenario.load import Scenario
from tests.shared import scenario_of
from world.simulate import Simulation

TWO_DOORS = """\
############
#....#.....#
#..........#
#....#.....#
#....#.....#
#....#.....#
#..........#
#....#.....#
############
"""
UPPER, LOWER = ((5.2, 6.2), (5.8, 6.8)), ((5.2, 2.2), (5.8, 2.8))  # m, within the two doors


def edit(kind: Kind, corners: tuple[Point, Point]) -> Edit:
    return Edit(kind=kind, low=corners[0], high=corners[1])


def two_doors(text: str = TWO_DOORS, **given: object) -> Scenario:
    """Two rooms, a robot in the left one, a target in the right one and one in the left."""
    fields: dict[str, Any] = {
        "targets": [[9.5, 6.5], [2.5, 2.5]],
        "start": {"poses": [[2.5, 6.5, 0.0], [2.5, 4.5, 0.0]]},
    } | given
    fields["robot"] = {"distance_scale": 0.5}  # the paper's terms would avoid a door of 1 m
    return scenario_of(text, **fields)


@dataclass
class Overheard:
    """A robot, and everything it said."""

    robot: Robot
    said: list[Outputs] = field(default_factory=list)

    def step(self, inputs: Inputs) -> Outputs:
        outputs = self.robot.step(inputs)
        self.said.append(outputs)
        return outputs

    def has_missed_edits(self, sense: Sense) -> bool:
        return self.robot.has_missed_edits(sense)

    def first_plan_from(self, tick: int) -> tuple[int, list[Point]]:
        """Tick and points of the first plan told at that tick or later."""
        return next((o.plan.tick, o.plan.points) for o in self.said if o.plan is not None and o.plan.tick >= tick)


def overhear(simulation: Simulation) -> list[Overheard]:
    """Listen to every robot of a simulation from now on."""
    listeners = [Overheard(robot) for robot in simulation.robots]
    simulation.robots[:] = listeners  # type: ignore[assignment]
    return listeners


def keeps_clear(points: list[Point], radius: float, corners: tuple[Point, Point]) -> bool:
    """Whether a disc that follows the points touches no part of the rectangle: judged by shapely."""
    return not shapely.LineString(points).buffer(radius - 1e-3).intersects(shapely.box(*corners[0], *corners[1]))
