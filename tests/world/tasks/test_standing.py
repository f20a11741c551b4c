"""A robot that stands behind another one for good is blocked, and says by whom: in its command, state, status, events."""

from itertools import pairwise
from typing import Any

import pytest

from swarm.messages import Activity, Liveness, Phase, RobotAction, RobotDo, RobotStatus, Seen
from tests.shared import scenario_of
from world.faults import Faults
from world.simulate import Simulation
from world.tasks.standstill import why
from world.views.status import status
from world.world import World

CORRIDOR, ROOM = ("\n".join(["#" * 12, *["#" + "." * 10 + "#"] * rows, "#" * 12]) + "\n" for rows in (1, 5))


def simulation(text: str, target: tuple[float, float], *, dead: bool = True) -> Simulation:
    """Return two robots: r2 stands at (7.8, 1.8) m, and dies or is told to stop; r1 drives to a target."""
    fields: dict[str, Any] = {
        "map": {"text": text, "cell": 1.2}, "start": {"poses": [[1.8, 1.8, 0.0], [7.8, 1.8, 3.1]]},
        "own_targets": [[list(target)], [[3.0, 1.8]]], "targets": [], "return_home": False,
    }  # fmt: skip
    one = Simulation.of(scenario_of(text, **fields), 2, 1, Faults(killed={"r2": 0.5} if dead else None))
    if not dead:
        one.world.request("r2", RobotAction(do=RobotDo.STOP))
    return one


# fmt: off
CASES = {  # where r2 stands for r1: what is said of it
    "on its target":             (CORRIDOR, (7.8, 1.8),  True,  "r2 (lost) stands on target 1"),
    "on its target in a room":   (ROOM,     (7.8, 1.8),  True,  "r2 (lost) stands on target 1"),
    "in its way":                (CORRIDOR, (11.4, 1.8), True,  "r2 (lost) is in its way to target 1"),
    "told to stop, on its target": (ROOM,   (7.8, 1.8),  False, "r2 (told to stop) stands on target 1"),
}
# fmt: on


def test_a_robot_reaches_a_stop_from_the_cell_beside_if_a_dead_robot_stands_in_that_of_the_stop() -> None:
    one = simulation(ROOM, (7.25, 1.8))
    assert one.run(40.0)["per_robot"]["r1"]["reached"][0] is not None


@pytest.mark.parametrize("name", CASES)
def test_a_robot_that_stands_behind_another_for_good_is_never_seen_driving(name: str) -> None:
    text, target, dead, reason = CASES[name]
    one = simulation(text, target, dead=dead)
    world, events = one.world, []
    standing, before = [], world.poses()[0]
    while world.time < 90.0:
        events += one.step().events
        if world.poses()[0] == before and world.time > 25.0:
            standing.append(
                (
                    world.tasks.commands[0].activity,
                    tuple(world.tasks.commands[0].waits),
                    why(world.tasks, 0, world.poses(), world.tick),
                )
            )
        before = world.poses()[0]
    assert len(standing) > 50 * world.settings.rate
    assert set(standing) == {(Activity.BLOCKED, ("r2",), reason)}
    assert f"made no progress towards target 1 for 60 s: {reason}" in [
        event.text for event in events if (event.robot, event.kind) == ("r1", "stalled")
    ]
    rows = rows_of(world)
    assert (rows["r1"].why, rows["r1"].waits) == (reason, ["r2"])
    assert rows["r2"].why == ""


def rows_of(world: World) -> dict[str, RobotStatus]:
    seen = dict.fromkeys(world.robots, Seen(Liveness.ALIVE, 0.0))
    return {row.robot: row for row in status(world, Phase.RUNNING, "", seen, {}, [], [None, None]).robots}


def test_a_run_in_which_nobody_is_in_the_way_says_nothing() -> None:
    one = simulation(ROOM, (10.2, 1.8))
    reasons = set()
    for _ in pairwise(range(100)):
        one.step()
        reasons.add(why(one.world.tasks, 0, one.world.poses(), one.world.tick))
    assert reasons == {""}
