"""The place of a robot in its process: what it takes, what it waits for, and that it answers each sense once."""

from unittest.mock import Mock

import msgspec
import pytest

from swarm.bus import Bus
from swarm.geometry import Pose
from swarm.messages import Activity, Broadcast, Edit, Kind, Map, Sense, Took
from swarm.robot.brain import Inputs
from swarm.robot.host.radio import Radio, Receiver
from swarm.robot.host.seat import DOUBTED, EARLIER, MOST_NAMED, OVERDUE, SAID_AGAIN, GivenAnswer, Repeats, Seat
from tests.robot.shared import FITS, robot, scenario

LIVE = msgspec.structs.replace(FITS, lockstep=False)
START = msgspec.structs.replace(FITS, tick=0)  # the first sense of the run
NOW = 100.0  # s


def later(sense: Sense, ticks: int = 1, **fields: object) -> Sense:
    return msgspec.structs.replace(sense, tick=sense.tick + ticks, **fields)


def broadcast(name: str, tick: int, run: int = 0) -> Broadcast:
    return Broadcast(
        robot=name, run=run, tick=tick, x=4.5, y=3.5, yaw=0.0, activity=Activity.DRIVE, target=0, distance=1.0,
        reached=[False],
    )  # fmt: skip


class Chair:
    """A seat with its receiver and what it logs, that has answered its first sense; a fetch of the map is counted."""

    def __init__(self, kept: int = 3, since: Sense = START) -> None:
        self.said: list[str] = []
        self.fetched = 0
        self.radio = Radio(Mock(spec=Bus))
        self.robot = robot()
        self.robot.step = Mock(side_effect=self.robot.step)  # type: ignore[method-assign]
        self.seat = Seat(self.robot, Receiver(self.radio, 10.0), kept, self.said.append)
        self.answer(since)
        self.robot.step.reset_mock()

    def fetch(self) -> list[Map]:
        self.fetched += 1
        settings, packed = scenario().to_wire()
        return [Map(scenario=settings, packed=packed, edits=5)]

    def answer(self, sense: Sense, now: float = NOW) -> GivenAnswer:
        self.seat.take(sense)
        assert self.seat.ready(now)
        return self.seat.answer(self.fetch)

    @property
    def heard(self) -> list[tuple[str, int]]:
        """What the robot was given to hear at its last step."""
        inputs: Inputs = self.robot.step.call_args.args[0]  # type: ignore[attr-defined]
        return [(one.robot, one.tick) for one in inputs.heard]


def test_a_sense_is_answered_once() -> None:
    one = Chair()
    assert not one.seat.ready(NOW)
    given = one.answer(FITS)
    assert given.outputs.command.tick == FITS.tick
    assert given.zone == (0, 0)
    assert given.sure
    assert one.seat.sense is None
    assert not one.seat.ready(NOW)
    assert not one.answer(later(LIVE)).sure, "in real time a broadcast waits for nobody"


@pytest.mark.parametrize("newer_first", [True, False])
@pytest.mark.parametrize("newer", [{"tick": 8}, {"run": 1, "tick": 0}])
def test_the_newer_of_two_senses_is_answered(newer: dict[str, int], newer_first: bool) -> None:
    one = Chair()
    other = msgspec.structs.replace(FITS, **newer)
    for sense in (other, FITS) if newer_first else (FITS, other):
        one.seat.take(sense)
    assert one.seat.sense is other


def test_lockstep_waits_for_every_broadcast_that_the_sense_lists() -> None:
    one = Chair()
    one.seat.take(msgspec.structs.replace(FITS, hears=[("r1", 6), ("r3", 6)]))
    one.radio.take(broadcast("r3", 6))
    assert not one.seat.ready(NOW)
    one.radio.take(broadcast("r1", 6))
    one.radio.take(broadcast("r1", 2))
    assert one.seat.ready(NOW)
    one.seat.answer(one.fetch)
    assert one.heard == [("r1", 6), ("r3", 6)]
    assert one.said == []


def test_lockstep_waits_only_so_long_and_says_so_once() -> None:
    one = Chair()
    one.seat.take(msgspec.structs.replace(FITS, hears=[("r1", 6)]))
    assert not one.seat.ready(NOW)
    assert not one.seat.ready(NOW + OVERDUE)
    assert one.seat.ready(NOW + OVERDUE + 0.001)
    given = one.seat.answer(one.fetch)
    assert given.outputs.command.notes[-1] == ("overdue", "went on without a broadcast that did not arrive in 2 s")
    assert one.heard == []
    assert one.said == ["r2: tick 7: went on without a broadcast that did not arrive in 2 s"]
    one.seat.take(later(FITS, hears=[("r1", 7)]))
    assert not one.seat.ready(NOW + 10), "each sense has its own time"
    one.seat.take(later(FITS, 2, hears=[("r1", 8)]))
    assert not one.seat.ready(NOW + 10 + OVERDUE + 0.001), "a newer one too"


def test_who_begins_in_the_middle_of_a_run_waits_for_nothing_from_before_its_first_sense() -> None:
    one = Chair(since=msgspec.structs.replace(FITS, hears=[("r1", 6)]))
    one.answer(later(FITS, hears=[("r1", 7)]))
    assert one.said == [], "nothing was overdue"
    one.seat.take(later(FITS, 2, hears=[("r1", 8)]))
    assert not one.seat.ready(NOW), "this one was sent to it"
    one.seat.take(later(FITS, run=1, hears=[("r1", 7)]))
    assert not one.seat.ready(NOW), "and so is everything in the next run"


def test_only_the_world_that_welcomed_a_robot_is_obeyed() -> None:
    one = Chair()
    one.answer(FITS)
    for number in range(3):
        one.seat.take(later(FITS, 1 + number, world="forged"))
        one.seat.take(later(FITS, 1 + number, world="forged", run=9))
    assert one.seat.sense is None
    assert one.said == ["r2: tick 8: the sense was dropped: it is of another world"]
    assert one.seat.repeat(FITS) is not None
    assert one.seat.repeat(msgspec.structs.replace(FITS, world="forged")) is None


def test_what_was_said_last_can_be_said_again() -> None:
    one = Chair(kept=10)
    given = [one.answer(later(FITS, tick)) for tick in range(5)]
    assert one.seat.last_answers() == given[-SAID_AGAIN:]
    one.answer(later(LIVE, 5))
    assert one.seat.last_answers() == given[-SAID_AGAIN + 1 :], "in real time nothing is said twice"


def test_after_the_router_was_away_the_wait_starts_over() -> None:
    one = Chair()
    one.seat.take(msgspec.structs.replace(FITS, hears=[("r1", 6)]))
    assert not one.seat.ready(NOW)
    one.seat.wait_again()
    assert not one.seat.ready(NOW + 10 * OVERDUE)
    assert one.seat.ready(NOW + 11.1 * OVERDUE)


def test_real_time_takes_what_has_come() -> None:
    one = Chair()
    one.radio.take(broadcast("r3", 6))
    one.answer(msgspec.structs.replace(LIVE, hears=[("r1", 6), ("r3", 6)]))
    assert one.heard == [("r3", 6)]
    one.radio.take(broadcast("r1", 6))
    one.answer(later(LIVE))
    assert one.heard == [("r1", 6)], "what came late is heard late"
    one.answer(later(LIVE, 2))
    assert one.heard == [], "and only once"


def test_a_sense_that_comes_again_gets_the_same_answer_and_no_second_step() -> None:
    one = Chair()
    one.radio.take(broadcast("r1", 6))
    sense = msgspec.structs.replace(FITS, hears=[("r1", 6)])
    first = one.answer(sense)
    one.radio.begin(1)  # whatever has become of the broadcast
    assert one.answer(sense) == first.repeat_with()
    assert one.robot.step.call_count == 1  # type: ignore[attr-defined]
    assert one.said == []


def test_after_a_doubt_the_next_answer_tells_what_the_last_steps_were_made_with() -> None:
    one = Chair(kept=10)
    one.radio.take(broadcast("r3", 6))
    earlier = [one.answer(later(LIVE, tick, hears=[("r3", 6)] * (tick == 4))) for tick in range(5)]
    one.seat.doubt_last_answers()
    took = one.answer(later(LIVE, 5)).outputs.command.took
    assert took is not None
    assert took.before[-5:] == [given.step for given in earlier]
    assert took.before[-1] == (LIVE.tick + 4, [("r3", 6)], None)
    assert one.answer(later(LIVE, 6)).outputs.command.took is None, "it is told once"


def test_an_answer_that_is_said_again_tells_the_steps_before_it() -> None:
    """Those of the world before may be lost: a replay must make them before this one, not after."""
    one = Chair(kept=100)
    earlier = [one.answer(later(LIVE, tick)) for tick in range(DOUBTED + 2)]
    one.seat.doubt_last_answers()
    for ticks, expected in ((1, earlier[:1]), (5, earlier[:5])):
        given = one.seat.repeat(later(LIVE, ticks))
        assert given is not None
        took = given.outputs.command.took
        assert took is not None
        assert (took.again, took.before[-len(expected) :]) == (True, [given.step for given in expected])
    took = one.answer(later(LIVE, DOUBTED + 2)).outputs.command.took
    assert took is not None
    assert len(took.before) == DOUBTED, "the next new step tells all once more"
    assert one.seat.repeat(later(LIVE, 5)) == earlier[5].repeat_with()


def resumed() -> Chair:
    """Make a robot that answered ticks 7, 9 and 10 in real time; it left out 8."""
    one = Chair(kept=10)
    for ticks in (0, 2, 3):
        one.answer(later(LIVE, ticks))
    return one


def test_a_robot_does_not_step_back_in_time_when_its_world_goes_on_from_before() -> None:
    one = resumed()
    for ticks, kept in ((0, True), (1, False), (2, True), (3, True)):
        sense = later(LIVE, ticks)
        assert (one.seat.repeat(sense) is not None) is kept
        if not kept:
            one.seat.take(sense)
            assert one.seat.sense is None, "in real time the world waits for nobody"
    assert one.robot.step.call_count == 3  # type: ignore[attr-defined]
    assert one.said == [f"r2: tick 8: the sense was dropped: {EARLIER}"]
    assert one.answer(later(LIVE, 4)).outputs.command.tick == 11, "then it goes on"
    one.seat.take(msgspec.structs.replace(LIVE, run=1, tick=0))
    assert one.seat.sense is not None, "a new run begins before any tick"


@pytest.mark.parametrize(
    ("moved", "same"),
    [({}, True), ({"x": 0.009}, True), ({"y": 0.011}, False), ({"yaw": 0.04}, True), ({"yaw": -0.06}, False)],
)
def test_in_real_time_a_robot_that_is_not_where_it_was_stands_until_the_ticks_are_new(
    moved: dict[str, float], same: bool
) -> None:
    """A world that goes on from before gets the same answers in other ticks, so the bodies go other ways."""
    one = resumed()
    before = [one.seat.repeat(later(LIVE, ticks)) for ticks in (0, 2, 3)]
    for ticks, first in zip((0, 2, 3), before, strict=True):
        sense = later(LIVE, ticks)
        given = one.seat.repeat(later(sense, 0, **{name: getattr(sense, name) + by for name, by in moved.items()}))
        assert given is not None
        assert first is not None
        assert (given == first) is same
        if not same:
            command = given.outputs.command
            assert (command.tick, command.left, command.right, command.sent) == (sense.tick, 0.0, 0.0, False)
            assert given.outputs[1:] == (None, None, None)
    assert one.robot.step.call_count == 3  # type: ignore[attr-defined]


def test_in_lockstep_a_robot_stands_at_a_tick_that_it_left_out() -> None:
    one = resumed()
    given = one.seat.repeat(later(FITS, 1))
    assert given is not None
    command, after = given.outputs.command, one.seat.repeat(later(FITS, 2))
    assert after is not None
    assert (command.tick, command.left, command.right, command.sent) == (8, 0.0, 0.0, False)
    assert (command.held, command.reached) == (after.outputs.command.held, after.outputs.command.reached)
    assert given.outputs[1:] == (None, None, None)
    assert one.robot.step.call_count == 3  # type: ignore[attr-defined]
    assert one.seat.repeat(later(FITS, 9)) is None, "a tick to come is stepped"


def test_a_new_run_forgets_the_broadcasts_of_the_run_before_it_and_keeps_its_own() -> None:
    one = Chair()
    one.radio.take(broadcast("r1", 0))
    one.radio.take(broadcast("r3", 0, run=1))
    one.seat.take(msgspec.structs.replace(FITS, run=1, tick=1, hears=[("r1", 0), ("r3", 0)]))
    assert not one.seat.ready(NOW), "r1 has said that in the run before"
    one.radio.take(broadcast("r1", 0, run=1))
    assert one.seat.ready(NOW)


def test_missed_edits_fetch_the_map() -> None:
    one = Chair()
    edit = Edit(kind=Kind.WALL, low=(6.0, 1.0), high=(7.0, 5.0))  # it shuts off the first two stops of three
    assert one.answer(msgspec.structs.replace(FITS, edits=[edit])).outputs.command.unreachable == [0, 1]
    assert one.answer(later(FITS, edits_before=1)).outputs.command.unreachable == [0, 1]
    assert one.fetched == 0
    again = one.answer(later(FITS, 2, time=5.0, edits_before=5))
    assert (one.fetched, again.outputs.command.unreachable) == (1, []), "the world's map, not its own"
    one.answer(later(FITS, 3, edits_before=5))
    assert one.fetched == 1


# --- what does not fit ---


@pytest.mark.parametrize(
    ("field", "count", "expected"), [("rays", 0, 15), ("rays", 14, 15), ("rays", 16, 15), ("bearings", 3, 4)]
)
def test_a_sense_of_another_scenario_is_dropped_and_named_once(field: str, count: int, expected: int) -> None:
    one = Chair()
    for _ in range(3):
        one.seat.take(msgspec.structs.replace(FITS, **{field: [1.0] * count}))
    assert one.seat.sense is None
    assert len(one.said) == 1
    assert f"r2: tick 7: the sense was dropped: {field}: expected {expected}, got {count};" in one.said[0]
    one.seat.take(FITS)
    assert one.seat.sense is FITS, "the next good one is taken"


def test_a_flood_of_wrong_senses_fills_no_log() -> None:
    one = Chair()
    for count in range(20, 20 + 3 * MOST_NAMED):
        one.seat.take(msgspec.structs.replace(FITS, rays=[1.0] * count))
    assert one.seat.sense is None
    assert len(one.said) == MOST_NAMED


# --- the answers that are kept ---


def test_only_the_last_answers_are_kept() -> None:
    repeats = Repeats(most=3)
    pose = Pose(FITS.x, FITS.y, FITS.yaw)
    answer = GivenAnswer(robot().step(Inputs(FITS, [])), (0, 0), sure=True, pose=pose, took=Took(heard=[]))
    for tick in range(5):
        repeats.keep(msgspec.structs.replace(FITS, tick=tick), answer)
    kept = [tick for tick in range(5) if repeats.find_answer(msgspec.structs.replace(FITS, tick=tick)) is not None]
    assert kept == [2, 3, 4]
    assert repeats.find_answer(msgspec.structs.replace(FITS, tick=4, run=1)) is None
