"""The lobby: who is present, and how many robots one process is."""

from swarm.bus import Presence
from world.lobby import Lobby


def lobby(*present: tuple[str, str]) -> Lobby:
    one = Lobby([f"r{number}" for number in range(1, 6)], watchers=0, now=0.0)
    for name, session in present:
        one.take(Presence("robot", name, session, alive=True))
    return one


def test_the_most_robots_that_one_process_was_at_a_time() -> None:
    assert lobby().most_in_one == 0
    assert lobby(("r1", "a"), ("r2", "b"), ("r3", "c")).most_in_one == 1
    one = lobby(("r1", "a"), ("r2", "b"), ("r3", "b"), ("r4", "a"), ("r5", "b"))
    assert one.most_in_one == 3
    for name in ("r2", "r3", "r5"):
        one.take(Presence("robot", name, "b", alive=False))
    for name in ("r2", "r3"):
        one.take(Presence("robot", name, "c", alive=True))
    assert one.most_in_one == 3, "what was is not forgotten"


def test_a_process_that_is_told_twice_or_of_another_kind_counts_once_or_not() -> None:
    one = lobby(("r1", "a"), ("r1", "a"), ("r9", "a"))
    one.take(Presence("dashboard", "r2", "a", alive=True))
    assert one.most_in_one == 1
