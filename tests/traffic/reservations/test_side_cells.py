"""The cells beside its way that a robot asks for, one look at a time."""

import pytest
from msgspec.structs import replace

from swarm.messages.traffic import Claim, Record
from swarm.traffic.interface import MovingObstacle
from swarm.traffic.reservations.claims import room_beside
from swarm.traffic.reservations.route import ALONE, BESIDE, RouteProgress
from swarm.traffic.reservations.rules import Reservations
from tests.traffic.maps import Drawn

FLOOR = Drawn("abcdefg", "hijklmn", "opqrstu", "vwxyzAB", "CDEFGHI")
ALL = tuple(range(35))


def progress(held: str, beside: int = 0) -> RouteProgress:
    """Return a way over held cells, the first ``beside`` of them off it."""
    return RouteProgress(Reservations(FLOOR.at(held)), (BESIDE,) * beside + (ALONE,) * (len(held) - beside))


def asked(way: RouteProgress, at: str, others: dict[str, str] | None = None, sweeps: tuple[int, ...] = ALL) -> str:
    """Return the cells asked for by name; ``others`` hold, claim or plan (``ahead``) what is named."""
    told: dict[str, tuple[object, ...]] = {field: FLOOR.at(names) for field, names in (others or {}).items()}
    if others and "claims" in others:
        told["claims"] = tuple(Claim(cell, 1, 0) for cell in FLOOR.at(others["claims"]))
    record = replace(Record(robot="r2", stamp=0, x=0.0, y=0.0, goal=0), **told)
    return named(room_beside(way, FLOOR.pose(*FLOOR.at(at)), sweeps, {"r2": record}, (), FLOOR.cells))


def named(cells: tuple[int, ...]) -> str:
    names = {FLOOR.cell(place): name for name, place in FLOOR.names.items()}
    return "".join(sorted(names[cell] for cell in cells))


# fmt: off
BESIDES: dict[str, tuple[RouteProgress, str, dict[str, str], str]] = {  # way, where it is, what others need: asks for
    "two cells and what is beside them":  (progress("rs"),         "r",  {},                              "klqrstyz"),
    "not what is beside its room":        (progress("krs", 1),     "r",  {},                              "klqrstyz"),
    "in its head cell":                   (progress("rs"),         "s",  {},                              ""),
    "with one cell alone":                (progress("r"),          "r",  {},                              ""),
    "what others hold, claim and plan":   (progress("rs"),         "r",  {"held": "k", "claims": "l", "ahead": "qt"}, "rsyz"),
}
# fmt: on


@pytest.mark.parametrize("name", BESIDES)
def test_the_cells_beside_a_way(name: str) -> None:
    way, at, others, cells = BESIDES[name]
    others = {field: names for field, names in others.items() if names}
    assert asked(way, at, others) == "".join(sorted(cells))
    assert asked(way, at, others, sweeps=()) == ""


# fmt: off
BACK: dict[str, tuple[str, int, str, dict[str, str], str]] = {  # held, how many beside, where it is, others: asks for
    "only a corner is between":           ("jrs",  1, "j", {},               "kq"),
    "of the two one is another's":        ("jrs",  1, "j", {"held": "k"},    "q"),
    "both are another's":                 ("jrs",  1, "j", {"ahead": "kq"},  ""),
    "one of the two is held: kept":       ("qjrs", 2, "j", {},               "kq"),
    "it shares a side with its way":      ("krs",  1, "k", {},               ""),
    "it is on its way":                   ("jrs",  1, "r", {},               ""),
    "two cells off, it drives about":     ("irs",  1, "i", {},               ""),
}
# fmt: on


@pytest.mark.parametrize("name", BACK)
def test_back_to_its_way_round_a_corner(name: str) -> None:
    held, beside, at, others, cells = BACK[name]
    assert asked(progress(held, beside), at, others, sweeps=()) == cells


def threatened(*places: tuple[str, float, float], floor: Drawn = FLOOR, held: str = "") -> str:
    """Return the cells asked for in the middle, with threats some way off the middles of cells [m]."""
    threats = [(floor.pose(*floor.at(name)), dx, dy) for name, dx, dy in places]
    moving = tuple(MovingObstacle(pose.x + dx, pose.y + dy, 0.0, 0.0) for pose, dx, dy in threats)
    others = {"r2": Record(robot="r2", stamp=0, x=0.0, y=0.0, goal=0, held=floor.at(held), ahead=floor.at("k"))}
    return named(room_beside(progress("r"), floor.pose(*floor.at("r")), (), others, moving, floor.cells))


WALLED = Drawn("abcdefg", "hij#lmn", "opqrstu", "vwx.zAB", "CDEFGHI")


def test_before_a_threat_it_asks_for_all_cells_round_it_that_are_farther_off() -> None:
    """A threat on the left of the cell r, in the middle of j k l / q r s / x y z."""
    assert threatened(("q", 0.1, 0.0)) == "jklsxyz"
    assert threatened(("q", -0.1, 0.0)) == "klsyz", "j and x are nearer to it than r"
    assert threatened(("q", 0.1, 0.0), held="s") == "jklxyz", "what another only plans is asked for"
    assert threatened(("k", 0.0, -0.1)) == "jlqsxyz"
    assert threatened(("q", 0.1, 0.0), ("o", 0.0, 0.0)) == "jklsxyz", "the nearer one counts"
    assert threatened(("q", 0.1, 0.0), ("s", -0.1, 0.0)) == "jklxyz"


def test_before_a_threat_it_asks_for_no_cell_that_it_cannot_stand_in() -> None:
    x, y = WALLED.cells.centre(WALLED.at("q")[0])
    got = room_beside(
        progress("r"), WALLED.pose(*WALLED.at("r")), (), {}, (MovingObstacle(x + 0.1, y, 0.0, 0.0),), WALLED.cells
    )
    assert named(got) == "jlsxyz"
