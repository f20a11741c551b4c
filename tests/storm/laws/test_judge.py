"""Each law finds its own violation and no other; the violations are planted into a run that keeps all laws."""

from collections.abc import Callable
from dataclasses import replace
from math import cos, sin, sqrt
from typing import NoReturn

import pytest
from msgspec.structs import replace as changed

from swarm.messages import Assigned, Broadcast, Command, Event
from swarm.messages.traffic import Claim, Epoch, JointPlan, Record, Relayed, Sighting
from swarm.storm.history.history import History, Moment, record
from swarm.storm.history.run_facts import PUT_BACK, cells_at
from swarm.storm.laws.judge import LAWS, judge
from swarm.storm.laws.mission import nobody_stands_unnamed
from swarm.storm.results import is_silent
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from tests.storm.shared import plan_of, short_run, with_commands, with_moments, with_report, with_words
from world.bodies.shapes import Contact
from world.faults import Health
from world.simulate import Simulation

TICK = 60  # by then both robots drive
LATER = 2000  # ticks, 100 s
ENOUGH = 165  # ticks of silence after which nobody waits for an answer; the run is longer


def held(history: History, robot: str, tick: int = TICK) -> set[int]:
    return set(history.moments[tick].commands[robot].held)


def far_cell(history: History) -> int:
    """Find a cell of the floor that nobody holds."""
    cells = {cell for moment in history.moments for command in moment.commands.values() for cell in command.held}
    return min(cells - held(history, "r1") - held(history, "r2"))


def holding(history: History, robot: str, cell: int, **fields: object) -> History:
    """Let a robot hold a cell more for one tick."""

    def change(tick: int, name: str, command: Command) -> Command:
        if (tick, name) != (TICK, robot):
            return command
        return changed(command, held=sorted({*command.held, cell}), **fields)

    return with_commands(history, change)


def with_own(words: Broadcast, **fields: object) -> Broadcast:
    """Return a broadcast whose record of its own robot says something else."""
    assert words.traffic is not None
    return changed(words, traffic=changed(words.traffic, own=changed(words.traffic.own, **fields)))


def with_sense(moment: Moment, robot: str, **fields: object) -> Moment:
    """Return a moment in which a robot senses something else."""
    return moment._replace(senses={**moment.senses, robot: changed(moment.senses[robot], **fields)})


def overlap(history: History) -> History:
    return holding(history, "r1", min(held(history, "r2")), unconstrained=True)


def unclaimed(history: History) -> History:
    return holding(history, "r1", far_cell(history))


def hearing(history: History, change: Callable[[list[tuple[str, int]]], list[tuple[str, int]]]) -> History:
    """Let r2 hear something else than what was sent, once."""
    tick = next(moment.tick for moment in history.moments if moment.tick >= TICK and moment.senses["r2"].hears)

    return with_moments(
        history, lambda m: with_sense(m, "r2", hears=change(m.senses["r2"].hears)) if m.tick == tick else m
    )


def deafened(history: History) -> History:
    return hearing(history, lambda pairs: [])


def misdated(history: History) -> History:
    """What a late answer once did: the world named its own tick, not that of the broadcast."""
    return hearing(history, lambda pairs: [(name, tick + 1) for name, tick in pairs])


def deaf_ear(history: History) -> History:
    """Nobody acknowledges anything."""
    return with_words(history, lambda name, words: with_own(words, acks=()))


def claimed(history: History, robot: str, change: Callable[[Claim], Claim]) -> History:
    """Let a robot say other claims than it made, in the last record that has any."""
    said = [m.tick for m in history.moments if robot in m.spoken and claims_of(m.spoken[robot])]

    def alter(moment: Moment) -> Moment:
        if moment.tick != said[-1]:
            return moment
        words = moment.spoken[robot]
        first, *others = claims_of(words)
        return moment._replace(spoken={**moment.spoken, robot: with_own(words, claims=(change(first), first, *others))})

    return with_moments(history, alter)


def claims_of(words: Broadcast) -> tuple[Claim, ...]:
    return tuple(words.traffic.own.claims) if words.traffic is not None else ()


def agreeing(history: History, more: Callable[[Record, Claim], dict[str, object]]) -> History:
    """Let r2 say something more of itself in the first record in which it agrees to a claim of r1."""
    done = False
    said = {claim.number: claim for m in history.moments if "r1" in m.spoken for claim in claims_of(m.spoken["r1"])}

    def change(name: str, words: Broadcast) -> Broadcast:
        nonlocal done
        assert words.traffic is not None
        acks = [number for robot, number in words.traffic.own.acks if robot == "r1"]
        if name != "r2" or not acks or done:
            return words
        done = True
        return with_own(words, **more(words.traffic.own, said[acks[0]]))

    return with_words(history, change)


def saying(history: History, robot: str, tick: int, more: Callable[[Record], dict[str, object]]) -> History:
    """Let a robot say something more of itself from a tick on."""

    def alter(moment: Moment) -> Moment:
        words = moment.spoken.get(robot)
        if words is None or words.traffic is None or moment.tick < tick:
            return moment
        return moment._replace(spoken={**moment.spoken, robot: with_own(words, **more(words.traffic.own))})

    return with_moments(history, alter)


def early_claim(history: History) -> History:
    """Let r1 claim a cell in its first record."""
    claim = Claim(far_cell(history), 10**6, 0)
    return saying(history, "r1", 0, lambda own: {"claims": (claim,)} if own.stamp < 10 else {})


def claimed_twice(history: History) -> History:
    """Let r1 claim each cell once more, for a way that comes to it twice."""
    again = 10**6  # beyond the numbers it used

    def more(own: Record) -> dict[str, object]:
        later = [Claim(claim.cell, claim.number + again, claim.stamp) for claim in own.claims]
        return {"claims": (*own.claims, *later)}

    return saying(history, "r1", 0, more)


def standing(history: History) -> History:
    """Let r1 stand for a plan whenever it claims something."""
    return saying(history, "r1", TICK, lambda own: {"frozen": Epoch(1, "r1")} if own.claims else {})


def told_of_a_third(history: History, seen: tuple[Sighting, ...] = ()) -> History:
    """Let r2 pass on that r3, which nobody else heard of, holds what r1 takes later."""
    taken = {claim.cell for m in history.moments if "r1" in m.spoken for claim in claims_of(m.spoken["r1"])}
    third = Record(robot="r3", stamp=0, held=tuple(sorted(taken)), x=0.0, y=0.0, goal=0)

    def change(name: str, words: Broadcast) -> Broadcast:
        assert words.traffic is not None
        own = changed(words.traffic.own, seen=tuple(one._replace(cell=cell) for one in seen for cell in sorted(taken)))
        return changed(words, traffic=changed(words.traffic, own=own, others=(Relayed(1, third),)))

    return with_words(history, lambda name, words: change(name, words) if name == "r2" else words)


def waiting_for_the_silent(history: History, ahead: Callable[[], tuple[int, ...]] = tuple) -> History:
    """Let r2 be silent all along, though its body drives, and r1 wait for it."""
    history = with_moments(history, lambda m: m._replace(health={**m.health, "r2": Health.SUSPENDED}))
    return saying(history, "r1", ENOUGH, lambda own: {"waits": ("r2",), "ahead": ahead()})


def waiting_for_its_turn(history: History) -> History:
    """Let r1 wait for a cell that the silent r2 comes through by a joint plan which it has told."""
    cell = far_cell(history)
    agreed = JointPlan(epoch=Epoch(1, "r2"), ways={"r2": (cell,)}, after={})
    history = saying(history, "r2", 0, lambda own: {"epoch": agreed.epoch, "plan": agreed})
    return waiting_for_the_silent(history, lambda: (cell,))


def outside(history: History) -> History:
    """From a tick on, r1 holds nothing of what it is in."""

    def change(tick: int, name: str, command: Command) -> Command:
        return changed(command, held=[]) if tick >= TICK and name == "r1" else command

    return with_commands(history, change)


def too_fast(history: History) -> History:
    """r1 drives so fast straight on that it comes to rest in the first cell there that it does not hold."""
    cells, robot = cells_at(history, TICK), history.settings.robot
    x, y, yaw = history.moments[TICK].poses[0]
    ways = [0.1 * step for step in range(200)]  # m
    ahead = [(way, cells.cell_of(x + way * cos(yaw), y + way * sin(yaw))) for way in ways]
    way = next(way for way, cell in ahead if cell not in {OUTSIDE, *held(history, "r1")})
    speed = sqrt(2 * robot.wheel_acceleration * (way + robot.radius))

    return with_moments(history, lambda m: with_sense(m, "r1", linear=speed, angular=0.0) if m.tick == TICK else m)


def taken_back(history: History) -> History:
    """r1 says for one tick that it has arrived."""

    def change(tick: int, name: str, command: Command) -> Command:
        return changed(command, reached=[True]) if (tick, name) == (TICK, "r1") else command

    return with_commands(history, change)


def never_there(history: History) -> History:
    history = with_report(history, "r2", reached=[None])
    traffic = history.report["traffic"] | {"settling": 0.0}
    return with_report(history, complete=False, reason="not reached: r2 target 1", traffic=traffic)


def never_over(history: History) -> History:
    """Both stand where they are for 125 s more."""
    *_, before, last = history.moments
    more = [
        before._replace(tick=last.tick + tick, events=(), senses={}, commands={}, spoken={}) for tick in range(2500)
    ]
    history = replace(history, moments=[*history.moments[:-1], *more, last._replace(tick=last.tick + 2500)])
    ticks = history.report["ticks"] + 2500
    traffic = history.report["traffic"]
    longer = traffic | {"settling": traffic["settling"] + 2500 * history.dt}
    return with_report(history, ticks=ticks, sim_time=ticks * history.dt, traffic=longer)


def said_unsolvable(history: History) -> History:
    event = Event(run=0, tick=TICK, time=3.0, robot="r1", kind="unsolvable", text="no way out")
    return with_moments(history, lambda m: m._replace(events=(*m.events, event)) if m.tick == TICK else m)


def later(moment: Moment) -> Moment:
    senses = {
        name: changed(sense, hears=[(sender, tick + LATER) for sender, tick in sense.hears])
        for name, sense in moment.senses.items()
    }
    return moment._replace(tick=moment.tick + LATER, senses=senses)


def stood_first(history: History) -> History:
    """Both stood 100 s before they began, and nobody said so."""
    first, *others = history.moments
    moments = [first._replace(tick=tick, spoken={}) for tick in range(LATER)]
    moments += [later(moment) for moment in (first, *others)]
    history = replace(history, moments=moments)
    for robot in history.robots:
        row = history.report["per_robot"][robot]
        history = with_report(history, robot, reached=[time + LATER * history.dt for time in row["reached"]])
    ticks = history.report["ticks"] + LATER
    return with_report(history, ticks=ticks, sim_time=ticks * history.dt)


def path_length(history: History) -> float:
    length: float = history.report["per_robot"]["r1"]["path_length"]
    return length


def unheard_of_scale(history: History) -> History:
    return with_commands(
        history, lambda tick, name, command: changed(command, scale=0.001) if name == "r1" else command
    )


def backwards(name: str, words: Broadcast) -> Broadcast:
    return changed(words, distance=-1.0) if name == "r1" else words


def sensing(history: History, from_tick: int, **fields: object) -> History:
    """Change what r1 senses from a tick on."""

    def plant(moment: Moment) -> Moment:
        if moment.tick < from_tick or "r1" not in moment.senses:
            return moment
        return with_sense(moment, "r1", **fields)

    return with_moments(history, plant)


def older_number(history: History) -> History:
    first = sensing(history, 0, assigned=Assigned(number=2, stops=[]))
    return sensing(first, TICK, assigned=Assigned(number=1, stops=[]))


# fmt: off
PLANTED: list[tuple[str, str, Callable[[History], History]]] = [  # what, the law that speaks, how to plant it
    ("an exception", "no exception", lambda h: replace(h, crash="Traceback\nValueError: no such cell")),
    ("a wall touched", "no contact", lambda h: replace(h, contacts=[(TICK, Contact(0, "wall", None), True)])),
    ("a robot touched", "no contact", lambda h: replace(h, contacts=[(TICK, Contact(0, "robot", 1), True)])),
    ("a cell held twice", "no overlap", overlap),
    ("a cell out of nowhere", "no hold without a claim", unclaimed),
    ("a claim nobody agreed to", "no hold without a claim", deaf_ear),
    ("a number used again", "claims numbered once",
     lambda h: claimed(h, "r1", lambda claim: claim._replace(stamp=claim.stamp - 1))),
    ("agreed although held", "no false agreement", lambda h: agreeing(h, lambda own, claim: {"held": (*own.held, claim.cell)})),
    ("agreed although claimed before", "no false agreement",
     lambda h: agreeing(h, lambda own, claim: {"claims": (*own.claims, Claim(claim.cell, 10**6 + claim.number, -1))})),
    ("a claim at once", "listens first", early_claim),
    ("claimed while it stands for a plan", "no claim while standing", standing),
    ("taken although another one holds it", "takes only what is free", told_of_a_third),
    ("waits for the silent", "no wait for the silent", waiting_for_the_silent),
    ("a body outside", "no body outside", outside),
    ("a body outside a second after a new world has put it elsewhere", "no body outside",
     lambda h: outside(replace(h, put_back={0: [TICK - PUT_BACK - 1]}))),
    ("too fast to stop", "room to brake", too_fast),
    ("a flag taken back", "flags stay", taken_back),
    ("a stop not reached", "all arrive", never_there),
    ("a mission without end", "it ends", never_over),
    ("a stop given up", "truthful", lambda h: with_report(h, "r1", unreachable=[0])),
    ("called unsolvable", "truthful", said_unsolvable),
    ("100 s of silence", "nobody stands unnamed", stood_first),
    ("a stall counted only", "nobody stands unnamed", lambda h: with_report(h, "r1", stalled=1)),
    ("the time", "the report agrees", lambda h: with_report(h, sim_time=h.report["sim_time"] + 1.0)),
    ("the ticks", "the report agrees", lambda h: with_report(h, ticks=h.report["ticks"] + 1)),
    ("complete", "the report agrees", lambda h: with_report(h, complete=False, reason="somebody")),
    ("a path too long", "the report agrees", lambda h: with_report(h, "r1", path_length=1.01 * path_length(h))),
    ("a stop reached too soon", "the report agrees", lambda h: with_report(h, "r1", reached=[1.0])),
    ("a gap too wide", "the report agrees", lambda h: with_report(h, clearance_min=h.report["clearance_min"] + 9.0)),
    ("stops that nobody asked for", "orders are kept", lambda h: sensing(h, TICK, assigned=Assigned(number=1, stops=[(9.0, 9.0)]))),
    ("an older number", "orders are kept", older_number),
    ("it drives although it was stopped", "orders are kept", lambda h: sensing(h, 0, stopped=True)),
    ("an errand that nobody knows", "the pool is kept",
     lambda h: replace(h, settings=changed(h.settings, pool=[(9.0, 1.8)]))),
    ("a command that no world would take", "passes the wire", unheard_of_scale),
    ("a broadcast that no robot would take", "passes the wire", lambda h: with_words(h, backwards)),
    ("a broadcast that nobody hears", "broadcasts are heard", deafened),
    ("a broadcast heard as of another tick", "broadcasts are heard", misdated),
]
# fmt: on


def test_the_run_itself_keeps_every_law() -> None:
    history = short_run()
    assert judge(history) == []
    assert history.report["complete"]
    assert len(history.moments) > max(2 * TICK, ENOUGH + 20)


@pytest.mark.parametrize(("law", "plant"), [row[1:] for row in PLANTED], ids=[row[0] for row in PLANTED])
def test_exactly_that_law_speaks_of_a_planted_violation(law: str, plant: Callable[[History], History]) -> None:
    found = judge(plant(short_run()))
    assert {violation.law for violation in found} == {law}, found


def test_every_law_has_a_planted_violation() -> None:
    elsewhere = {"nobody is overtaken for ever"}  # in test_fairness.py: a robot kept from its stop breaks others too
    assert {law for _, law, _ in PLANTED} | elsewhere == set(LAWS)


# fmt: off
EXCUSED: list[tuple[str, Callable[[History], History]]] = [
    ("who could not have stopped is not to blame",
     lambda h: replace(h, contacts=[(TICK, Contact(0, "robot", 1), False)])),
    ("who drives unconstrained claims nothing", lambda h: holding(h, "r1", far_cell(h), unconstrained=True)),
    ("a cell may be claimed for two steps of a way", claimed_twice),
    ("who was pushed may be anywhere",
     lambda h: outside(replace(h, contacts=[(TICK, Contact(0, "robot", 1), False)], moments=h.moments[: TICK + 50],
                               report={}))),
    ("whom a new world puts elsewhere may be outside for a second",
     lambda h: outside(replace(h, put_back={0: [TICK]}, moments=h.moments[: TICK + PUT_BACK - 1], report={}))),
    ("what a look found empty may be taken", lambda h: told_of_a_third(h, (Sighting(0, empty=True, tick=1),))),
    ("a silent robot's cells are waited for", lambda h: waiting_for_the_silent(h, lambda: (min(held(h, "r2", -2)),))),
    ("a silent member keeps its turns", waiting_for_its_turn),
    ("a new run begins without flags",
     lambda h: with_commands(
         h, lambda tick, name, c: changed(c, run=1, reached=[False]) if tick == h.moments[-2].tick else c)),
]
# fmt: on


@pytest.mark.parametrize("plant", [row[1] for row in EXCUSED], ids=[row[0] for row in EXCUSED])
def test_what_is_no_fault_is_not_called_one(plant: Callable[[History], History]) -> None:
    assert judge(plant(short_run())) == []


def test_no_way_at_all_is_said_only_if_the_cells_leave_no_floor_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a hall of two lanes two can pass. A lattice shifted by half a cell has one lane: they cannot pass on it."""
    swap: dict[str, object] = {
        "map": {"text": "#######\n#.....#\n#.....#\n#######\n", "cell": 1.2},
        "start": {"poses": [[2.4, 2.4, 0.0], [6.0, 2.4, 3.0]]},
        "own_targets": [[[6.0, 2.4]], [[2.4, 2.4]]],
        "traffic": {"cell": 1.2, "offset": [-0.6, -0.6]},
    }
    assert not judge(record(plan_of(**swap))), "it is said of this lattice"
    monkeypatch.setattr(CellMap, "has_unused_floor", property(lambda cells: False))
    found = sorted(judge(record(plan_of(**swap))))
    assert {(violation.law, violation.robots) for violation in found} == {
        ("all arrive", (name,)) for name in ("r1", "r2")
    }
    assert "no way exists for r1, but a way leads to" in found[0].text


def test_the_dead_need_not_arrive() -> None:
    """r1 dies at once, in its own row: r2 has a way."""
    history = record(plan_of(faults=[{"robot": "r1", "kind": "dead", "tick": 20}]))
    assert judge(history) == []
    assert not history.report["complete"]
    assert history.moments[-2].health["r1"] is Health.DEAD
    assert not is_silent(history)


def test_a_run_that_ends_early_and_names_nobody_is_silent() -> None:
    assert is_silent(never_there(short_run()))
    assert not is_silent(short_run())
    assert not is_silent(said_unsolvable(never_there(short_run())))


ONE_LANE = "#" * 18 + "\n" + "#" * 18 + "\n" + "#" * 18 + "\n"
ONE_LANE += ("###" + "." * 12 + "###\n") * 3 + ONE_LANE  # four cells in a row


def test_a_run_that_stands_for_good_counts_a_deadlock() -> None:
    """Two must pass each other in a lane: then both stand, are named, and the report may not say 0 deadlocks."""
    swap: dict[str, object] = {
        "map": {"text": ONE_LANE, "cell": 0.4},
        "start": {"poses": [[1.8, 1.8, 0.0], [5.4, 1.8, 3.0]]},
        "own_targets": [[[5.4, 1.8]], [[1.8, 1.8]]],
    }
    history = record(plan_of(**swap))
    assert history.report["traffic"]["deadlocks"] == 1
    *_, before, last = history.moments
    named = [
        Event(run=0, tick=last.tick + 1300, time=0.0, robot=robot, kind="stalled", text="") for robot in ("r1", "r2")
    ]
    more = [
        before._replace(tick=last.tick + tick, events=tuple(named) if tick == 1300 else ()) for tick in range(LATER)
    ]
    stood = replace(history, moments=[*history.moments[:-1], *more, last._replace(tick=last.tick + LATER)])
    stood = with_report(with_report(stood, "r1", stalled=1), "r2", stalled=1)
    assert not list(nobody_stands_unnamed(stood))
    silent = with_report(stood, traffic=history.report["traffic"] | {"deadlocks": 0})
    assert [text for _, _, text in nobody_stands_unnamed(silent)] == [
        "nobody has made progress for 90 s, and the report counts no deadlock"
    ]


def test_a_run_whose_first_step_fails_is_told_by_one_law(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(_: Simulation) -> NoReturn:
        raise RuntimeError("planted")

    monkeypatch.setattr(Simulation, "step", fails)
    pools: tuple[dict[str, object], ...] = ({}, {"pool": [[9.0, 1.8]]})
    for pool in pools:
        history = record(plan_of(**pool))
        assert not history.moments
        assert [violation.law for violation in judge(history)] == ["no exception"]
