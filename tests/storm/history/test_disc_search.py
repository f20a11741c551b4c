"""The search over the drawing that judges floors of halls: by floors known by heart, and by runs with planted ends."""

from pathlib import Path

import msgspec
import pytest

from swarm.geometry import distance
from swarm.maps.text import from_text
from swarm.storm.history.disc_search import can_all_arrive_on_drawing
from swarm.storm.history.history import record
from swarm.storm.laws.mission import all_arrive
from swarm.storm.plans.draw import draw
from tests.storm.shared import plan_of

LENGTH = 40  # squares of 0.1 m
ENDS = [(0.6, 0.5), (3.6, 0.5)]  # m


def hall(width: int, bay: int = 0) -> str:
    """Draw a hall, ``width`` squares of 0.1 m across, with a bay in the middle that is ``bay`` squares deep."""
    lines = ["#" + "." * LENGTH + "#"] * width
    bays = ["#" * 16 + "." * 10 + "#" * 16] * bay
    return "\n".join(["#" * (LENGTH + 2), *bays, *lines, "#" * (LENGTH + 2)]) + "\n"


@pytest.mark.parametrize(("width", "bay", "swap"), [(10, 0, True), (9, 0, False), (7, 0, False), (7, 6, True)])
def test_two_discs_change_places_only_where_there_is_room(width: int, bay: int, swap: bool) -> None:
    floor = from_text(hall(width, bay), 0.1)
    assert can_all_arrive_on_drawing(floor, 0.2, ENDS, [[ENDS[1]], [ENDS[0]]], 0.3) is swap
    assert can_all_arrive_on_drawing(floor, 0.2, ENDS[:1], [[ENDS[1], ENDS[0]]], 0.3)


def test_a_disc_does_not_pass_a_wall_or_leave_its_stops_out() -> None:
    floor = from_text(hall(10), 0.1).edit_rectangle(1, (2.0, 0.0), (2.1, 1.2))[0]
    assert can_all_arrive_on_drawing(floor, 0.2, ENDS[:1], [[ENDS[1]]], 0.3) is False
    assert can_all_arrive_on_drawing(floor, 0.2, ENDS[:1], [[ENDS[0], ENDS[1], ENDS[0]]], 0.3) is False
    assert can_all_arrive_on_drawing(floor, 0.2, [(2.05, 0.5)], [[(2.05, 0.5)]], 0.3) is False


@pytest.mark.parametrize(("width", "broken"), [(10, True), (7, False)])
def test_who_does_not_arrive_breaks_the_law_only_if_the_drawing_has_a_way(width: int, broken: bool) -> None:
    """The run ends too early; cells of 1.2 m know no way in either hall."""
    plan = plan_of(
        map={"text": hall(width), "cell": 0.1},
        start={"poses": [[*ENDS[0], 0.0], [*ENDS[1], 3.0]]},
        own_targets=[[list(ENDS[1])], [list(ENDS[0])]],
        traffic={},
        limit=2.0,
    )
    history = record(plan)
    assert history.is_drawn
    assert bool(list(all_arrive(history))) is broken
    given = msgspec.structs.replace(plan.scenario, traffic=history.settings.traffic)
    assert not record(msgspec.structs.replace(plan, scenario=given)).is_drawn


@pytest.mark.parametrize("seed", range(3))
def test_a_floor_of_halls_is_drawn_off_any_lattice(seed: int, tmp_path: Path) -> None:
    plan = draw("halls", seed)
    settings = plan.scenario
    assert (settings.traffic.cell, settings.traffic.offset) == (None, None)
    places = [pose[:2] for pose in settings.start.poses or ()]
    assert all(distance(a, b) > 0.8 for number, a in enumerate(places) for b in places[:number])
    text = settings.map.text
    assert text is not None
    floor = from_text(text, settings.map.cell)
    assert can_all_arrive_on_drawing(floor, settings.robot.radius, places[:1], settings.own_targets[:1], settings.reach)
