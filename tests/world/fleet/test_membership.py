"""The membership: who is present, who has gone, and whose place is whose. Tokens are claims; a place is taken by joining."""

import pytest

from swarm.bus import Presence
from swarm.errors import PeerError
from world.fleet.membership import BACK, HOLD, PARTING, PROMISED, STRANGERS, Membership

ROBOTS = [f"r{number}" for number in range(1, 6)]
LATER = 2 * HOLD  # s


def token(name: str, session: str, alive: bool = True, role: str = "robot") -> Presence:
    return Presence(role, name, session, alive)


def membership(*present: tuple[str, str]) -> Membership:
    """Return a membership at 0 s with robots that have joined, each from a session."""
    one = Membership(ROBOTS, watchers=0, now=0.0)
    for name, session in present:
        one.place(name, session, 0.0)
        assert one.take(token(name, session), 0.0) is None
    return one


def kinds(one: Membership, now: float, running: bool = True) -> list[tuple[str, str]]:
    return [(note.kind, note.robot) for note in one.look(now, running=running)]


def test_the_most_robots_that_one_process_was_at_a_time() -> None:
    assert membership().most_in_one == 0
    assert membership(("r1", "a"), ("r2", "b"), ("r3", "c")).most_in_one == 1
    one = membership(("r1", "a"), ("r2", "b"), ("r3", "b"), ("r4", "a"), ("r5", "b"))
    assert one.most_in_one == 3
    for name in ("r2", "r3", "r5"):
        one.take(token(name, "b", alive=False), 0.0)
    one.look(LATER, running=True)
    for name in ("r2", "r3"):
        one.place(name, "c", LATER)
        one.take(token(name, "c"), LATER)
    assert one.most_in_one == 3, "what was is not forgotten"


def test_a_process_that_is_told_twice_or_of_another_kind_counts_once_or_not() -> None:
    one = membership(("r1", "a"))
    for presence in (token("r1", "a"), token("r9", "a"), token("r2", "a", role="dashboard")):
        assert one.take(presence, 0.0) is None
    assert (one.present, one.most_in_one) == (["r1"], 1)


# --- tokens that nobody stands behind ---


def test_a_token_without_a_join_takes_no_place() -> None:
    one = membership()
    one.take(token("r1", "forged"), 0.0)
    assert one.present == []
    assert one.place("r1", "a", 0.0) == "r1"
    one.take(token("r1", "a"), 0.0)
    assert one.present == ["r1"]
    one.take(token("r1", "forged", alive=False), 1.0)
    assert kinds(one, 2.0) == []
    assert one.present == ["r1"]


def test_a_second_process_of_one_name_is_named_once_and_ignored() -> None:
    one = membership(("r1", "a"))
    note = one.take(token("r1", "b"), 0.0)
    assert note is not None
    assert (note.kind, note.robot) == ("duplicate", "r1")
    assert one.take(token("r1", "b"), 0.0) is None
    assert one.present == ["r1"]
    with pytest.raises(PeerError, match="'r1' is here already"):
        one.place("r1", "b", 0.0)
    one.take(token("r1", "a", alive=False), 1.0)
    assert kinds(one, 1.0 + LATER) == [("gone", "r1")], "who only announces itself does not stand in for it"
    assert one.present == []


def test_a_flood_of_tokens_fills_neither_memory_nor_the_list_of_events() -> None:
    one = membership(("r1", "a"))
    notes = [one.take(token("r1", f"forged-{number}"), 0.0) for number in range(10 * STRANGERS)]
    assert sum(note is not None for note in notes) <= STRANGERS
    one.take(token("r1", "a", alive=False), 0.0)
    one.take(token("r1", "a"), 0.1)
    assert one.present == ["r1"], "who has joined always finds room"
    remembered = 0
    for session in range(2 * STRANGERS):
        other = membership()
        for number in range(2 * STRANGERS):
            other.take(token("r1", f"forged-{number}"), 0.0)
        other.place("r1", f"forged-{session}", 0.0)
        remembered += other.present == ["r1"]
    assert remembered == STRANGERS


# --- who has gone ---


def test_who_loses_its_token_has_gone_after_a_while_and_who_comes_back_before_has_not() -> None:
    one = membership(("r1", "a"), ("r2", "b"))
    for name, session in (("r1", "a"), ("r2", "b")):
        one.take(token(name, session, alive=False), 1.0)
    assert kinds(one, 1.0 + HOLD / 2) == []
    assert one.is_unsettled
    one.take(token("r2", "b"), 1.0 + HOLD / 2)
    assert kinds(one, 1.0 + LATER) == [("gone", "r1")]
    assert kinds(one, 1.0 + 2 * LATER) == []
    assert one.present == ["r2"]
    assert not one.is_unsettled


def test_a_new_process_takes_the_place_of_one_that_was_killed_at_once_and_the_end_is_told() -> None:
    one = membership(("r1", "a"))
    one.take(token("r1", "a", alive=False), 1.0)
    assert one.place("r1", "b", 1.0 + HOLD / 2) == "r1"
    assert kinds(one, 1.0 + HOLD / 2) == [("gone", "r1")]
    one.take(token("r1", "b"), 1.0 + HOLD)
    assert one.present == ["r1"]
    assert kinds(one, 1.0 + LATER) == []


@pytest.mark.parametrize("tokens_first", [True, False])
def test_when_the_router_goes_nobody_has_gone_and_all_are_expected(tokens_first: bool) -> None:
    one = membership(("r1", "a"), ("r2", "b"))
    gone = [token("r1", "a", alive=False), token("r2", "b", alive=False)]
    if tokens_first:
        for presence in gone:
            one.take(presence, 1.0)
    one.link(up=False, now=1.0)
    if not tokens_first:
        for presence in gone:
            one.take(presence, 1.0)
    assert kinds(one, 1000.0) == [], "the router may stay away for long"
    assert (one.present, one.members, sorted(one.robots_awaited)) == ([], ["r1", "r2"], ["r1", "r2"])
    one.link(up=True, now=1000.0)
    one.take(token("r2", "b"), 1000.1)
    assert one.robots_awaited
    assert one.present == ["r2"], "nobody joins again"
    assert kinds(one, 1000.0 + 0.9 * BACK) == []
    assert kinds(one, 1000.1 + BACK) == [("gone", "r1")]
    assert not one.robots_awaited


def test_after_the_world_was_away_its_robots_are_expected_and_have_to_join() -> None:
    one = membership()
    one.take(token("r1", "a"), 0.0)  # it lives, and has not noticed yet that this is another process
    one.expect(["r1", "r2", "r9"], BACK)
    assert one.robots_awaited
    one.place("r1", "a", 0.1)
    assert one.present == ["r1"], "its token was there"
    one.place("r2", "b", 0.1)
    one.take(token("r2", "b"), 0.2)
    assert not one.robots_awaited
    assert kinds(one, 2 * BACK) == []


def test_a_place_that_is_expected_back_is_the_last_to_be_given_away() -> None:
    one = Membership(["r1", "r2"], watchers=0, now=0.0)
    one.expect(["r1"], BACK)
    assert one.place(None, "new", 0.0) == "r2"


def test_absence_is_counted_while_the_clock_runs() -> None:
    one = membership(("r1", "a"))
    for now in range(1, 11):
        one.look(float(now), running=now > 4)
    assert (one.absence_time("r2"), one.absence_time("r1")) == (6.0, 0.0)
    one.place("r2", "b", 11.0)
    one.take(token("r2", "b"), 11.0)
    assert one.absence_time("r2") == 0.0


# --- places ---


def test_places_are_given_in_order_and_promised_for_a_while() -> None:
    one = Membership(["r1", "r2"], watchers=0, now=0.0)
    assert [one.place(None, session, 0.0) for session in "ab"] == ["r1", "r2"]
    with pytest.raises(PeerError, match="all 2 places are taken"):
        one.place(None, "c", 0.0)
    assert one.place(None, "c", PROMISED + 0.1) == "r1"
    with pytest.raises(PeerError, match="expected one of r1, r2, got 'r9'"):
        one.place("r9", "c", 0.0)


# --- leaving ---


def test_who_leaves_is_gone_with_its_token_and_its_place_is_free() -> None:
    one = membership(("r1", "a"), ("r2", "b"))
    assert not one.leave("r1", "a", 0.0)
    note = one.take(token("r1", "a", alive=False), 0.0)
    assert note is not None
    assert (note.kind, note.robot) == ("left", "r1")
    assert (one.present, one.is_unsettled) == (["r2"], False)
    assert kinds(one, LATER) == [], "nobody lost it"
    assert one.place("r1", "c", LATER) == "r1"
    one.take(token("r1", "c"), LATER)
    assert one.present == ["r1", "r2"]


@pytest.mark.parametrize(("name", "session"), [("r1", "b"), ("r3", "a"), ("r9", "a")])
def test_nobody_else_can_make_a_robot_leave(name: str, session: str) -> None:
    one = membership(("r1", "a"), ("r2", "b"))
    with pytest.raises(PeerError, match=f"{name}: expected the session that has this place"):
        one.leave(name, session, 0.0)
    assert one.present == ["r1", "r2"]


def test_who_leaves_while_it_is_expected_back_is_not_waited_for() -> None:
    one = membership(("r1", "a"))
    one.link(up=False, now=0.0)
    assert one.robots_awaited
    assert one.leave("r1", "a", 0.0)
    assert not one.robots_awaited


def test_a_leave_in_the_name_of_a_robot_that_stays_changes_nothing() -> None:
    one = membership(("r1", "a"))
    one.leave("r1", "a", 0.0)
    assert one.present == ["r1"]
    assert one.take(token("r1", "a", alive=False), PARTING) is None, "this was no leaving"
    assert kinds(one, PARTING + LATER) == [("gone", "r1")]


# --- in whose name ---


@pytest.mark.parametrize(
    ("told", "attached", "believed"),
    [(None, None, True), (None, 7, True), (7, 7, True), (7, 8, False), (7, None, False)],
)
def test_only_the_process_that_has_the_place_speaks_in_its_name(
    told: int | None, attached: int | None, believed: bool
) -> None:
    one = membership()
    assert not one.speaks("r1", attached), "nobody has the place yet"
    one.place("r1", "a", 0.0, told)
    assert not one.speaks("r1", attached)
    one.take(token("r1", "a"), 0.0)
    assert one.speaks("r1", attached) is believed
    assert not one.speaks("r2", attached)
    assert not one.speaks("r9", attached), "there is no such robot"


def test_who_asks_without_end_and_is_not_there_keeps_nobody_out() -> None:
    one = membership(("r1", "a"))
    one.take(token("r1", "a", alive=False), 1.0)
    for number in range(100):
        one.place("r1", f"forged-{number}", 1.0 + number / 100)
        if number == 50:
            one.place("r1", "b", 1.5, 7)
    assert kinds(one, 2.0) == [("gone", "r1")]
    assert one.present == []
    one.take(token("r1", "b"), 2.0)
    assert one.present == ["r1"]
    assert one.speaks("r1", 7)
    with pytest.raises(PeerError, match="'r1' is here already"):
        one.place("r1", "forged", 2.0)


def test_sessions_that_were_welcomed_and_never_came_are_forgotten() -> None:
    one = membership(("r1", "a"))
    one.take(token("r1", "a", alive=False), 0.0)
    for number in range(1000):
        one.place("r1", f"forged-{number}", float(number))
    known = 0
    for number in range(1000):
        try:
            one.place("r1", f"forged-{number}", 999.0, sender=9)
        except PeerError:
            known += 1  # it joined with another sender
    assert 0 < known <= 2 + PROMISED


@pytest.mark.parametrize("name", ["r1", "r2", None])
def test_nobody_changes_the_sender_of_a_session_by_joining_in_its_name(name: str | None) -> None:
    one = Membership(ROBOTS, watchers=0, now=0.0)
    one.place("r1", "a", 0.0, sender=7)
    one.take(token("r1", "a"), 0.0)
    with pytest.raises(PeerError, match="expected the sender that this session joined with"):
        one.place(name, "a", 1.0, sender=8)
    assert one.speaks("r1", 7)
    assert not one.speaks("r1", 8)
    assert one.place("r1", "a", 2.0, sender=7) == "r1", "the process itself may ask again"


def test_a_second_process_that_was_welcomed_takes_the_place_when_the_first_goes() -> None:
    one = Membership(ROBOTS, watchers=0, now=0.0)
    for session in ("a", "b"):
        one.place("r1", session, 0.0)
    for session in ("a", "b"):
        one.take(token("r1", session), 0.1)
    one.take(token("r1", "a", alive=False), 1.0)
    assert "r1" in one.present
    assert kinds(one, 1.0 + LATER) == [("gone", "r1")], "the end of the first is told"
    assert "r1" in one.present
    one.take(token("r1", "b", alive=False), 2.0)
    assert kinds(one, 2.0 + LATER) == [("gone", "r1")]
    assert "r1" in one.absent_robots
