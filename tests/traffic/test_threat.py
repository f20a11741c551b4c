"""What moves keeps a robot from its way: how long that is borne, and what does not count."""

import pytest

from swarm.traffic.holds import Ledger
from swarm.traffic.threat import KEPT, Kept
from swarm.traffic.walk import ALONE, BESIDE, Walk


def walk(held: tuple[int, ...], *route: int, beside: int = 0) -> Walk:
    steps = (BESIDE,) * beside + (ALONE,) * (len(held) - beside)
    return Walk(Ledger(held, (), 5), steps, route)


@pytest.mark.parametrize(
    ("way", "body", "cell"),
    [
        (walk((1, 2), 3), 1, 2),
        (walk((9, 1, 2), 3, beside=1), 1, 2),
        (walk((9, 1, 2), 3, beside=1), 9, 1),  # it fled: the way begins beside it
        (walk((1,), 2), 1, None),  # others keep it from its next cell
    ],
)
def test_the_next_cell_is_given_up_after_a_while(way: Walk, body: int, cell: int | None) -> None:
    kept = Kept()
    said = [kept.look(way, body, threatened=True) for _ in range(2 * KEPT)]
    assert [one for one in said if one is not None] == ([] if cell is None else [cell, cell])
    assert said[KEPT - 1] == cell


def test_only_ticks_under_a_threat_count() -> None:
    kept, way = Kept(), walk((1, 2), 3)
    said = [kept.look(way, 1, threatened=tick % 2 == 0) for tick in range(2 * KEPT)]
    assert [tick for tick, one in enumerate(said) if one is not None] == [2 * KEPT - 2]


def test_who_gets_on_is_not_kept() -> None:
    kept = Kept()
    ways = [walk((cell, cell + 1), *range(cell + 2, 9)) for cell in range(1, 6)]
    for way in ways:
        for _ in range(KEPT - 1):
            assert kept.look(way, way.ledger.held[0], threatened=True) is None


def test_to_flee_and_come_back_is_not_to_get_on() -> None:
    kept, way = Kept(), walk((9, 1, 2), 3, beside=1)
    said = [kept.look(way, 9 if tick % 40 < 20 else 1, threatened=True) for tick in range(KEPT + 20)]
    assert any(one is not None for one in said)
