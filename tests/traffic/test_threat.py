"""What moves: where it is taken to be while little or nothing of it is seen, and how long it keeps a robot from its way."""

from math import cos, hypot, sin

import pytest

from swarm.geometry import Pose
from swarm.maps.occupancy import Point
from swarm.traffic.reservations import Reservations
from swarm.traffic.route_progress import ALONE, BESIDE, RouteProgress
from swarm.traffic.threat import COMING, HALF_WIDTH, KEPT, NOTED, Kept, Threat, Threats

DT = 0.05  # s
HERE = Pose(0.0, 0.0, 0.0)


def rim(middle: Point, *angles: float) -> list[Point]:
    """Return hits on a disc, at angles about its middle [rad]."""
    return [(middle[0] + HALF_WIDTH * cos(angle), middle[1] + HALF_WIDTH * sin(angle)) for angle in angles]


def follow(threats: Threats, began: int, looks: list[tuple[Point, list[float]]]) -> list[Threat | None]:
    """Look at a disc, tick by tick: its middle, and where on its rim rays end."""
    return [threats.look(began + tick, HERE, rim(at, *angles)) for tick, (at, angles) in enumerate(looks)]


def straight(began: int, ticks: int) -> list[Point]:
    return [(1.5 - 0.3 * DT * tick, 0.2) for tick in range(began, began + ticks)]


FACING = [2.6, 2.9, 3.3, 3.6]


def known(ticks: int = 2 * NOTED) -> Threats:
    threats = Threats(DT)
    assert follow(threats, 0, [(at, FACING) for at in straight(0, ticks)])[-1] is not None
    return threats


def test_of_what_one_ray_alone_still_hits_place_and_speed_stay() -> None:
    threats, began = known(), 2 * NOTED
    path = straight(began, 20)
    for at, now in zip(path, follow(threats, began, [(at, [2.2]) for at in path]), strict=True):
        assert now is not None
        assert hypot(now.x - at[0], now.y - at[1]) < 0.05
        assert hypot(now.vx + 0.3, now.vy) < 0.1


def test_what_is_seen_farther_off_does_not_replace_what_is_remembered_nearer() -> None:
    threats, began = known(), 2 * NOTED
    others = [(0.0, -1.8 + 0.4 * DT * tick) for tick in range(COMING // 2)]
    (*_, now) = follow(threats, began, [(at, [1.2, 1.6, 2.0]) for at in others])
    assert now is not None
    assert abs(now.y - 0.2) < 0.1


def test_a_nearer_one_does() -> None:
    threats, began = known(), 2 * NOTED
    others = [(0.0, -0.9 + 0.4 * DT * tick) for tick in range(NOTED)]
    (*_, now) = follow(threats, began, [(at, [1.2, 1.6, 2.0]) for at in others])
    assert now is not None
    assert abs(now.x) < 0.1


def progress(held: tuple[int, ...], *route: int, beside: int = 0) -> RouteProgress:
    steps = (BESIDE,) * beside + (ALONE,) * (len(held) - beside)
    return RouteProgress(Reservations(held, (), 5), steps, route)


@pytest.mark.parametrize(
    ("way", "body", "cell"),
    [
        (progress((1, 2), 3), 1, 2),
        (progress((9, 1, 2), 3, beside=1), 1, 2),
        (progress((9, 1, 2), 3, beside=1), 9, 1),  # it fled: the way begins beside it
        (progress((1,), 2), 1, None),  # others keep it from its next cell
    ],
)
def test_the_next_cell_is_given_up_after_a_while(way: RouteProgress, body: int, cell: int | None) -> None:
    kept = Kept()
    said = [kept.look(way, body, threatened=True) for _ in range(2 * KEPT)]
    assert [one for one in said if one is not None] == ([] if cell is None else [cell, cell])
    assert said[KEPT - 1] == cell


def test_only_ticks_under_a_threat_count() -> None:
    kept, way = Kept(), progress((1, 2), 3)
    said = [kept.look(way, 1, threatened=tick % 2 == 0) for tick in range(2 * KEPT)]
    assert [tick for tick, one in enumerate(said) if one is not None] == [2 * KEPT - 2]


def test_who_gets_on_is_not_kept() -> None:
    kept = Kept()
    ways = [progress((cell, cell + 1), *range(cell + 2, 9)) for cell in range(1, 6)]
    for way in ways:
        for _ in range(KEPT - 1):
            assert kept.look(way, way.reservations.held[0], threatened=True) is None


def test_to_flee_and_come_back_is_not_to_get_on() -> None:
    kept, way = Kept(), progress((9, 1, 2), 3, beside=1)
    said = [kept.look(way, 9 if tick % 40 < 20 else 1, threatened=True) for tick in range(KEPT + 20)]
    assert any(one is not None for one in said)
