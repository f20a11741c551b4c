"""The input of the world's traffic watch: true poses and the robots' declarations, only while they are repeated."""

import msgspec

from swarm.geometry import Pose
from swarm.messages import Activity, Command
from swarm.traffic.lattice.cell_map import OUTSIDE
from tests.shared import ROOM, scenario_of
from world.measure.cell_watch import TrafficWatch
from world.tasks.tasks import REST
from world.world import World

SCENARIO = scenario_of(traffic={"cell": 1.0, "offset": [0.0, 0.0]})
COLUMNS = 10
HERE, BESIDE, THERE = 3 * COLUMNS + 2, 3 * COLUMNS + 3, 3 * COLUMNS + 6  # cells of the room, 1 m wide
AT = {HERE: Pose(2.5, 3.5, 0.0), BESIDE: Pose(3.5, 3.5, 0.0), THERE: Pose(6.5, 3.5, 0.0)}


def say(*held: int, activity: Activity = Activity.DRIVE, waits: tuple[str, ...] = (), notes: int = 0) -> Command:
    plans = [("joint_plan", "leads 2 robots")] * notes
    return msgspec.structs.replace(REST, held=list(held), activity=activity, waits=list(waits), notes=plans)


def watch() -> TrafficWatch:
    return TrafficWatch(SCENARIO.map, SCENARIO.settings, ("r1", "r2"))


def test_true_poses_are_judged_by_what_was_declared_last() -> None:
    watching = watch()
    poses = [AT[HERE], AT[THERE]]
    last = [say(HERE), say(THERE)]
    assert watching.look(0, poses, {"r1": last[0], "r2": last[1]}, last) == []
    (fault,) = watching.look(1, [AT[BESIDE], AT[THERE]], {}, last)
    assert fault == (1, "outside", ("r1",), (BESIDE,)), "though it has said nothing new"
    (fault,) = watching.look(2, poses, {"r2": say(THERE, HERE)}, [last[0], say(THERE, HERE)])
    assert fault == (2, "overlap", ("r1", "r2"), (HERE,))


def test_who_has_not_spoken_yet_is_not_judged() -> None:
    assert watch().look(0, [AT[HERE], AT[HERE]], {}, [REST, REST]) == []
    watching = watch()
    assert watching.look(0, [AT[HERE], Pose(-9.0, 0.0, 0.0)], {}, [say(HERE), REST]) == []
    (fault,) = watching.look(1, [AT[HERE], Pose(-9.0, 0.0, 0.0)], {}, [say(HERE), say(THERE)])
    assert (*fault[:3], set(fault.where)) == (1, "outside", ("r2",), {OUTSIDE})


def test_who_is_done_or_not_told_to_go_waits_for_nobody() -> None:
    for activity, conflicts in (
        (Activity.DRIVE, 1), (Activity.GIVE_WAY, 1), (Activity.BLOCKED, 1), (Activity.DONE, 0), (Activity.READY, 0),
    ):  # fmt: skip
        watching = watch()
        last = [say(HERE, waits=("r2",), activity=activity), say(THERE)]
        watching.look(0, [AT[HERE], AT[THERE]], {}, last)
        assert watching.watch.state.conflicts == conflicts, activity


def test_who_moves_is_known_from_its_poses() -> None:
    watching = watch()
    last = [say(HERE), say(THERE)]
    for tick in range(6):  # r1 turns from the 3rd tick on, r2 stands
        watching.look(tick, [AT[HERE]._replace(yaw=max(0.0, 0.1 * (tick - 1))), AT[THERE]], {}, last)
    dt = 1.0 / SCENARIO.settings.rate
    assert watching.watch.state.longest_wait == 6 * dt
    moving = watch()
    for tick in range(6):
        moving.look(tick, [AT[HERE]._replace(yaw=0.1 * tick), AT[THERE]._replace(x=6.5 + 1e-9 * tick)], {}, last)
    assert moving.watch.state.longest_wait == dt, "of the first tick, before which nothing is known"


def test_a_note_counts_when_it_comes_and_not_again_while_the_command_lasts() -> None:
    watching = watch()
    told, last = say(HERE, notes=2), [say(HERE, notes=2), say(THERE)]
    watching.look(0, [AT[HERE], AT[THERE]], {"r1": told}, last)
    watching.look(1, [AT[HERE], AT[THERE]], {}, last)
    assert watching.watch.state.joint_plans == 2


def test_a_fault_is_an_event_of_the_run() -> None:
    world = World(SCENARIO, [AT[HERE], AT[THERE]], 1)
    commands = {"r1": say(HERE), "r2": say(THERE, HERE, BESIDE)}
    assert [(event.kind, event.robot, event.text) for event in world.step(commands)] == [
        ("traffic_fault", "r1", f"overlap of r1 and r2 in cell {HERE}")
    ]
    assert world.step(commands) == []


def test_after_an_edit_bodies_are_judged_on_the_new_floor() -> None:
    watching = watch()
    wider = scenario_of("#" * 10 + "\n" + ROOM, traffic={"cell": 2.0, "offset": [0.0, 0.0]})
    watching.set_floor(wider.map, wider.settings)
    place = Pose(3.0, 3.0, 0.0)  # in the middle of the second cell of the second row, 5 cells a row
    assert watching.look(0, [place, AT[THERE]], {}, [say(1 * 5 + 1), REST]) == []
