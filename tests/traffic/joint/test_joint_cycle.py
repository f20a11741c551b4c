"""The life of a joint plan, tick by tick: who is asked, who waits for whom, for how long, and who is reported."""

import re
from collections.abc import Mapping

import pytest
from msgspec.structs import replace

from swarm.messages.traffic import Claim, Collect, Epoch, JointPlan, Record, Refusal
from swarm.traffic.joint import protocol as joint_planning
from swarm.traffic.joint.protocol import ANY_CALL, CALLS, PLANS, JointPlanning, Occasion, Transition, Types
from swarm.traffic.joint.states import (
    SETTLE,
    BroadcastTurn,
    Free,
    PlanDrop,
    PlanningMemory,
    PlanningStop,
    PublishedPlan,
    TransitionResult,
    WakeUp,
)
from swarm.traffic.peers.records import TrafficNote
from swarm.traffic.peers.situation import Situation
from swarm.traffic.settings import TrafficConstants
from tests.traffic.maps import Drawn

FLOOR = Drawn("abcd", "....")
A, B, C, D = FLOOR.at("abcd")
SETTINGS = TrafficConstants()
NOW = 1000


def record(robot: str, cell: int, tick: int = NOW, **fields: object) -> Record:
    x, y = FLOOR.cells.centre(cell)
    return replace(Record(robot=robot, stamp=tick, x=x, y=y, goal=cell, held=(cell,)), **fields)


def situation(
    tick: int, fresh: Mapping[str, Record], head: int = A, goal: int = B, *, floor: Drawn = FLOOR
) -> Situation:
    return Situation(tick=tick, cells=floor.cells, head=head, goal=goal, others=fresh, fresh=fresh)


def robot(me: str) -> JointPlanning:
    return JointPlanning(me, SETTINGS)


# --- the table ---


def drawn_arrows() -> list[tuple[str, str, str]]:
    """Read the drawing of both machines: (state, what happens, next state)."""
    arrows = []
    for line in (joint_planning.__doc__ or "").splitlines():
        parts = re.split(r" --(.+?)--> ", line.strip())
        for number in range(0, len(parts) - 2, 2):
            states, happenings, to = (part.split(", ") for part in parts[number : number + 3])
            arrows += [(one, happens, to[0]) for one in states for happens in happenings]
    return arrows


def names(types: Types) -> list[str]:
    every = types if isinstance(types, tuple) else (types,)
    return ["none" if one is type(None) else one.__name__ for one in every]


def test_the_drawing_shows_the_tables() -> None:
    arrows = [
        (state, row.happens.__name__, "as before" if row.to == row.of and len(names(row.of)) > 1 else names(row.to)[0])
        for row in (*CALLS, *PLANS)
        for state in names(row.of)
    ]
    assert sorted(drawn_arrows()) == sorted(arrows)
    assert len(set(arrows)) == len(arrows)


@pytest.fixture(autouse=True)
def each_transition_leads_where_the_tables_say(monkeypatch: pytest.MonkeyPatch) -> None:
    def checked(row: Transition) -> Transition:
        def happens(memory: PlanningMemory, state: object, occasion: Occasion) -> TransitionResult | None:
            move = row.happens(memory, state, occasion)
            assert move is None or (move.to == state if row.to == ANY_CALL else isinstance(move.to, row.to))
            return move

        return row._replace(happens=happens)

    for name, table in (("CALLS", CALLS), ("PLANS", PLANS)):
        monkeypatch.setattr(joint_planning, name, tuple(checked(row) for row in table))


# --- who is asked ---


def stuck(me: str, tick: int = NOW) -> Record:
    """What a robot is about to tell that needs a plan: r1 or r2, beside it, has stood in its way for long."""
    return record(me, A, tick, ahead=(B,), waits=("r1", "r2", "r3"), moved=tick - SETTINGS.stuck - 1)


def asked_by(joint: JointPlanning, own: Record, known: Situation) -> str | None:
    """Return the robot that is asked to lead in the record that is about to be sent."""
    joint.handle_occasion(BroadcastTurn(own.robot, own.held, own.ahead, own.waits, joint.epoch, own.moved, known))
    return joint.leader_asked


def test_the_lowest_id_in_hearing_is_asked_me_included() -> None:
    for me, heard, asked in (("r2", "r3", "r2"), ("r2", "r1", "r1"), ("r2", "r3 r1", "r1")):
        near = situation(NOW, {name: record(name, C) for name in heard.split()})
        assert asked_by(robot(me), stuck(me), near) == asked, heard


def test_who_needs_no_plan_asks_nobody() -> None:
    joint, near = robot("r2"), situation(NOW, {"r1": record("r1", C)})
    assert asked_by(joint, stuck("r2"), near) == "r1"
    assert asked_by(joint, replace(stuck("r2"), ahead=()), near) is None
    joint.handle_occasion(situation(NOW, {"r1": called()}))
    assert asked_by(joint, stuck("r2"), near) is None, "it stands for one"


def test_who_does_not_answer_is_passed_over_for_a_while() -> None:
    joint = robot("r3")
    near = {name: record(name, C) for name in ("r1", "r2")}
    asked = [
        asked_by(joint, stuck("r3", NOW + tick), situation(NOW + tick, near)) for tick in range(SETTINGS.unanswered + 2)
    ]
    assert asked == ["r1"] * (SETTINGS.unanswered + 1) + ["r2"]
    near = {name: record(name, C, NOW + SETTINGS.pass_over) for name in ("r1", "r2")}
    until = NOW + SETTINGS.unanswered + SETTINGS.pass_over
    for tick, again in ((until, "r2"), (until + 1, "r1")):
        assert asked_by(joint, stuck("r3", tick), situation(tick, near)) == again, tick


# --- standing for a call ---

CALL = Epoch(NOW - 3, "r1")


def called(tick: int = NOW, leader: str = "r1", members: tuple[str, ...] = ("r1", "r2"), at: int = NOW - 3) -> Record:
    return record(leader, C, tick, collect=Collect(Epoch(at, leader), members))


def test_who_is_called_stands_until_the_leader_gives_up() -> None:
    joint = robot("r2")
    joint.handle_occasion(situation(NOW, {"r1": called(members=("r1", "r3"))}))
    assert joint.call_epoch is None, "that call was not for me"
    joint.handle_occasion(situation(NOW, {"r1": called()}))
    assert joint.call_epoch == CALL
    joint.handle_occasion(situation(NOW + 1, {"r1": called(NOW + 1)}))
    assert joint.call_epoch == CALL
    joint.handle_occasion(situation(NOW + 2, {"r1": record("r1", C, NOW + 2)}))
    assert joint.call_epoch is None
    joint.handle_occasion(situation(NOW + 3, {"r1": called(NOW + 3)}))
    assert joint.call_epoch is None, "a call once given up is spent"
    joint.handle_occasion(situation(NOW + 4, {"r1": called(NOW + 4, at=NOW + 4)}))
    assert joint.call_epoch == Epoch(NOW + 4, "r1"), "the next one is not"


def test_nobody_stands_for_a_plan_that_never_comes() -> None:
    joint = robot("r2")
    stood = []
    for tick in range(NOW, NOW + SETTINGS.freeze + 5):
        joint.handle_occasion(situation(tick, {"r1": called(tick)}))
        stood.append(joint.call_epoch is not None)
    assert stood == [True] * (SETTINGS.freeze + 1) + [False] * 4


def test_of_two_that_call_the_lower_id_is_followed() -> None:
    both = {"r1": called(leader="r1", members=("r1", "r3")), "r2": called(leader="r2", members=("r2", "r3"))}
    for first in both:
        joint = robot("r3")
        joint.handle_occasion(situation(NOW, {first: both[first]}))
        joint.handle_occasion(situation(NOW + 1, both))
        assert joint.call_epoch == CALL, first
    leading = robot("r2")
    leading.call = Free(need="r2")
    leading.handle_occasion(situation(NOW, {"r3": record("r3", C)}))
    assert leading.own_call is not None
    leading.handle_occasion(situation(NOW + 1, {"r1": called(), "r3": record("r3", C)}))
    assert leading.call_epoch == CALL, "it gives its own lead up"
    assert not leading.own_call
    leading = robot("r1")
    leading.call = Free(need="r1")
    leading.handle_occasion(situation(NOW, {"r2": record("r2", C)}))
    leading.handle_occasion(situation(NOW + 1, {"r2": called(leader="r2", members=("r1", "r2"))}))
    assert leading.own_call is not None, "and not for a higher one"


# --- leading ---


def lead(until: int, *, freezes: bool, follows: bool = True) -> tuple[JointPlanning, dict[int, list[str]], int]:
    """Let r1 lead with r2 beside it, which stands when called or not; give the events and when the plan came."""
    joint = robot("r1")
    joint.call = Free(need="r1")
    said: dict[int, list[str]] = {}
    came = 0
    for tick in range(NOW, until):
        epoch = joint.epoch if follows else None
        other = record("r2", C, tick, frozen=joint.call_epoch if freezes else None, epoch=epoch)
        events = joint.handle_occasion(situation(tick, {"r2": replace(other, goal=D)})).events
        if events:
            said[tick] = [event.kind for event in events]
        if joint.following is not None and not came:
            came = tick
    return joint, said, came


def test_a_leader_plans_as_soon_as_all_stand() -> None:
    joint, said, came = lead(NOW + 4, freezes=True)
    assert came == NOW + 1
    assert said == {NOW + 1: ["joint_plan"]}
    assert joint.following is not None
    assert joint.following.members == ("r1", "r2")
    assert {robot: way[-1] for robot, way in joint.following.plan.ways.items()} == {"r1": B, "r2": D}
    assert joint.epoch == Epoch(NOW, "r1")


def test_it_waits_for_the_others_only_so_long_and_plans_without_them() -> None:
    joint, _, came = lead(NOW + SETTINGS.gather + 3, freezes=False)
    assert came == NOW + SETTINGS.gather
    assert joint.following is not None
    assert joint.following.members == ("r1",)


def test_its_record_carries_the_plan_for_a_while_or_until_all_follow_it() -> None:
    joint, _, came = lead(NOW + 4, freezes=True)
    for tick, carried in ((came, True), (came + SETTINGS.carry, True), (came + SETTINGS.carry + 1, False)):
        for epoch, follows in ((None, False), (Epoch(NOW - 1, "r1"), False), (joint.epoch, True)):
            heard = {"r2": record("r2", C, tick, epoch=epoch), "r3": record("r3", D, tick)}
            assert (joint.plan_to_carry(situation(tick, heard)) is not None) is (carried and not follows), (tick, epoch)
        assert (joint.plan_to_carry(situation(tick, {})) is not None) is carried, "r2 is silent"
    assert robot("r1").plan_to_carry(situation(NOW, {})) is None


def test_a_member_that_does_not_take_the_plan_up_is_named_once() -> None:
    until = NOW + 4 * SETTLE
    _, said, came = lead(until, freezes=True, follows=True)
    assert said == {came: ["joint_plan"]}
    joint, said, came = lead(came + 2 * SETTLE + 1, freezes=True, follows=False)
    assert said == {came: ["joint_plan"]}
    heard = {"r2": record("r2", C, came + 2 * SETTLE)}
    events = joint.handle_occasion(situation(came + 2 * SETTLE + 1, heard)).events
    assert [(event.kind, event.robots) for event in events] == [("plan_ignored", ("r2",))]
    assert not joint.handle_occasion(situation(came + 2 * SETTLE + 2, heard)).events


def test_who_was_away_leads_nobody_until_it_has_listened() -> None:
    joint = robot("r1")
    joint.handle_occasion(WakeUp(NOW))
    led = []
    for tick in range(NOW, NOW + SETTINGS.listen + 2):
        joint.call = Free(need="r1")
        joint.handle_occasion(situation(tick, {}))
        led.append(joint.following is not None or joint.own_call is not None)
    assert led == [False] * SETTINGS.listen + [True] * 2


def test_who_was_away_stands_for_nobody_any_more() -> None:
    joint = robot("r2")
    joint.handle_occasion(situation(NOW, {"r1": called()}))
    joint.handle_occasion(WakeUp(NOW + 50))
    assert joint.call == Free()


def test_no_call_is_taken_part_in_again_once_it_is_left() -> None:
    """It was left for a lower leader's, or for being away, or for another floor."""
    both = {"r1": called(members=("r1", "r3")), "r2": called(leader="r2", members=("r2", "r3"))}
    for left in ("for r1", "reset", "void"):
        joint = robot("r3")
        joint.handle_occasion(situation(NOW, {"r2": both["r2"]}))
        assert joint.call_epoch == Epoch(NOW - 3, "r2")
        if left == "for r1":
            joint.handle_occasion(situation(NOW + 1, both))
            assert joint.call_epoch == CALL
        elif left == "reset":
            joint.handle_occasion(WakeUp(NOW + 1))
        else:
            joint.handle_occasion(PlanningStop())
        joint.handle_occasion(situation(NOW + 2, {"r2": both["r2"]}))
        assert joint.call_epoch is None, left


def test_on_another_floor_no_plan_is_followed() -> None:
    joint, _, _ = lead(NOW + 4, freezes=True)
    assert joint.epoch is not None
    joint.handle_occasion(PlanningStop())
    assert joint.epoch is None


def test_who_adopts_anothers_plan_carries_its_own_no_longer() -> None:
    own, plan = JointPlan(epoch=Epoch(1, "r2"), ways={"r1": (C,)}, after={}), plan_of(r1=(C, D), r2=(A, B))
    joint = robot("r2")
    joint.memory.published = PublishedPlan(own, NOW)
    assert joint.plan_to_carry(situation(NOW, {})) == own
    joint.handle_occasion(situation(NOW, {"r1": replace(called(), plan=plan)}))
    assert (joint.epoch, joint.plan_to_carry(situation(NOW, {}))) == (CALL, None)


def test_who_was_away_asks_nobody_any_more() -> None:
    joint = robot("r2")
    assert asked_by(joint, stuck("r2"), situation(NOW, {"r3": record("r3", C)})) == "r2"
    joint.handle_occasion(WakeUp(NOW + 50))
    joint.handle_occasion(situation(NOW + 51 + SETTINGS.listen, {}))
    assert joint.call_epoch is None


# --- following ---


def plan_of(**ways: tuple[int, ...]) -> JointPlan:
    return JointPlan(epoch=CALL, ways=ways, after={})


@pytest.mark.parametrize(
    ("way", "adopted"),
    [((A, B), True), ((B, C), False), (None, False)],
    ids=["from where it stands", "from where it does not stand", "without me"],
)
def test_a_plan_is_taken_up_only_from_where_the_robot_stands(way: tuple[int, ...] | None, adopted: bool) -> None:
    joint = robot("r2")
    joint.handle_occasion(situation(NOW, {"r1": called()}))
    ways = {"r1": (C, D)} | ({"r2": way} if way else {})
    leader = record("r1", C, NOW + 1, plan=plan_of(**ways))
    decision = joint.handle_occasion(situation(NOW + 1, {"r1": leader}))
    assert joint.call_epoch is None
    assert decision.way == (way if adopted else None)
    assert joint.epoch == (CALL if adopted else None)
    assert joint.plan_to_carry(situation(NOW + 1, {})) is None, "it is the leader's to carry"
    joint.handle_occasion(PlanDrop())
    assert joint.epoch is None


def test_who_has_just_got_a_plan_asks_for_no_other() -> None:
    joint, heard = robot("r3"), {"r1": record("r1", C, plan=JointPlan(epoch=CALL, ways={"r3": (A, B)}, after={}))}
    joint.handle_occasion(situation(NOW, {"r1": replace(called(members=("r1", "r3")), plan=heard["r1"].plan)}))
    assert joint.epoch == CALL
    joint.handle_occasion(PlanDrop())
    for age, asked in ((0, None), (SETTINGS.calm - 1, None), (SETTINGS.calm, "r1")):
        assert asked_by(joint, stuck("r3", NOW + age), situation(NOW + age, heard)) == asked, age


def test_somebody_elses_plan_is_not_taken_up() -> None:
    joint = robot("r2")
    joint.handle_occasion(situation(NOW, {"r1": called()}))
    other = JointPlan(epoch=Epoch(NOW - 9, "r1"), ways={"r2": (A, B)}, after={})
    joint.handle_occasion(situation(NOW + 1, {"r1": replace(called(NOW + 1), plan=other)}))
    assert joint.epoch is None
    assert joint.call_epoch == CALL


# --- maps that differ ---

ROOM = Drawn("abcd", "efgh")
WALL = Drawn("a#cd", "efgh")  # as a member knows it


def planned(tick: int, way: str) -> JointPlan:
    return JointPlan(epoch=Epoch(tick, "r1"), ways={"r2": ROOM.at(way)}, after={})


def test_a_member_refuses_a_way_that_its_own_map_shuts_and_says_where() -> None:
    joint = JointPlanning("r2", SETTINGS)
    head, goal = ROOM.at("ad")
    call = called(at=NOW)
    joint.handle_occasion(situation(NOW, {"r1": call}, head, goal, floor=WALL))
    decision = joint.handle_occasion(
        situation(NOW + 1, {"r1": replace(call, plan=planned(NOW, "abcd"))}, head, goal, floor=WALL)
    )
    assert (decision.way, joint.epoch, joint.call_epoch) == (None, None, None)
    a, b, c = ROOM.at("abc")
    text = f"refuses the joint plan of r1: no way from cell {a} to {b}"
    assert decision.events == (TrafficNote("plan_refused", ("r2",), text),)
    assert joint.refusal_to_tell(NOW + 1) == Refusal(Epoch(NOW, "r1"), ((a, b), (b, c)))
    assert joint.refusal_to_tell(NOW + 2 + SETTINGS.carry) is None, "its leader has heard it, or never will"


def test_a_member_takes_a_way_that_its_own_map_has() -> None:
    joint = JointPlanning("r2", SETTINGS)
    head, goal = ROOM.at("ad")
    call = called(at=NOW)
    joint.handle_occasion(situation(NOW, {"r1": call}, head, goal, floor=WALL))
    decision = joint.handle_occasion(
        situation(NOW + 1, {"r1": replace(call, plan=planned(NOW, "aefghd"))}, head, goal, floor=WALL)
    )
    assert decision.way == ROOM.at("aefghd")
    assert joint.refusal_to_tell(NOW + 1) is None


def test_a_leader_calls_again_and_plans_round_what_was_refused() -> None:
    joint = JointPlanning("r1", SETTINGS)
    joint.call = Free(need="r1")
    a, b, c, d = ROOM.at("abcd")
    plans: list[JointPlan] = []
    for tick in range(NOW, NOW + 60):
        if joint.following is not None and joint.following.plan not in plans:
            plans.append(joint.following.plan)
        refusal = Refusal(plans[0].epoch, ((a, b), (b, c))) if plans else None
        other = record("r2", a, tick, frozen=joint.call_epoch, goal=d, refusal=refusal)
        joint.handle_occasion(situation(tick, {"r2": other}, *ROOM.at("hh"), floor=ROOM))
    assert [plan.ways["r2"] for plan in plans] == [ROOM.at("abcd"), ROOM.at("aefgcd")][: len(plans)]
    assert len(plans) == 2, "once for each refusal"


def test_a_robot_is_waited_for_by_members_that_have_claimed_what_it_leaves() -> None:
    joint = JointPlanning("r2", SETTINGS)
    a, b = ROOM.at("ab")
    claims = (Claim(a, 1, NOW),)
    call = called(at=NOW)
    heard = {name: record(name, C, claims=claims) for name in ("r1", "r3")}
    joint.handle_occasion(situation(NOW, {"r1": call}, *ROOM.at("ad"), floor=ROOM))
    plan = JointPlan(epoch=Epoch(NOW, "r1"), ways={"r1": (b, a), "r2": ROOM.at("abcd")}, after={})
    joint.handle_occasion(situation(NOW + 1, {"r1": replace(call, plan=plan)}, *ROOM.at("ad"), floor=ROOM))
    assert joint.following is not None
    assert joint.following.is_waited_for([a], situation(NOW, {"r1": heard["r1"]}))
    assert not joint.following.is_waited_for([b], situation(NOW, {"r1": heard["r1"]}))
    assert not joint.following.is_waited_for([a], situation(NOW, {"r3": heard["r3"]})), "r3 has no part in the plan"
