"""`why`: each clause is named where its cause was planted, and never a holder that does not hold."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import pytest

from swarm.blackbox.explain.clauses import Cause, Clause
from swarm.blackbox.explain.moment import Instant, Simulated, run_moment_until
from swarm.blackbox.explain.run_history import Missed
from swarm.geometry import distance
from swarm.messages import RobotAction, RobotDo
from swarm.scenario.load import load
from swarm.storm.uncooperative import make_mute
from tests.shared import ROOT, with_settings
from tests.storm.shared import plan_of
from world.faults import Faults, Health, Spell
from world.simulate import Simulation

LIMIT: Final = 1200  # ticks, a minute
ENDS: Final = frozenset(Clause) - {  # where a chain may end; the others only lead on
    Clause.HELD, Clause.CLAIMED, Clause.TURN, Clause.LACKS, Clause.STANDS, Clause.SILENT, Clause.UNKNOWN,
}  # fmt: skip


ALLEY: Final = "\n".join(["#" * 27] * 3 + [f"###{'.' * 21}###"] * 3 + ["#" * 27] * 3) + "\n"  # one robot wide
ENDS_OF_ALLEY: Final[dict[str, Any]] = {
    "start": {"poses": [[1.8, 1.8, 0.0], [9.0, 1.8, 3.1]]}, "own_targets": [[[9.0, 1.8]], [[1.8, 1.8]]],
}  # fmt: skip


BEND: Final[dict[str, Any]] = {  # r2 begins in the corridor's bay
    "start": {"poses": [[1.8, 3.0, 0.0], [7.8, 4.2, 0.0]]}, "own_targets": [[[7.8, 4.2]], [[15.0, 3.0]]],
}  # fmt: skip


class Told(NamedTuple):
    """The first explanation that names a clause."""

    moment: Instant
    causes: list[Cause]
    cause: Cause


class _FoundError(Exception):
    pass


def shipped(name: str, robots: int, faults: Faults | None = None, **sections: object) -> Simulation:
    return Simulation.of(with_settings(load(ROOT / "scenarios" / f"{name}.yaml"), **sections), robots, 1, faults)


def two(faults: Faults | None = None, **fields: object) -> Simulation:
    """Two robots that change sides on the small floor of storm's tests."""
    return Simulation.of(plan_of(**fields).to_scenario(), 2, 1, faults)


def first(simulation: Simulation, clause: Clause, robot: str | None = None, *, after: int = 0) -> Told:
    """Return the first explanation, of a robot or of any, that names a clause."""
    found: list[Told] = []

    def look(moment: Instant) -> None:
        for name in [robot] if robot is not None else moment.robots:
            causes = moment.why(name) if moment.past.tick >= after else []
            named = [cause for cause in causes if cause.clause is clause]
            if named:
                found.append(Told(moment, causes, named[0]))
                raise _FoundError

    with pytest.raises(_FoundError):
        run_moment_until(Simulated(simulation), LIMIT, look)
    return found[0]


def one_behind_the_other(faults: Faults | None = None) -> Simulation:
    """r1 has to drive past where r2 is, in a corridor that is one robot wide."""
    return shipped("corridor", 2, faults, start={"poses": [[1.8, 3.0, 0.0], [7.8, 3.0, 0.0]]}, own_targets=[[[15.0, 3.0]], [[15.0, 3.0]]])  # fmt: skip


def deaf(simulation: Simulation, listener: int, sender: int, begins: int) -> Simulation:
    """Lose every broadcast of one robot to another from a tick on."""
    world, real = simulation.world, simulation.world.radio.hears

    def hears(poses: object, sent: object) -> list[list[tuple[int, int]]]:
        heard = real(poses, sent)  # type: ignore[arg-type]
        if world.tick >= begins:
            heard[listener] = [pair for pair in heard[listener] if pair[0] != sender]
        return heard

    world.radio.hears = hears  # type: ignore[method-assign]
    return simulation


@pytest.mark.parametrize("health", [Health.SUSPENDED, Health.AWAY, Health.DEAD])
def test_a_robot_that_does_not_answer_is_gone_since_its_last_answer(health: Health) -> None:
    told = first(two(Faults(spells=(Spell("r1", health, 50, 40),))), Clause.GONE, "r1")
    assert (told.moment.past.tick, "since 2.45 s" in told.cause.text) == (50, True)


def test_a_mute_robot_is_named_as_one() -> None:
    simulation = two()
    make_mute(simulation, ["r2"])
    assert first(simulation, Clause.MUTE, "r2").causes[0].robot == "r2"


def test_a_robot_that_was_told_to_stop_stands_by_order_and_leaves_no_way_to_who_is_behind_it() -> None:
    simulation = one_behind_the_other()
    simulation.world.request("r2", RobotAction(do=RobotDo.STOP))
    told = first(simulation, Clause.CUT_OFF, "r1")
    assert [(cause.robot, cause.clause, cause.other) for cause in told.causes] == [
        ("r1", Clause.CUT_OFF, "r2"),
        ("r2", Clause.ORDER, None),
    ]


def test_the_holder_of_the_next_cell_is_named_and_why_it_stays() -> None:
    told = first(one_behind_the_other(Faults(killed={"r2": 2.0})), Clause.HELD, "r1")
    assert [(cause.robot, cause.clause, cause.other) for cause in told.causes] == [
        ("r1", Clause.DRIVES, None),  # up to the cell
        ("r1", Clause.HELD, "r2"),
        ("r1", Clause.SILENT, "r2"),
        ("r2", Clause.GONE, None),
    ]


def test_at_its_stop_a_robot_names_the_cells_that_its_place_needs_and_who_has_them() -> None:
    """The place of r1 is the corner of four cells; r2 stands in one of them."""
    fields: dict[str, Any] = {
        "start": {"poses": [[1.8, 1.8, 0.0], [6.6, 3.0, 0.0]]},
        "own_targets": [[[5.95, 2.35]], [[9.0, 1.8]]],
        "reach": 0.1,
    }
    told = first(two(Faults(killed={"r2": 0.5}), **fields), Clause.HELD, "r1")
    decided = told.moment.robots["r1"].last_decision
    assert decided is not None
    needs = f"and needs the cells {_named(decided.situation.docking)} too to come to the place."
    assert told.causes[0].text.endswith(needs)
    assert [(cause.robot, cause.clause, cause.other) for cause in told.causes] == [
        ("r1", Clause.REACHES, None),
        ("r1", Clause.HELD, "r2"),
        ("r1", Clause.SILENT, "r2"),
        ("r2", Clause.GONE, None),
    ]


def _named(cells: Sequence[int]) -> str:
    return ", ".join(map(str, cells))


def test_a_robot_that_has_just_started_listens_and_so_does_one_that_woke() -> None:
    told = first(two(), Clause.LISTENS, "r1")
    assert told.moment.past.tick == 0
    assert "0.00 s" in told.cause.text
    woken = first(two(Faults(spells=(Spell("r1", Health.SUSPENDED, 60, 40),))), Clause.LISTENS, "r1", after=61)
    assert "5.00 s" in woken.cause.text


def test_an_unexpected_obstacle_is_named_with_its_distance() -> None:
    mover = {"waypoints": [[5.4, 2.4], [5.4, 2.5]], "speed": 0.01, "radius": 0.5}
    told = first(two(movers=[mover]), Clause.OBSTACLE)
    decided = told.moment.robots[told.cause.robot].last_decision
    assert decided is not None
    assert decided.halt.stopped


@pytest.mark.parametrize(
    ("name", "robots", "clause"),
    [("corridor", 2, Clause.STANDS), ("corridor", 2, Clause.CALLS), ("paper", 8, Clause.SEARCHES)],
)
def test_a_joint_plan_to_come_is_named_with_who_asked_for_it(name: str, robots: int, clause: Clause) -> None:
    told = first(shipped(name, robots), clause)
    asked = [cause for cause in told.causes if cause.clause is Clause.ASKED]
    assert asked
    assert asked[0].other == "r1"  # the lowest id leads


def test_the_turn_in_a_joint_plan_is_named_with_who_goes_first() -> None:
    told = first(shipped("corridor", 2), Clause.TURN)
    plan = told.moment.robots[told.cause.robot].last_decision
    assert plan is not None
    assert plan.joint.following is not None
    entry = plan.joint.following.entries[plan.progress.next_step]
    assert (told.cause.other, told.cause.cell) == (entry.robot, plan.progress.route[0])


def test_a_plan_that_was_lost_by_the_radio_is_named_with_the_times_at_which_it_was_said() -> None:
    simulation = shipped("corridor", 2)
    stood = first(shipped("corridor", 2), Clause.STANDS, "r2").moment.past.tick
    told = first(deaf(simulation, 1, 0, stood), Clause.LOST, "r2")
    past = told.moment.past
    plans = [
        words.tick for words in past.said["r1"] if words.traffic is not None and words.traffic.own.plan is not None
    ]
    assert told.causes[0].clause is Clause.STANDS
    assert past.clock(plans[0]) in told.cause.text


def test_a_claim_that_was_not_heard_is_named_with_when_it_was_told() -> None:
    told = first(deaf(two(), 1, 0, 31), Clause.LOST, "r1")
    assert [cause.clause for cause in told.causes] == [Clause.DRIVES, Clause.LACKS, Clause.LOST]
    assert told.causes[1].other == "r2"


def test_a_broadcast_out_of_range_was_said_out_of_range() -> None:
    simulation = shipped("paper", 8, radio={"range": 4.0})
    told = first(simulation, Clause.FAR)
    past, sender, listener = told.moment.past, told.cause.robot, told.cause.other
    assert listener is not None
    assert any(past.why_missed(listener, words) is Missed.FAR for words in past.said[sender])
    poses = {name: (sense.x, sense.y) for name, sense in past.senses.items()}
    assert distance(poses[sender], poses[listener]) > 3.0


def test_the_cell_of_a_robot_that_has_long_been_silent_is_looked_at() -> None:
    told = first(shipped("corridor", 2, Faults(killed={"r2": 1.0}), **BEND), Clause.LOOKS, "r1")
    decided = told.moment.robots["r1"].last_decision
    assert decided is not None
    assert told.cause.cell in decided.situation.others["r2"].held


@pytest.mark.parametrize(
    ("clause", "holds"),
    [
        (Clause.DRIVES, lambda told: told.moment.past.commands[told.cause.robot].left != 0.0),
        (Clause.ARRIVED, lambda told: told.moment.robots[told.cause.robot].mission.goal is None),
        (Clause.REACHES, lambda told: told.moment.robots[told.cause.robot].mission.goal is not None),
    ],
)
def test_a_robot_that_waits_for_nobody_says_what_it_does(clause: Clause, holds: Callable[[Told], bool]) -> None:
    told = first(two(), clause)
    assert holds(told)
    assert len(told.causes) == 1


def test_a_claim_of_another_is_named_with_its_time() -> None:
    told = first(shipped("paper", 8), Clause.CLAIMED)
    past, cause = told.moment.past, told.cause
    assert cause.other is not None
    records = [words.traffic.own for words in past.said[cause.other] if words.traffic is not None]
    claims = [claim for record in records for claim in record.claims if claim.cell == cause.cell]
    assert any(past.clock(claim.stamp) in cause.text for claim in claims)


def test_a_claim_that_all_have_acknowledged_counts_once_it_is_ripe() -> None:
    told = first(shipped("paper", 8), Clause.YOUNG)
    decided = told.moment.robots[told.cause.robot].last_decision
    assert decided is not None
    assert decided.progress.reservations.claims[0].cell == told.cause.cell


def test_what_ends_a_wait_and_is_not_said_yet_is_under_way() -> None:
    told = first(shipped("corridor", 2), Clause.COMING)
    assert told.causes[0].clause is Clause.CALLS


def test_a_robot_that_was_sent_aside_names_those_that_have_to_pass() -> None:
    told = first(shipped("paper", 6, radio={"loss": 0.1}), Clause.ASIDE)
    decided = told.moment.robots[told.cause.robot].last_decision
    assert decided is not None
    assert decided.joint.following is not None
    assert told.cause.other in decided.joint.following.members


def test_a_circle_is_named_and_ends_the_chain() -> None:
    told = first(two(map={"text": ALLEY, "cell": 0.4}, **ENDS_OF_ALLEY), Clause.CIRCLE, after=240)
    assert [(cause.robot, cause.clause, cause.other) for cause in told.causes] == [
        ("r1", Clause.HELD, "r2"),
        ("r2", Clause.HELD, "r1"),
        ("r1", Clause.CIRCLE, None),
    ]


def test_a_robot_that_is_driving_out_of_a_cell_is_no_link_of_a_circle() -> None:
    """By a plan in `office`, r7 drives out of a cell that r4 waits for, and will wait for r4 two cells farther on."""
    moment = run_moment_until(Simulated(shipped("office", 8)), 790)
    *_, mine, theirs = moment.why("r4")
    assert (mine.clause, mine.other) == (Clause.TURN, "r7")
    assert (theirs.robot, theirs.clause) == ("r7", Clause.DRIVES)
    decided = moment.robots["r7"].last_decision
    assert decided is not None
    assert decided.waits == ("r4",)


def test_of_two_that_claim_a_cell_only_one_waits_for_the_other() -> None:
    """In `crossing`, r1 has claimed a cell a tick before r2: both name the other as the one that they wait for."""
    moment = run_moment_until(Simulated(shipped("crossing", 8)), 205)
    younger = [cause for cause in moment.why("r2") if cause.clause is Clause.CLAIMED]
    assert [cause.other for cause in younger] == ["r1"]
    assert Clause.CLAIMED not in {cause.clause for cause in moment.why("r1")}


def test_a_robot_that_may_drive_and_turns_no_wheel_is_named_as_one() -> None:
    told = first(two(Faults(spells=(Spell("r1", Health.HELD_UP, 60, 10),))), Clause.WHEELS, "r1")
    assert told.moment.past.tick == 60


def test_a_broadcast_behind_a_wall_is_not_called_lost() -> None:
    past = run_moment_until(Simulated(shipped("corridor", 2, radio={"line_of_sight": True}, **BEND)), 40).past
    assert {past.why_missed("r1", words) for words in past.said["r2"]} == {Missed.HIDDEN}


@pytest.mark.parametrize(
    ("name", "robots", "loss"),
    [
        ("corridor", 2, 0.0),
        pytest.param("doorway", 12, 0.2, marks=pytest.mark.long("a minute of 12 robots")),
        pytest.param("circle", 8, 0.3, marks=pytest.mark.long("a minute of 8 robots")),
    ],
)
def test_chains_end_at_a_root_and_never_name_a_holder_that_does_not_hold(name: str, robots: int, loss: float) -> None:
    asked = thin = circles = 0

    def look(moment: Instant) -> None:
        nonlocal asked, thin, circles
        if moment.past.tick % 20:
            return
        for robot in moment.robots:
            causes = [cause for cause in moment.why(robot) if cause.clause is not Clause.ALSO]
            asked += 1
            thin += causes[-1].clause is Clause.UNKNOWN
            circles += causes[-1].clause is Clause.CIRCLE
            assert causes[-1].clause in ENDS or causes[-1].clause is Clause.UNKNOWN, causes
            for cause, follows in zip(causes, [*causes[1:], None], strict=True):
                assert cause.clause not in {Clause.HELD, Clause.CLAIMED} or is_true(moment, cause, follows), causes

    run_moment_until(Simulated(shipped(name, robots, radio={"loss": loss})), LIMIT, look)
    assert asked > 0
    assert thin <= asked / 100
    assert circles <= asked / 50, "joint plans resolve them at once"


def is_true(moment: Instant, cause: Cause, follows: Cause | None) -> bool:
    """Return True if the robot named holds or claims the cell, or the next line says that it does not any more."""
    assert cause.other is not None
    decided = moment.robots[cause.other].last_decision
    assert decided is not None
    own = decided.progress.reservations
    claims = {claim.cell for claim in own.all_claims} if cause.clause is Clause.CLAIMED else set()
    ended = follows is not None and follows.clause in {Clause.LOST, Clause.FAR, Clause.COMING}
    return cause.cell in {*own.held, *claims} or ended


def test_the_same_tick_has_the_same_answer(tmp_path: Path) -> None:
    answers = [run_moment_until(Simulated(shipped("paper", 4)), 200).why("r1") for _ in range(2)]
    assert answers[0] == answers[1]
