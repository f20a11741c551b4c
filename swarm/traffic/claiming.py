"""Layer 1 of one robot: it asks for the next cells of its route, and takes those that all near have acknowledged."""

from collections.abc import Collection
from math import hypot
from typing import Final, NamedTuple

from swarm.geometry import Pose, distance
from swarm.messages.traffic import Claim
from swarm.traffic.cells import CellMap
from swarm.traffic.following import Following
from swarm.traffic.holds import ASK, TAKE, Case, obstacle
from swarm.traffic.presence import Body
from swarm.traffic.settings import TrafficSettings
from swarm.traffic.sightings import keeps
from swarm.traffic.situation import Situation
from swarm.traffic.walk import Walk

LEANS: Final = 0.1  # m, off the place where a robot leans, or off its cell's middle: see CellMap.is_blind
BESIDE: Final = 4  # cells beside the way claimed at a time
UNANSWERED: Final = 40  # ticks after which one waits for those who have not acknowledged a claim
NOBODY: Final[frozenset[str]] = frozenset()


class Claimed(NamedTuple):
    """What a robot has got, and whom it waits for."""

    walk: Walk
    waits: tuple[str, ...]
    took: bool  # it got a cell of its way


class Claiming:
    """Applies the rules of ``holds`` to the cells a robot wants next, in the order of its way and of its plan."""

    def __init__(self, me: str, cells: CellMap, settings: TrafficSettings) -> None:
        self.me = me
        self.cells = cells
        self.settings = settings

    def step(
        self, walk: Walk, plan: Following | None, situation: Situation, body: Body, room: Collection[int]
    ) -> Claimed:
        """Claim the next cells of the way, and cells to drive in beside it (``room``); take those that are granted."""
        walk, waits = self._ask(walk, plan, situation, body)
        near = self._near(situation, body.pose) if walk.ledger.claims or walk.ledger.beside else NOBODY
        claimed = self._advance(Claimed(walk, waits, took=False), plan, situation, body.pose, near)
        if self.settings.in_sight:
            return claimed
        walk = self._make_room(claimed.walk, situation, body.pose, room, near)
        return claimed if walk is claimed.walk else claimed._replace(walk=walk)

    def _advance(
        self, claimed: Claimed, plan: Following | None, situation: Situation, pose: Pose, near: frozenset[str]
    ) -> Claimed:
        """Take the cells claimed, in the order of the plan, that all ``near`` have acknowledged."""
        walk, waits, took = claimed
        while walk.route:
            cell = walk.route[0]
            step_free = plan is None or plan.waits_for(walk.next_step, situation) is None
            mine = cell in walk.ledger.held and not any(cell in record.held for record in situation.fresh.values())
            if mine and not walk.ledger.claims and step_free:
                walk = walk.grown(walk.ledger.keep((*walk.ledger.held, cell)))
                continue
            if not walk.ledger.claims or walk.ledger.claims[0].cell != cell:
                break
            claim = walk.ledger.claims[0]
            case = self._case(claim, walk, situation, near)
            heard = not self.settings.in_sight or self._would_be_heard(walk.head, cell, pose)
            against = obstacle(TAKE, case) if step_free and heard else "not its turn"
            if against is not None:
                waits = waits if waits and against == "it is too young" else self._hinderers(case)
                break
            walk = walk.grown(walk.ledger.take(claim))
            took, waits = True, ()
        return Claimed(walk, waits, took)

    def _make_room(
        self, walk: Walk, situation: Situation, pose: Pose, room: Collection[int], near: frozenset[str]
    ) -> Walk:
        """Claim cells beside the way in which the robot would drive, and take those that all have granted."""
        if walk.ledger.beside:
            given_up = [claim for claim in walk.ledger.beside if claim.cell not in room]
            walk = walk._replace(ledger=walk.ledger.withdraw(given_up))
            for claim in walk.ledger.beside:
                if obstacle(TAKE, self._case(claim, walk, situation, near)) is None:
                    walk = walk.with_room(claim)
        if not room:
            return walk
        ahead = walk.route[: self.settings.horizon]
        taken = {*walk.ledger.held, *[claim.cell for claim in walk.ledger.all_claims], *ahead, *situation.blocked}
        for cell in room:
            if cell in taken or len(walk.ledger.beside) >= BESIDE:
                continue
            if distance(self.cells.centre(cell), pose) > self.settings.claim_radius:
                continue
            case = self._case(Claim(cell, walk.ledger.number, situation.tick), walk, situation, NOBODY)
            if obstacle(ASK, case) is None:
                walk = walk._replace(ledger=walk.ledger.claim_beside(cell, situation.tick))
        return walk

    def _ask(
        self, walk: Walk, plan: Following | None, situation: Situation, body: Body
    ) -> tuple[Walk, tuple[str, ...]]:
        """Claim what may be claimed, in order; name who keeps it from the first cell of the route."""
        pose, place = body.pose, walk.place(body.cell)
        room = self.settings.horizon - (len(walk.ledger.held) - 1 - place)
        for ahead, cell in enumerate(walk.route[: max(0, room)]):
            step = walk.next_step + ahead
            first = plan.waits_for(step, situation) if plan is not None else None
            if plan is not None and first is not None and not (ahead == 0 and plan.next_after(step, situation)):
                return walk, (first,) if ahead == 0 else ()
            if ahead < len(walk.ledger.claims):
                continue
            if cell in walk.ledger.held or cell in situation.blocked:
                return walk, ()
            if distance(self.cells.centre(cell), pose) > self.settings.claim_radius:
                return walk, ()
            if self.settings.in_sight and not self._would_be_heard(walk.head, cell, pose):
                return walk, ()
            case = self._case(Claim(cell, walk.ledger.number, situation.tick), walk, situation, NOBODY)
            against = obstacle(ASK, case)
            if against is not None and not (ahead == 0 and self._queues(against, case, situation)):
                return walk, self._hinderers(case) if ahead == 0 else ()
            walk = walk._replace(ledger=walk.ledger.claim(cell, situation.tick))
        return walk, ()

    def _would_be_heard(self, head: int, cell: int, pose: Pose) -> bool:
        """Return True if all who may claim or hold that cell hear me: round a corner they lean towards it, as I do."""
        if not self.cells.is_blind(head, cell):
            return distance(self.cells.centre(head), pose) <= LEANS
        return distance(self.cells.leaning(head, cell, self.settings.leaning_room), pose) <= LEANS

    def _queues(self, against: str, case: Case, situation: Situation) -> bool:
        """Return True if to claim the very next cell although it is held: once it is let go of, it is mine at once."""
        held_by_others = [robot for robot, notice in case.others.items() if case.claim.cell in notice.held]
        return against == "somebody holds it" and all(robot in situation.fresh for robot in held_by_others)

    def _case(self, claim: Claim, walk: Walk, situation: Situation, near: frozenset[str]) -> Case:
        age = situation.tick - claim.stamp
        others = situation.others
        return Case(claim, self.me, self.me, walk.ledger, others, near, situation.cleared, age, self.settings.ripe)

    def _near(self, situation: Situation, pose: Pose) -> frozenset[str]:
        """Name those heard of late who could claim a cell that I can claim."""
        settings = self.settings
        farthest = min(settings.claim_radius, (settings.horizon + 1) * self.cells.side)
        reach = 2 * farthest + 1.5
        x, y, _ = pose
        return frozenset(
            [robot for robot, record in situation.fresh.items() if hypot(record.x - x, record.y - y) <= reach]
        )

    def _hinderers(self, case: Case) -> tuple[str, ...]:
        """Name who holds or claims a cell, or else who has not acknowledged the claim yet."""
        cell = case.claim.cell
        owners = tuple(
            [
                robot
                for robot, notice in case.others.items()
                if keeps(notice, cell) and (robot, cell) not in case.cleared
            ]
        )
        if owners or case.age < UNANSWERED:
            return owners
        ack = (self.me, case.claim.number)
        return tuple([robot for robot in sorted(case.near) if ack not in case.others[robot].acks])
