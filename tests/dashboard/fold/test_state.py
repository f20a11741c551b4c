"""The state that all pictures read: which messages are news, what a new run clears, whose radio is needed."""

import pytest
from msgspec.structs import replace

from dashboard.fold.state import ALL, QueuePlace, RunState
from swarm.bus import Arrival, Presence
from swarm.errors import SwarmError
from swarm.messages import CLOCK, Activity, Broadcast, Events, Liveness, Message, Phase, Plan, Truth
from swarm.messages.traffic import Entry, Epoch, JointPlan, Record, TrafficBroadcast
from tests.dashboard.drawn import floor
from tests.dashboard.rehearsal import RATE, Rehearsal
from tests.messages.made import broadcast, clock, event, state, truth

FLOOR = floor(Rehearsal(1))
STATUS = Rehearsal(1).status(20)
SECOND = 11 * RATE  # r1 drives to its second stop, and r2 to its first, by a joint plan


def plan(tick: int, run: int = 1) -> Plan:
    return Plan(robot="a", run=run, tick=tick, points=[(float(tick), 0.0)])


def told(*arrived: object) -> RunState:
    known = RunState()
    for one in arrived:
        known.take(one)
    return known


# fmt: off
NEWS: dict[str, tuple[list[object], object, Message | None]] = {  # what came before, what comes -> the news
    "a clock":                   ([],                                  clock(5),                          clock(5)),
    "what arrives on the wire":  ([],                                  Arrival(CLOCK, {}, clock(5)),      clock(5)),
    "an older clock":            ([clock(9)],                          clock(5),                          None),
    "a robot before the world":  ([],                                  state(5),                          None),
    "a robot":                   ([clock()],                           state(5),                          state(5)),
    "a robot once more":         ([clock(), state(5)],                 state(5),                          None),
    "a robot of a later run":    ([clock()],                           replace(state(5), run=7),          None),
    "a robot of the last run":   ([clock()],                           broadcast(5, run=0),               None),
    "a clock of the last run":   ([clock(10)],                         clock(20, run=0),                  None),
    "an event of the last run":  ([clock(10)],                         event(20, run=0),                  None),
    "a path":                    ([clock(), plan(4)],                  plan(5),                           plan(5)),
    "an older path":             ([clock(), plan(6)],                  plan(5),                           None),
    "a path of another run":     ([clock()],                           plan(5, run=0),                    None),
    "poses":                     ([clock(), truth(4)],                 truth(5),                          truth(5)),
    "poses older than a clock":  ([clock(9), truth(4)],                truth(5),                          truth(5)),
    "poses moved in a pause":    ([clock(), truth(5)],                 truth(5, x=9.0),                   truth(5, x=9.0)),
    "older poses":               ([clock(), truth(6)],                 truth(5),                          None),
    "poses of the last run":     ([clock(), truth(6)],                 truth(9, run=0),                   None),
    "an event":                  ([clock()],                           event(5),                          event(5)),
    "an event once more":        ([clock(), event(5)],                 event(5),                          None),
    "some events once more":     ([clock(), event(5)],                 Events(events=[event(5), event(6)]), Events(events=[event(6)])),
    "all events once more":      ([clock(), event(5)],                 Events(events=[event(5)]),         None),
    "a floor":                   ([],                                  FLOOR,                             FLOOR),
    "a floor once more":         ([FLOOR],                             FLOOR,                             None),
    "a status":                  ([STATUS],                            STATUS,                            STATUS),
    "presence":                  ([clock()],                           Presence("robot", "a", "one", True), None),
    "nothing":                   ([],                                  None,                              None),
}
# fmt: on


@pytest.mark.parametrize("name", NEWS)
def test_what_is_news_and_what_is_none_changes_nothing(name: str) -> None:
    before, comes, news = NEWS[name]
    known = told(*before)
    progress = known.progress
    assert known.take(comes) == news
    assert news is not None or known.progress is progress or isinstance(comes, Presence)


def test_the_newest_of_the_run_is_kept_and_a_new_run_clears_it() -> None:
    known = told(FLOOR, Presence("robot", "a", "one", True), clock(9), truth(6), truth(5), plan(5), plan(9), plan(7))
    assert (known.clock, known.truth, known.paths) == (clock(9), truth(6), {"a": plan(9)})
    assert known.progress.radio_freshness("b") is Liveness.GONE
    known.take(truth(0, run=2))
    assert (known.clock, known.truth, known.paths) == (None, truth(0, run=2), {})
    assert (known.floor, known.progress.order) == (FLOOR, ("a", "b"))
    assert known.progress.tokens == {"a": frozenset({"one"})}


def test_a_floor_that_is_none_is_refused_and_the_one_before_stays() -> None:
    known = told(FLOOR)
    with pytest.raises(SwarmError):
        known.take(replace(FLOOR, packed=replace(FLOOR.packed, cells=b"")))
    assert known.floor == FLOOR


# fmt: off
WANTED: dict[str, tuple[list[Message], set[str], set[str]]] = {  # what is known, who is looked at -> who is heard
    "nobody looks":               ([floor(Rehearsal(3)), Rehearsal(3).truth(SECOND)],      set(),      set()),
    "a member of a joint plan":   ([floor(Rehearsal(3)), Rehearsal(3).truth(SECOND)],      {"r2"},     {"r1", "r2", "r3"}),
    "one on its own way":         ([floor(Rehearsal(3)), Rehearsal(3).truth(SECOND)],      {"r1"},     set()),
    "one who is not there":       ([floor(Rehearsal(3)), Rehearsal(3).truth(SECOND)],      {"nobody"}, set()),
    "a floor that is learned":    ([floor(Rehearsal(3), known=False)],                     set(),      {ALL}),
    "no floor yet":               ([Rehearsal(3).truth(SECOND)],                           {"r2"},     set()),
    "no poses yet":               ([floor(Rehearsal(3))],                                  {"r2"},     set()),
}
# fmt: on


@pytest.mark.parametrize("name", WANTED)
def test_only_robots_whose_plan_somebody_looks_at_are_heard(name: str) -> None:
    known, looked_at, expected = WANTED[name]
    assert told(*known).robots_needed(looked_at) == expected


def test_a_run_that_is_over_is_told_by_the_clock_too() -> None:
    over = clock(9, phase=Phase.OVER)
    known = told(clock(5), over)
    assert (known.clock, known.progress.phase) == (over, Phase.OVER)


NAMES = ("a", "b", "c", "d")
GOAL, BEFORE = 7, {"a": 1, "b": 2, "c": 3, "d": 4}  # cells: of the target, and of each robot before it
EPOCH = Epoch(3, "c")
LEADS_IN = JointPlan(  # c enters the cell of the target first, then a, then b; d comes near it when b has left
    epoch=EPOCH,
    ways={name: (BEFORE[name], GOAL, BEFORE[name]) for name in "abc"} | {"d": (BEFORE["d"], 8)},
    after={"a": (Entry(1, "c", 1),), "b": (Entry(1, "a", 1),), "d": (Entry(1, "b", 1),)},
)
HERE, THERE = (9.0, 9.0), (5.0, 5.0)  # m; two targets


def drives(robot: str, left: float, to: tuple[float, float] = HERE, **changed: object) -> list[Message]:
    """A robot that drives to a target, so far away [m]."""
    return [state(20, robot, distance=left, **changed), Plan(robot=robot, run=1, tick=20, points=[(0.0, left), to])]


def follows(robot: str, left: int = 0) -> Broadcast:
    """A robot of the plan that has left so many cells of its way."""
    plan = LEADS_IN if robot == EPOCH.leader else None
    own = Record(robot=robot, stamp=20, x=0.0, y=0.0, goal=GOAL, epoch=EPOCH, left=left, entered=left, plan=plan)
    return broadcast(20, robot, distance=1.0, traffic=TrafficBroadcast(own=own))


def seen(tick: int = 20) -> Truth:
    (body,) = truth(tick).bodies
    return replace(truth(tick), bodies=[replace(body, robot=name) for name in NAMES])


THREE = [*drives("a", 1.0), *drives("b", 2.0), *drives("c", 3.0)]
PLANNED = [*THREE, *map(follows, "abc"), seen()]

# fmt: off
QUEUES: dict[str, tuple[list[Message], dict[str, QueuePlace]]] = {  # what is known -> the turns
    "nobody has spoken":               ([],                                                        {}),
    "one alone":                       (drives("a", 3.0),                                          {}),
    "each to another place":           ([*drives("a", 3.0), *drives("b", 2.0, THERE)],             {}),
    "by what is left":                 ([*drives("a", 3.0), *drives("b", 2.0)],                    {"b": QueuePlace(1, 2), "a": QueuePlace(2, 2)}),
    "two queues":                      ([*drives("a", 3.0), *drives("b", 2.0), *drives("c", 1.0, THERE), *drives("d", 4.0, THERE)],
                                        {"b": QueuePlace(1, 2), "a": QueuePlace(2, 2), "c": QueuePlace(1, 2), "d": QueuePlace(2, 2)}),
    "other numbers, the same place":   ([*drives("a", 3.0), *drives("b", 2.0, target=1)],          {"b": QueuePlace(1, 2), "a": QueuePlace(2, 2)}),
    "who gives way or is blocked":     ([*drives("a", 3.0, activity=Activity.GIVE_WAY), *drives("b", 2.0, activity=Activity.BLOCKED)],
                                        {"b": QueuePlace(1, 2), "a": QueuePlace(2, 2)}),
    "one was told to stop":            ([*drives("a", 3.0), *drives("b", 2.0, activity=Activity.STOPPED)], {}),
    "one is done":                     ([*drives("a", 3.0), *drives("b", 0.0, activity=Activity.DONE)],    {}),
    "one has no path":                 ([*drives("a", 3.0), state(20, "b")],                       {}),
    "one is silent":                   ([*drives("a", 3.0), *drives("b", 2.0), clock(200, robots=NAMES), *[replace(m, tick=200) for m in drives("a", 3.0)]], {}),
    "by the plan, not by what is left": (PLANNED,                                                  {"c": QueuePlace(1, 3), "a": QueuePlace(2, 3), "b": QueuePlace(3, 3)}),
    "one outside the plan keeps its place": ([*PLANNED, *drives("d", 1.5)],
                                        {"c": QueuePlace(1, 4), "d": QueuePlace(2, 4), "a": QueuePlace(3, 4), "b": QueuePlace(4, 4)}),
    "a plan whose robots were not seen": (PLANNED[:-1],                                            {"a": QueuePlace(1, 3), "b": QueuePlace(2, 3), "c": QueuePlace(3, 3)}),
    "one's way ends near the target": ([*PLANNED, *drives("d", 0.5), follows("d")],
                                        {"c": QueuePlace(1, 4), "a": QueuePlace(2, 4), "b": QueuePlace(3, 4), "d": QueuePlace(4, 4)}),
    "one goes on to another target":   ([*THREE[:4], *drives("c", 3.0, THERE), follows("c", 2), follows("b"), follows("a"), seen()],
                                        {"a": QueuePlace(1, 2), "b": QueuePlace(2, 2)}),
    "the one before it has left the plan": ([*THREE, follows("c", 2), follows("b"), broadcast(20, "a", distance=1.0), seen()],
                                        {"a": QueuePlace(1, 3), "c": QueuePlace(2, 3), "b": QueuePlace(3, 3)}),
}
# fmt: on


@pytest.mark.parametrize("name", QUEUES)
def test_robots_with_one_target_have_turns(name: str) -> None:
    known, turns = QUEUES[name]
    assert told(FLOOR, clock(20, robots=NAMES), *known).turns() == turns
