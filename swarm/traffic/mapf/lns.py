"""Makes a joint plan quicker: takes a few robots out of it and finds new ways for them past the others.

Large neighbourhood search (MAPF-LNS: Li et al., IJCAI 2021). The new ways are found one robot after the other, each
through the times in which cells are free.
"""

from math import isinf
from random import Random
from typing import Final

import numpy as np

from swarm.traffic.lattice.distances import neighbour_tables
from swarm.traffic.mapf.lacam import Vias
from swarm.traffic.mapf.pibt import Floors, Joined, Tables
from swarm.traffic.mapf.schedule import NONE, Schedule, reroute

MOST_OUT: Final = 5  # robots taken out at once


class PlanImprover:
    """Changes of plans; ``pops`` counts the expansions.

    ``floors`` are the cells that are joined for each robot, by default ``neighbours`` for all.
    """

    def __init__(
        self, neighbours: Joined, tables: Tables, random: Random, vias: Vias = (), floors: Floors = ()
    ) -> None:
        self.pops = 0
        self._random = random
        unlike = list({id(floor): floor for floor in floors or [neighbours]}.values())
        self._joined = neighbour_tables(unlike)
        numbers = {id(floor): number for number, floor in enumerate(unlike)}
        self._floor_of = np.array([numbers[id(floor)] for floor in floors or [neighbours] * len(tables)], np.int64)
        self._tables = np.array([tables, tables], np.int64).transpose(1, 0, 2).copy()
        self._visits = np.full(len(tables), NONE)
        for robot, via in enumerate(vias):
            if via is not None:
                self._visits[robot] = cell = via.index(0)
                self._tables[robot, 1] = np.array(via, np.int64) + tables[robot][cell]

    def replan_robots(self, plan: Schedule) -> Schedule | None:
        """Return the plan with new ways for some robots, or None if one of them finds no way."""
        robots = range(len(plan.ways))
        out = self._random.sample(robots, self._random.randint(1, min(MOST_OUT, len(robots))))
        ways, lengths, times = plan.ways.copy(), plan.lengths.copy(), plan.times.copy()
        last, total, pops = reroute(
            np.array(out), ways, lengths, times, self._joined, self._floor_of, self._tables, self._visits,
            self._random.getrandbits(31), plan.corner, plan.paces,
        )  # fmt: skip
        self.pops += pops
        return None if isinf(last) else Schedule(ways, lengths, times, last, total, plan.corner, plan.paces)
