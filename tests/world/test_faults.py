"""Faults of a drill: drawn from the seed, and of the stated duration."""

from collections.abc import Mapping
from itertools import groupby
from math import cos, inf
from typing import Any

import pytest

from swarm.geometry import bearing, distance
from swarm.robot.driving.lateness import Lateness
from swarm.robot.driving.safety import SafetyFilter
from swarm.scenario.load import load
from swarm.traffic.obstacles.detector import ObstacleDetector
from tests.shared import ROOT, scenario_of
from tests.traffic.maps import BAY
from world.faults import LASTS, Drill, Faults, Health
from world.simulate import Simulation
from world.world import World

DT = 0.05  # s
FLEET = ("r1", "r2", "r3")
HOUR = 3600.0  # s
CROSSING = ROOT / "scenarios" / "crossing.yaml"


def histories(
    faults: Faults, seed: int = 1, until: float = 200.0, leads: Mapping[str, float] | None = None
) -> dict[str, list[Health]]:
    """Ask after every robot, tick by tick; ``leads``: from when on [s] a robot leads."""
    drill = Drill(faults, seed, DT)
    since = leads or {}
    found: dict[str, list[Health]] = {name: [] for name in FLEET}
    for tick in range(round(until / DT)):
        for name in FLEET:
            found[name].append(drill.health(name, tick * DT, leads=tick * DT >= since.get(name, inf)))
    return found


def spells(history: list[Health], kind: Health) -> list[int]:
    """List how many ticks each fault of a kind lasts; the last one may be cut off by the end."""
    return [len(list(ticks)) for health, ticks in groupby(history) if health is kind]


def test_the_same_seed_draws_the_same_faults_and_another_seed_others() -> None:
    one, same, other = (histories(Faults(held_up=20.0, suspended=30.0), seed) for seed in (1, 1, 2))
    assert one == same != other


# fmt: off
KINDS = {  # faults, what may befall a robot
    "nothing":    (Faults(), {Health.WELL}),
    "held up":    (Faults(held_up=20.0), {Health.WELL, Health.HELD_UP}),
    "suspended":  (Faults(suspended=20.0), {Health.WELL, Health.SUSPENDED}),
    "both":       (Faults(held_up=20.0, suspended=20.0), {Health.WELL, Health.HELD_UP, Health.SUSPENDED}),
}
# fmt: on


@pytest.mark.parametrize("name", KINDS)
def test_only_what_is_asked_for_befalls_a_robot_and_all_of_that_does(name: str) -> None:
    faults, kinds = KINDS[name]
    for history in histories(faults).values():
        assert set(history) == kinds


@pytest.mark.parametrize("kind", [Health.HELD_UP, Health.SUSPENDED])
def test_what_passes_passes_after_five_seconds(kind: Health) -> None:
    assert LASTS == 5.0
    faults = Faults(held_up=100.0) if kind is Health.HELD_UP else Faults(suspended=100.0)
    for history in histories(faults, until=HOUR / 4).values():
        lasted = spells(history[: -round(LASTS / DT)], kind)
        assert lasted
        one = round(LASTS / DT)
        assert all(one <= ticks <= one + 1 or ticks >= 2 * one for ticks in lasted), "a new one may follow at once"


@pytest.mark.parametrize("often", [30.0, 120.0])
def test_faults_come_about_as_often_as_asked_for(often: float) -> None:
    well = 0.0
    began = 0
    for history in histories(Faults(held_up=often), until=4 * HOUR).values():
        well += history.count(Health.WELL) * DT
        began += len(spells(history, Health.HELD_UP))
    assert well / began == pytest.approx(often, rel=0.15)


def test_the_first_that_leads_from_then_on_dies_and_no_other_leader_does() -> None:
    leads = {"r1": 0.0, "r2": 30.0, "r3": 15.0}
    history = histories(Faults(kill_leader_at=20.0), until=60.0, leads=leads)
    died = round(20.0 / DT)
    assert set(history["r1"][:died]) == {Health.WELL}
    assert set(history["r1"][died:]) == {Health.DEAD}
    assert set(history["r2"]) == set(history["r3"]) == {Health.WELL}


def test_nobody_dies_where_nobody_leads() -> None:
    assert all(set(history) == {Health.WELL} for history in histories(Faults(kill_leader_at=0.0)).values())


def test_those_named_die_when_they_are_to_whatever_else_goes_wrong() -> None:
    history = histories(Faults(held_up=20.0, killed={"r2": 50.0, "r3": inf}))
    died = round(50.0 / DT)
    assert Health.DEAD not in history["r2"][:died]
    assert set(history["r2"][died:]) == {Health.DEAD}
    assert all(Health.DEAD not in history[name] for name in ("r1", "r3"))


def test_the_drill_keeps_account_of_the_dead_and_the_struck() -> None:
    drill = Drill(Faults(killed={"r1": 1.0}, held_up=1e-9), 1, DT)
    for name in FLEET:
        drill.health(name, 1.0, leads=False)
    assert drill.dead == {"r1": 1.0}
    assert drill.struck == {"r1"}, "who is held up still speaks"
    suspended = Drill(Faults(suspended=1e-9), 1, DT)
    assert suspended.health("r2", 0.0, leads=False) is Health.SUSPENDED
    assert suspended.struck == {"r2"}
    assert [Drill(Faults(late=late), 1, DT).late for late in (0.0, 0.05, 0.2)] == [0, 1, 4]


def test_only_who_tells_a_joint_plan_leads() -> None:
    alone = Simulation.of(scenario_of(traffic={"cell": 1.2}), 2, 1, Faults(kill_leader_at=0.0))
    alone.run(10.0)
    assert alone.drill.dead == {}, "they drive, and tell no plan"
    swap = BAY.fleet("ab", "ba", faults=Faults(kill_leader_at=0.0))
    led: dict[str, float] = {}
    while not swap.drill.dead and swap.world.time < 60.0:
        for name, told in swap.step().spoken.items():
            if told.traffic is not None and told.traffic.own.plan is not None:
                led.setdefault(name, swap.world.time)
    assert list(swap.drill.dead) == list(led) != []


def test_slow_robots_are_late_by_their_own_changing_number_of_ticks_and_all_they_say_is_heard_in_order() -> None:
    slow = Simulation.of(load(CROSSING), 4, 1, Faults(slow=0.4))
    late: dict[str, set[int]] = {name: set() for name in slow.world.robots}
    heard: dict[tuple[str, str], list[int]] = {}
    for _ in range(600):
        tick = slow.step()
        for number, command in enumerate(slow.world.tasks.commands):
            late[slow.world.robots[number]].add(slow.world.tick - 1 - command.tick)
        for name, sense in tick.senses.items():
            for sender, sent in sense.hears:
                heard.setdefault((name, sender), []).append(sent)
    assert all(len(ticks) > 4 and max(ticks) >= 6 for ticks in late.values())
    assert all(ticks == sorted(set(ticks)) for ticks in heard.values())
    assert slow.run(300.0)["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}


ACROSS = """\
################
#..............#
#..............#
#..............#
#..............#
#..............#
#..............#
#..............#
#..............#
################
"""
MEETING: dict[str, Any] = {  # the world in which a late robot drove at 0.4 m/s within 0.1 m of a mover that it saw
    "map": {"text": ACROSS, "cell": 0.5},
    "robots": 2,
    "seed": 14,
    "start": {"poses": [[6.05377, 2.97231, -1.0338], [2.13459, 3.21164, 0.89879]]},
    "targets": [[2.49, 3.25], [4.98, 1.87], [5.14, 2.17]],
    "patrol": True,
    "return_home": False,
    "reach": 0.4,
    "robot": {"radius": 0.2, "track_width": 0.4, "speed_scale": 0.4},
    "movers": [
        {"radius": 0.25, "speed": 0.23, "waypoints": [[5.26, 2.99], [6.73, 1.77]]},
        {"radius": 0.25, "speed": 0.43, "waypoints": [[1.63, 1.61], [6.49, 2.05], [2.51, 3.47]], "loop": True},
    ],
}


def towards_movers() -> float:
    """Run that world for 4 s with answers 0.2 s late; return the fastest approach [m/s] within 0.1 m of a mover."""
    scenario = scenario_of(ACROSS, **MEETING)
    simulation, found = Simulation.of(scenario, 2, 14, Faults(late=0.2)), [0.0]

    def look(world: World) -> None:
        for pose, wheels in zip(world.poses(), world.bodies.wheels, strict=True):
            for there in world.mover_poses():
                away = distance(pose, there)
                if away - 0.2 - 0.25 < 0.1:
                    found.append(sum(wheels) / 2 * cos(bearing(pose, there)))

    simulation.run(limit=4.0, watch=look)
    return max(found)


def test_a_robot_with_late_answers_does_not_drive_at_a_mover_that_it_sees(monkeypatch: pytest.MonkeyPatch) -> None:
    assert towards_movers() < 0.05
    monkeypatch.setattr(SafetyFilter, "near_threats", lambda *_: inf)
    monkeypatch.setattr(Lateness, "expected_commands", lambda _: ())
    detect = ObstacleDetector.detect
    monkeypatch.setattr(ObstacleDetector, "detect", lambda *known: detect(*known)._replace(bodies=()))
    assert towards_movers() > 0.3, "the world shows nothing any more: find another one"
