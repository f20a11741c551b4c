"""Laws find faults that are planted in traffic, driving or the world: a constant or a function is replaced.

Without the fault the same world keeps that law.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from math import inf
from typing import Any, Final, NamedTuple

import pytest
from msgspec.structs import replace as changed

from swarm.messages.traffic import TrafficBroadcast
from swarm.robot import brain, pose_estimate
from swarm.robot.driving import cell_pilot, safety
from swarm.robot.driving.cell_pilot import CellPilot
from swarm.robot.driving.lateness import LateLimiter
from swarm.robot.driving.safety import SafetyFilter
from swarm.robot.mission import Mission
from swarm.robot.pose_estimate import Estimate
from swarm.settings import Settings
from swarm.storm.history.history import record
from swarm.storm.laws.judge import judge
from swarm.storm.plans.draw import draw
from swarm.traffic import step
from swarm.traffic.joint.states import FollowedPlan
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.obstacles.inspection import Inspection, Inspector
from swarm.traffic.peers.records import PeerRecords, TrafficNote
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.claims import CellClaimer, ClaimResult
from swarm.traffic.reservations.route import RouteProgress
from swarm.traffic.reservations.rules import GRANT, TAKE, ClaimCase, Reservations
from swarm.traffic.settings import TrafficConstants
from tests.shared import mostly_long
from tests.storm.shared import FLOOR, plan_of
from world.bodies.radio_model import RadioModel, Spoken
from world.host.last_messages import LastMessages
from world.tasks import tasks


class Plant(NamedTuple):
    """A name in a module, a class or a table of rules, and what stands there instead."""

    where: Any
    name: str
    instead: Callable[[Any], Any]  # from what was there

    def put(self, monkeypatch: pytest.MonkeyPatch) -> None:
        if isinstance(self.where, dict):
            monkeypatch.setitem(self.where, self.name, self.instead(self.where[self.name]))
        else:
            monkeypatch.setattr(self.where, self.name, self.instead(getattr(self.where, self.name)))


def traffic(**constants: object) -> Plant:
    """Let the robots drive with other traffic constants than those of the world and the laws."""
    return Plant(brain, "traffic_settings", lambda real: lambda settings: replace(real(settings), **constants))


def always(value: object) -> Callable[[Any], Any]:
    """Replace a function by one that returns a value."""
    return lambda real: lambda *args, **named: value


def no_older_claim_of_mine(case: ClaimCase) -> bool:
    """Judge claims by their ticks alone, not by the robots' names."""
    return not any(mine.cell == case.claim.cell and mine.stamp < case.claim.stamp for mine in case.own.all_claims)


def no_older_claim_of_others(case: ClaimCase) -> bool:
    """Judge claims by their ticks alone, not by the robots' names."""
    others = [claim for notice in case.others.values() for claim in notice.claims]
    return not any(claim.cell == case.claim.cell and claim.stamp < case.claim.stamp for claim in others)


def room_unasked(real: Callable[..., ClaimResult]) -> Callable[..., ClaimResult]:
    """Take each cell beside the way as soon as it is claimed."""

    def claiming(*asked: object) -> ClaimResult:
        claimed = real(*asked)
        for claim in claimed.progress.reservations.beside:
            claimed = claimed._replace(progress=claimed.progress.with_room(claim))
        return claimed

    return claiming


def only_the_newest(real: Callable[..., None]) -> Callable[..., None]:
    """Forget the broadcasts that came before the newest one."""

    def take(self: LastMessages, *message: object) -> None:
        real(self, *message)
        self.sent[:] = self.sent[-1:]

    return take


def numbered_from_one(real: Callable[..., RouteProgress]) -> Callable[..., RouteProgress]:
    """Let a robot that has just started begin the numbers of its claims at 1."""

    def after_sleep(progress: RouteProgress | None, *rest: object) -> RouteProgress:
        begun = real(progress, *rest)
        return begun if progress else begun._replace(reservations=begun.reservations._replace(number=1))

    return after_sleep


def without_relayed(real: Callable[..., list[TrafficNote]]) -> Callable[..., list[TrafficNote]]:
    """Leave out of each broadcast what others have said."""

    def hear(
        self: PeerRecords, tick: int, cells: CellMap, heard: Sequence[TrafficBroadcast], *rest: object
    ) -> list[TrafficNote]:
        return real(self, tick, cells, [changed(one, others=()) for one in heard], *rest)

    return hear


def of_newest_tick(sent: Sequence[Spoken]) -> list[Spoken]:
    """Leave out the broadcasts of robots that answer late."""
    newest = max((tick for _, tick in sent), default=0)
    return [one for one in sent if one[1] == newest]


def strong_brakes(settings: Settings) -> Settings:
    """Return the settings with wheels that brake twice as hard."""
    robot = changed(settings.robot, wheel_acceleration=2 * settings.robot.wheel_acceleration)
    return changed(settings, robot=robot)


def others_first(real: Callable[..., ClaimResult]) -> Callable[..., ClaimResult]:
    """Let r1 claim nothing while another robot drives to its target."""

    def claiming(
        self: CellClaimer, progress: RouteProgress, plan: object, situation: Situation, *rest: object
    ) -> ClaimResult:
        if self.me == "r1" and any(record.goal == situation.goal for record in situation.fresh.values()):
            return ClaimResult(progress.without_claims(), (), took=False)
        return real(self, progress, plan, situation, *rest)

    return claiming


def fault(robot: str, kind: str, tick: int, ticks: int = 0) -> dict[str, object]:
    return {"robot": robot, "kind": kind, "tick": tick, "ticks": ticks}


LIMIT = 60.0  # s
LEFT, RIGHT = [1.8, 1.8, 0.0], [9.0, 1.8, 3.14]  # m and rad; starts that face each other
THERE, BACK = [9.0, 1.8], [1.8, 1.8]  # m
LINES = FLOOR.splitlines()
CORRIDOR = "\n".join((*[LINES[0]] * 6, *LINES[6:]))  # one row of cells
HALL = "\n".join([*["#" * 24] * 3, *["###" + "." * 18 + "###"] * 9, *["#" * 24] * 3])  # three rows of six cells
SHARED = [5.4, 3.0]  # m; a target that all but r1 visit again and again

# fmt: off
WORLDS: dict[str, dict[str, object]] = {  # fields of `plan_of`: two robots in two rows of seven cells
    "swap":     {},
    "one cell": {"start": {"poses": [[3.0, 1.8, 0.0], [7.8, 1.8, 3.14]]}, "own_targets": [[[5.4, 1.8], BACK], [[5.4, 1.8], THERE]]},
    "head on":  {"start": {"poses": [LEFT, RIGHT]}, "own_targets": [[THERE], [BACK]]},
    "loss":     {"start": {"poses": [LEFT, RIGHT]}, "own_targets": [[THERE, BACK], [BACK, THERE]], "radio": {"loss": 0.5}},
    "late":     {"start": {"poses": [LEFT, RIGHT]}, "own_targets": [[THERE], [BACK]], "late": 4},
    "slow":     {"slow": 8},
    "asleep":   {"faults": [fault("r1", "suspended", 90, 100), fault("r2", "suspended", 110, 300)]},
    "away":     {"own_targets": [[[4.2, 1.8], THERE], [[1.8, 3.0]]], "faults": [fault("r1", "away", 200, 60)]},
    "dead":     {"map": {"text": CORRIDOR, "cell": 0.4}, "start": {"poses": [LEFT, RIGHT]},
                 "own_targets": [[[4.2, 1.8], BACK, [5.4, 1.8]], [BACK]], "faults": [fault("r2", "dead", 70)]},
    "queue":    {"map": {"text": HALL, "cell": 0.4}, "robots": 4, "limit": 150.0,
                 "start": {"poses": [[4.2, 4.2, 0.0], [7.8, 3.0, 3.14], [1.8, 1.8, 0.0], [7.8, 4.2, 3.14]]},
                 "own_targets": [[SHARED, [1.8, 4.2]], [SHARED, [7.8, 3.0]] * 12, [SHARED, [1.8, 1.8]] * 12, [SHARED, [7.8, 4.2]] * 12]},
    "wall":     {"edits": [{"at": 2.0, "kind": "wall", "low": [4.9, 1.3], "high": [5.2, 2.3]}]},
}

PLANTED: dict[str, tuple[str, str, tuple[Plant, ...]]] = {  # the law that it breaks; one of WORLDS, or profile and seed; what is replaced
    "held cells let go early": ("no hold without a claim", "one cell", (
        Plant(RouteProgress, "release_behind", lambda real: lambda self, touched, *rest: real(self, (), *rest)),)),
    "margin lost": ("no body outside", "claims 0", (traffic(margin=-0.02),)),
    "plan order ignored": ("all arrive", "dead 7", (Plant(FollowedPlan, "waits_for", always(None)),)),
    "take although held": ("takes only what is free", "claims 2", (Plant(TAKE, "somebody holds it", always(True)),)),
    "no listening": ("listens first", "swap", (traffic(listen=0),)),
    "edit ignored": ("all arrive", "wall", (Plant(CellPilot, "take_floor", always(None)),)),
    "others always first": ("nobody is overtaken for ever", "queue", (Plant(CellClaimer, "step", others_first),)),
    "never looks": ("all arrive", "dead", (Plant(Inspector, "inspect", always(Inspection())),)),
    "grant without 'I hold it'": ("no false agreement", "one cell", (Plant(GRANT, "I hold the cell", always(True)),)),
    "grant without 'older claim'": ("no false agreement", "one cell", (
        Plant(GRANT, "I have an older claim", always(True)),)),
    "take unacknowledged": ("no hold without a claim", "loss", (
        Plant(TAKE, "not all have acknowledged", always(True)),)),
    "no order among claims of one tick": ("no overlap", "one cell", (
        Plant(GRANT, "I have an older claim", lambda _: no_older_claim_of_mine),
        Plant(TAKE, "I have acknowledged an older claim", lambda _: no_older_claim_of_others))),
    "claim numbers used twice": ("claims numbered once", "one cell", (
        Plant(Reservations, "claim", lambda real: lambda self, *asked: real(self, *asked)._replace(number=self.number)),)),
    "resume forgets": ("flags stay", "away", (Plant(Mission, "resume", always(None)),)),
    "braking path forgotten": ("room to brake", "late", (Plant(SafetyFilter, "braking", always(safety.AT_REST)),)),
    "the pose's error forgotten": ("no body outside", "pose 6", (
        Plant(pose_estimate, "_estimate_of", lambda real: lambda *beliefs: real(*beliefs)._replace(error=0.0, yaw_error=0.0)),)),
    "cells without the pose's error": ("no body outside", "pose 7", (
        Plant(CellPilot, "_uncertainty", always(0.0)), Plant(Estimate, "allowance", always(0.0)))),
    "late commands taken as expected": ("room to brake", "slow 910080", (
        Plant(LateLimiter, "limit", lambda _: lambda self, speeds, *_: speeds),)),
    "nothing is slowed": ("no contact", "one cell", (
        Plant(SafetyFilter, "check", lambda _: lambda self, sense, tables, limits: safety.WheelSpeeds(*tables)),)),
    "spare lost": ("no contact", "dead", (Plant(safety, "SAFETY", lambda real: real._replace(gap=-real.gap)),)),
    "room taken without acknowledgement": ("no hold without a claim", "one cell", (
        Plant(CellClaimer, "step", room_unasked),)),
    "room never given back": ("all arrive", "swap", (
        Plant(RouteProgress, "release_behind", lambda real: lambda self, touched, body, room=(), *rest: real(self, touched, body, self.reservations.held, *rest)),)),
    "relayed records dropped": ("all arrive", "strangers 26", (Plant(PeerRecords, "merge_broadcasts", without_relayed),)),
    "brakes taken for twice as strong": ("room to brake", "movers 44", (
        Plant(cell_pilot, "SafetyFilter", lambda real: lambda settings: real(strong_brakes(settings))),)),
    "staleness times 100": ("no wait for the silent", "asleep", (traffic(fresh=4000),)),
    "command timeout ignored": ("no body outside", "asleep", (
        Plant(tasks, "COMMAND", lambda real: replace(real, timeout=inf)),)),
    "claims kept while standing": ("no claim while standing", "claims 0", (
        Plant(RouteProgress, "without_claims", lambda _: lambda self: self),)),
    "ripe at once": ("no hold without a claim", "asleep", (traffic(ripe=0),)),
    "asks half as far": ("no hold without a claim", "late", (
        Plant(TrafficConstants, "asking_distance", lambda _: lambda self, side: min(self.claim_radius, (self.horizon + 1) * side)),)),
    "who answers late is heard by nobody": ("broadcasts are heard", "slow", (
        Plant(RadioModel, "hears", lambda real: lambda self, poses, sent: real(self, poses, of_newest_tick(sent))),)),
    "of several late answers one is not heard": ("broadcasts are heard", "slow", (
        Plant(LastMessages, "take", only_the_newest),)),
    "a new process counts claims from 1": ("claims numbered once", "away 0", (Plant(step, "resume_after_sleep", numbered_from_one),)),
}
# fmt: on


@cache
def broken_without(name: str) -> set[str]:
    """List the laws that a world breaks without any fault; this runs once for all rows."""
    return broken(name)


def broken(name: str) -> set[str]:
    if name in WORLDS:
        plan = plan_of(**{"limit": LIMIT} | WORLDS[name])
    else:
        profile, seed = name.split()
        drawn = draw(profile, int(seed))
        alike = changed(drawn.scenario, kinds={}, robots=drawn.robots)  # all else is drawn as without kinds
        plan = changed(drawn, scenario=changed(alike, limit=LIMIT))
    return {violation.law for violation in judge(record(plan))}


DEAR: Final = {
    "plan order ignored",
    "relayed records dropped",
    "others always first",
    "take although held",
    "brakes taken for twice as strong",
    "a new process counts claims from 1",
    "late commands taken as expected",
    "cells without the pose's error",
}


@pytest.mark.parametrize("name", mostly_long("a minute of several robots, twice", PLANTED, *PLANTED.keys() - DEAR))
def test_a_planted_fault_breaks_its_law(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    law, where, plants = PLANTED[name]
    assert law not in broken_without(where)
    for plant in plants:
        plant.put(monkeypatch)
    assert law in broken(where)
