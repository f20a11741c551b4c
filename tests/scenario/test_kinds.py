"""Robots unlike each other in a scenario: kinds, mixes, and what each robot has of its own."""

from itertools import pairwise
from typing import Any

import pytest

from swarm.errors import ConfigError
from swarm.kinds import (
    all_bodies,
    format_mix,
    kind_of,
    list_kinds,
    list_views,
    parse_mix,
    settings_of,
    start_of,
    targets_of,
)
from swarm.scenario.check import check
from swarm.scenario.load import Scenario, load
from swarm.scenario.starts import starts
from swarm.settings import MOST_ROBOTS
from tests.shared import ROOT, mostly_long, scenario_of
from world.simulate import Simulation

MIXED = ROOT / "scenarios" / "mixed.yaml"
KINDS: dict[str, Any] = {"cart": {"radius": 0.35, "speed_scale": 0.1}, "scout": {"wheel_acceleration": 3.0}}
HALF = """\
##############
#............#
#............#
#............#
######.#######
#............#
#............#
#............#
##############
"""  # squares of 1 m: the door lets nobody through who is wider than 1 m


def fleet(**fields: Any) -> Scenario:  # noqa: ANN401
    return scenario_of(**({"kinds": KINDS, "robots": {"cart": 1, "scout": 2}} | fields))


# fmt: off
MIXES: dict[str, int | dict[str, int]] = {
    "8":              8,
    "scout=6,cart=2": {"scout": 6, "cart": 2},
    "cart=1":         {"cart": 1},
    "a-b.c_1=3":      {"a-b.c_1": 3},
}
NO_MIXES = ("", "0", "-1", "2.5", "scout", "scout=", "=3", "scout=0", "scout=-1", "scout=1,scout=2", "3,cart=1",
            f"{MOST_ROBOTS + 1}", f"a={MOST_ROBOTS},b=1", "cart=1;scout=2", "cart=one")
WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "a number":                   ({"robots": 3}, "robots: expected how many of each kind, got 3; say it as cart=1,scout=1"),
    "a kind that is not there":   ({"robots": {"carts": 1}}, "robots: expected kinds of `kinds`, got 'carts'; did you mean 'cart'?"),
    "a mix without kinds":        ({"kinds": {}, "robots": {"cart": 1}}, "got 'cart'; the scenario has no `kinds`"),
    "nobody":                     ({"robots": {}}, "robots: expected at least one robot, got none"),
    "none of a kind":             ({"robots": {"cart": 0}}, "robots"),
    "a wrong field of a kind":    ({"kinds": {"cart": {"radios": 1}}}, "kinds.cart: unknown field 'radios'; did you mean 'radius'?"),
    "a wrong value of a kind":    ({"kinds": {"cart": {"radius": -1}}}, "kinds.cart: radius: expected float > 0.01, got -1"),
    "a kind's wrong sensors":     ({"kinds": {"cart": {"sensors": {"rays": 0}}}}, "kinds.cart: sensors.rays"),
    "a kind on a circle":         ({"kinds": KINDS | {"cart": {"start": {"circle": [5, 3, 2]}}}}, "kinds.cart.start: expected either `area` or `poses`"),
    "a kind's targets and own":   ({"targets": [], "own_targets": [[[7, 2]]] * 3, "kinds": KINDS | {"cart": {"targets": [[7, 3]]}}},
                                   "kinds.cart.targets: expected none"),
    "a list instead of kinds":    ({"kinds": [1]}, "kinds"),
    "text instead of a kind":     ({"kinds": {"cart": "large"}, "robots": {"cart": 1}}, "kinds.cart"),
}
# fmt: on


@pytest.mark.parametrize("text", MIXES)
def test_a_number_or_a_mix_is_read_and_written_again(text: str) -> None:
    assert parse_mix(text) == MIXES[text]
    assert format_mix(MIXES[text]) == text


@pytest.mark.parametrize("text", NO_MIXES)
def test_what_is_neither_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(ConfigError, match=f"--robots: expected 1 to {MOST_ROBOTS}, or how many of each kind"):
        parse_mix(text)


@pytest.mark.parametrize("name", WRONG)
def test_wrong_kinds_are_refused_in_a_sentence(name: str) -> None:
    fields, said = WRONG[name]
    with pytest.raises(ConfigError) as fault:
        fleet(**fields)
    assert said in str(fault.value)


def test_robots_have_their_kinds_in_the_order_of_the_mix() -> None:
    settings = fleet().settings
    assert settings.count == 3
    assert list_kinds(settings) == ["cart", "scout", "scout"]
    assert [kind_of(settings, number) for number in range(3)] == ["cart", "scout", "scout"]


def test_what_a_kind_leaves_out_is_the_scenarios() -> None:
    scenario = fleet(robot={"speed_scale": 0.3}, sensors={"range": 2.0}, controller="careful")
    cart, scout = (scenario.of_robot(number).settings for number in (0, 1))
    assert (cart.robot.radius, cart.robot.speed_scale, cart.robot.wheel_acceleration) == (0.35, 0.1, 2.0)
    assert (scout.robot.radius, scout.robot.speed_scale, scout.robot.wheel_acceleration) == (0.2, 0.3, 3.0)
    assert cart.sensors == scout.sensors == scenario.settings.sensors
    assert cart.controller == scout.controller == "careful"
    assert [body.radius for body in all_bodies(scenario.settings)] == [0.35, 0.2]


def test_of_the_sensors_a_kind_says_only_what_differs() -> None:
    scenario = fleet(sensors={"range": 2.0, "rays": 7}, kinds=KINDS | {"cart": {"sensors": {"range": 3.0}}})
    sensors = scenario.of_robot(0).settings.sensors
    assert (sensors.range, sensors.rays) == (3.0, 7)


def test_a_kind_has_a_controller_of_its_own_over_the_wire_too() -> None:
    scenario = load(MIXED)
    raw = fleet(kinds=KINDS | {"cart": {"controller": "careful"}})
    assert [raw.of_robot(number).settings.controller for number in (0, 1)] == ["careful", "paper"]
    for one in (scenario, raw):
        there = Scenario.from_wire(*one.to_wire())
        assert there.settings == one.settings
        for number in range(one.settings.count):
            assert there.of_robot(number).settings == one.of_robot(number).settings
            assert there.of_robot(number).profile == one.of_robot(number).profile


def test_who_got_its_own_settings_by_wire_still_knows_the_others() -> None:
    """In a welcome ``robot`` is that of the robot's kind: a kind that left its radius out has not that one."""
    cart = fleet().of_robot(0).settings
    assert settings_of(cart, "scout").robot.radius == 0.2


def test_a_kind_may_have_its_own_starts_and_targets() -> None:
    scenario = load(MIXED)
    settings = scenario.settings
    poses = starts(scenario, settings.count, 1)
    assert [pose[:2] for pose in poses[:2]] == [(2.0, 9.4), (2.0, 1.8)]
    assert poses[2][:2] == (6.0, 9.6)
    assert targets_of(settings, 0)[0] == (18.4, 1.8)
    assert targets_of(settings, 2)[0] == (13.2, 7.2)
    section, place = start_of(settings, 3)
    assert (section, place) == (settings.kinds["scout"].start, 1)
    assert scenario.stops(0, (2.0, 9.4))[-1] == (2.0, 9.4)


def test_robots_of_two_kinds_are_drawn_into_one_area_each_into_a_cell_of_its_own() -> None:
    scenario = fleet(start={"area": [1.0, 1.0, 9.0, 5.0]}, kinds=KINDS | {"cart": {"radius": 0.4}})
    poses = starts(scenario, 3, 7)
    cells = {
        (round(x / scenario.settings.traffic.cell), round(y)) for x, y, _ in poses if scenario.settings.traffic.cell
    }
    assert len(cells) == 3
    assert starts(scenario, 3, 7) == poses


def test_each_kind_is_asked_for_its_own_starts_and_targets_when_cells_are_chosen() -> None:
    plain = scenario_of().settings
    assert list_views(plain) == [plain]
    cart, scout = list_views(load(MIXED).settings)
    assert (cart.robot.radius, cart.count, len(cart.start.poses or ()), cart.targets[0]) == (0.35, 2, 2, (18.4, 1.8))
    assert (scout.robot.radius, scout.count, len(scout.start.poses or ()), scout.kinds) == (0.2, 6, 6, {})
    own = fleet(targets=[], own_targets=[[[7.5, 2.5]], [[7.5, 3.5]], [[7.5, 4.5]]])
    assert [view.own_targets for view in list_views(own.settings)] == [[[(7.5, 2.5)]], [[(7.5, 3.5)], [(7.5, 4.5)]]]


def test_a_target_that_only_scouts_reach_counts_for_scouts_alone() -> None:
    """The room behind the door is theirs: cells are chosen as if the cart had no targets there."""
    fields, _ = REFUSED["a door that is too narrow for one kind"]
    kinds = {"cart": {"radius": 0.55, "track_width": 0.8, "targets": [[11.5, 2.5]]}, "scout": {}}
    scenario = fleet(**fields | {"kinds": kinds, "robots": {"cart": 1, "scout": 2}})
    report = Simulation.of(check(scenario, 3, 1).scenario, 3, 1).run(limit=400.0)
    assert report["complete"], report["reason"]
    assert sum(report["contacts"].values()) == report["traffic"]["overlaps"] == report["traffic"]["outside"] == 0


# fmt: off
REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "bodies that touch at the start": (
        {"start": {"poses": [[2.5, 2.5, 0], [3.0, 2.5, 0], [6.5, 2.5, 0]]}, "kinds": {"cart": {"radius": 0.35}, "scout": {}}},
        "expected r1 and r2 at least 0.55 m apart, got 0.50 m"),
    "a target too near a wall for one kind": (
        {"targets": [[8.7, 3.5]], "kinds": {"cart": {"radius": 0.45}, "scout": {}}},
        "target 1 at (8.7, 3.5): expected at least 0.45 m from any wall"),
    "two bodies on one square": (
        {"start": {"poses": [[2.5, 2.5, 0], [3.2, 2.5, 0], [6.5, 2.5, 0]]}, "traffic": {"cell": 1.2, "offset": [0.0, 0.0]}},
        "expected r1 at (2.5, 2.5) and r2 at (3.2, 2.5) "),
    "a door that is too narrow for one kind": (
        {"text": HALF, "start": {"poses": [[2.5, 2.5, 0], [5.5, 2.5, 0], [8.5, 2.5, 0]]}, "targets": [[6.5, 6.5]],
         "kinds": {"cart": {"radius": 0.55, "track_width": 0.8}, "scout": {}}},
        "target 1 of r1 at (6.5, 6.5): expected a way from (2.50, 2.50) wide enough for a radius of 0.55 m"),
}
# fmt: on


@pytest.mark.parametrize("name", REFUSED)
def test_what_does_not_fit_one_kind_is_said_before_the_start(name: str) -> None:
    fields, said = REFUSED[name]
    with pytest.raises(ConfigError) as fault:
        check(fleet(**fields), 3, 1)
    assert said in str(fault.value)


def test_the_door_that_shuts_out_a_cart_lets_scouts_through() -> None:
    fields, _ = REFUSED["a door that is too narrow for one kind"]
    scenario = fleet(**fields | {"robots": {"scout": 3}})
    report = Simulation.of(check(scenario, 3, 1).scenario, 3, 1).run(limit=300.0)
    assert report["complete"], report["reason"]
    assert sum(report["contacts"].values()) == report["traffic"]["overlaps"] == report["traffic"]["outside"] == 0


def test_a_kind_that_is_the_scenarios_one_robot_changes_no_bit() -> None:
    paper = load(ROOT / "scenarios" / "paper.yaml")
    kinds = fleet(kinds={"plain": {}}, robots={"plain": 4}).settings.kinds
    one = paper.with_settings(
        type(paper.settings)(
            **{  # the same file with a kind that has nothing of its own
                field: getattr(paper.settings, field) for field in paper.settings.__struct_fields__
            }
            | {"kinds": {"plain": type(kinds["plain"])()}, "robots": {"plain": 2}}
        )
    )
    runs = [Simulation.of(scenario, 2, 1).run(limit=30.0) for scenario in (one, paper)]
    assert runs[0]["digest"] == runs[1]["digest"]


@pytest.mark.parametrize("seed", mostly_long("a whole mission of 8 robots", [1, 2], 1))
def test_the_mixed_scenario_is_complete_and_nobody_touches(seed: int) -> None:
    scenario = load(MIXED)
    report = Simulation.of(check(scenario, 8, seed).scenario, 8, seed).run()
    assert report["complete"], report["reason"]
    assert sum(report["contacts"].values()) == report["traffic"]["overlaps"] == report["traffic"]["outside"] == 0
    arrivals = [row["reached"] for row in report["per_robot"].values()]
    assert all(earlier < later for row in arrivals for earlier, later in pairwise(row))
    speeds = [row["path_length"] / row["reached"][-1] for row in report["per_robot"].values()]
    assert max(speeds[:2]) <= 0.6, "the carts"
