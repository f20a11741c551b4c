"""What the world takes for an answer, and whom it asks again."""

from tests.world.shared import command
from world.host.last_messages import AGAIN, SILENT, LastMessages, SenseTimes


def test_all_that_are_there_have_to_answer_this_tick() -> None:
    answers = LastMessages()
    assert answers.robots_without_answer(["r1", "r2"], 3) == ["r1", "r2"]
    answers.take("r1", command(tick=3), run=0, tick=3)
    assert answers.robots_without_answer(["r1", "r2"], 3) == ["r2"]
    answers.deaf.add("r2")
    assert answers.robots_without_answer(["r1", "r2"], 3) == []


def test_an_answer_to_an_earlier_tick_is_late_and_is_no_answer_to_this_one() -> None:
    answers = LastMessages()
    answers.take("r1", command(tick=2), run=0, tick=3)
    assert answers.late == 1
    assert answers.robots_without_answer(["r1"], 3) == ["r1"]
    answers.take("r1", command(tick=3, sent=True), run=0, tick=3)
    assert answers.robots_without_answer(["r1"], 3) == []
    assert answers.commands["r1"].sent


def test_the_same_answer_again_counts_once() -> None:
    answers = LastMessages()
    told = command(tick=3, notes=[("halted", "stopped")])
    for _ in range(2):
        answers.take("r1", told, run=0, tick=3)
    assert answers.commands["r1"].notes == [("halted", "stopped")]
    answers.forget_commands()
    answers.take("r1", told, run=0, tick=4)
    assert answers.commands == {}
    assert answers.late == 0


def test_who_answers_the_present_tick_is_in_time_once() -> None:
    answers = LastMessages()
    for name, tick in (("r1", 2), ("r1", 3), ("r1", 3), ("r2", 3)):
        answers.take(name, command(tick=tick), run=0, tick=3)
    assert (answers.in_time, answers.late) == (2, 1)
    answers.forget_commands()
    assert (answers.in_time, answers.late, answers.commands) == (0, 1, {})


def test_an_answer_of_another_run_or_of_a_tick_to_come_is_dropped() -> None:
    answers = LastMessages()
    answers.take("r1", command(tick=3, run=1), run=0, tick=3)
    answers.take("r1", command(tick=4), run=0, tick=3)
    assert answers.commands == {}


def test_who_comes_in_mid_tick_is_asked_at_once_and_who_is_silent_again() -> None:
    asked = SenseTimes(["r1"], now=10.0)
    assert asked.robots_to_send_again(["r1", "r2"], 10.1) == ["r2"], "r2 came back while the world waited"
    assert asked.robots_to_send_again(["r1", "r2"], 10.0 + AGAIN) == ["r1"]
    assert asked.robots_to_send_again(["r1", "r2"], 10.1 + AGAIN) == ["r2"]


def test_the_wait_is_counted_from_the_first_time_that_a_robot_was_asked() -> None:
    asked = SenseTimes(["r1"], now=10.0)
    asked.robots_to_send_again(["r1", "r2"], 12.0)
    assert asked.overdue(["r1", "r2"], 10.0 + SILENT) == []
    assert asked.overdue(["r1", "r2"], 10.1 + SILENT) == ["r1"]
    assert asked.overdue(["r1", "r2"], 12.1 + SILENT) == ["r1", "r2"]


def test_each_broadcast_that_was_sent_is_named_with_its_own_tick_also_if_several_come_in_one_tick() -> None:
    answers = LastMessages()
    for tick, sent in ((1, True), (2, False), (3, True), (3, True), (1, True)):
        answers.take("r1", command(tick=tick, sent=sent), run=0, tick=4)
    assert answers.sent == [("r1", 1), ("r1", 3)]
    assert answers.commands["r1"].tick == 3
    answers.forget_commands()
    assert answers.sent == []
