"""Claim, acknowledge, hold, release: how a robot reserves a cell for itself, over a radio that loses messages.

One-way broadcasts cannot exclude another robot: of two claimants each can miss the other. So a claim becomes a hold
only when every robot in reach has acknowledged that very claim. The rules are tables:
``tests/traffic/reservations/test_claim_model.py`` takes them, tries every order and loss of messages, and shows an
overlap for each rule that is left out.

Claims are ordered by (stamp, robot). Safety needs no common clock: any order works if all robots agree on it.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Final, NamedTuple

from swarm.messages.traffic import Claim, Notice

Acks = tuple[tuple[str, int], ...]  # (robot, number of its claim)


class Reservations(NamedTuple):
    """The cells that one robot holds and claims."""

    held: tuple[int, ...] = ()  # cells in the order of its way; the last is the head
    claims: tuple[Claim, ...] = ()
    number: int = 1  # of the next claim; each number is used once
    beside: tuple[Claim, ...] = ()  # claims for cells beside its way

    @property
    def all_claims(self) -> tuple[Claim, ...]:
        """Every claim, those for the way first."""
        return self.claims + self.beside

    def claim(self, cell: int, tick: int) -> "Reservations":
        """Add a claim for a cell."""
        return self._replace(claims=(*self.claims, Claim(cell, self.number, tick)), number=self.number + 1)

    def claim_beside(self, cell: int, tick: int) -> "Reservations":
        """Add a claim for a cell beside the way."""
        return self._replace(beside=(*self.beside, Claim(cell, self.number, tick)), number=self.number + 1)

    def withdraw(self, claims: Iterable[Claim]) -> "Reservations":
        """Withdraw claims; their numbers are never used again."""
        gone = set(claims)
        if not gone:
            return self
        return self._replace(
            claims=tuple(claim for claim in self.claims if claim not in gone),
            beside=tuple(claim for claim in self.beside if claim not in gone),
        )

    def hold_claimed(self, claim: Claim) -> "Reservations":
        """Turn a claim into a hold; its cell becomes the head."""
        return self.withdraw([claim])._replace(held=(*self.held, claim.cell))

    def keep_only(self, held: tuple[int, ...]) -> "Reservations":
        """Hold the cells ``held``, and release all others."""
        return self._replace(held=held)


class ClaimCase(NamedTuple):
    """What a rule judges: one claim, made by ``who``, as far as ``me`` knows."""

    claim: Claim
    who: str
    me: str
    own: Reservations
    others: Mapping[str, Notice]  # the newest record of every other robot ever heard
    near: frozenset[str] = frozenset()  # robots that could claim the same cell and are not silent
    cleared: frozenset[tuple[str, int]] = frozenset()  # cells of silent robots that a look found empty
    age: int = 1 << 30  # ticks since the claim was made
    ripe: int = 0  # ticks a claim has to be known before it counts


Rule = Callable[[ClaimCase], bool]


def _is_older(one: Claim, who: str, other: Claim, whose: str) -> bool:
    return (one.stamp, who) < (other.stamp, whose)


def _nobody_holds(case: ClaimCase) -> bool:
    cell = case.claim.cell
    return {(robot, cell) for robot, notice in case.others.items() if cell in notice.held} <= case.cleared


def _nobody_claims(case: ClaimCase) -> bool:
    cell = case.claim.cell
    return {
        (robot, cell) for robot, notice in case.others.items() for claim in notice.claims if claim.cell == cell
    } <= case.cleared


def _no_older_claim(case: ClaimCase) -> bool:
    mine, cell = case.claim, case.claim.cell
    return {
        (robot, cell)
        for robot, notice in case.others.items()
        for claim in notice.claims
        if claim.cell == cell and _is_older(claim, robot, mine, case.me)
    } <= case.cleared


def _all_acknowledge(case: ClaimCase) -> bool:
    ack = (case.me, case.claim.number)
    return all(ack in case.others[robot].acks for robot in case.near)


def _i_do_not_hold(case: ClaimCase) -> bool:
    return case.claim.cell not in case.own.held


def _i_have_no_older_claim(case: ClaimCase) -> bool:
    return not any(
        mine.cell == case.claim.cell and _is_older(mine, case.me, case.claim, case.who) for mine in case.own.all_claims
    )


def _is_ripe(case: ClaimCase) -> bool:
    return case.age >= case.ripe


# fmt: off
GRANT: Final[dict[str, Rule]] = {  # I acknowledge another's claim, unless
    "I hold the cell":                      _i_do_not_hold,
    "I have an older claim":                _i_have_no_older_claim,
}
ASK: Final[dict[str, Rule]] = {    # I claim a cell, unless (not needed for safety: it saves claims made in vain)
    "somebody claims it":                   _nobody_claims,
    "somebody holds it":                    _nobody_holds,
}
TAKE: Final[dict[str, Rule]] = {   # my claim becomes a hold, unless
    "it is too young":                      _is_ripe,
    "not all have acknowledged":            _all_acknowledge,
    "somebody holds it":                    _nobody_holds,
    "I have acknowledged an older claim":   _no_older_claim,
}
# fmt: on


def find_violated_rule(rules: Mapping[str, Rule], case: ClaimCase) -> str | None:
    """Return the name of the first rule that is violated, or None if all allow the claim."""
    for name, allows in rules.items():
        if not allows(case):
            return name
    return None


def acknowledgements(
    me: str, own: Reservations, others: Mapping[str, Notice], rules: Mapping[str, Rule] = GRANT
) -> Acks:
    """List the claims of others, (robot, number), to which I do not object."""
    return tuple(
        (robot, claim.number)
        for robot in sorted(others)
        for claim in others[robot].claims
        if find_violated_rule(rules, ClaimCase(claim, robot, me, own, others)) is None
    )
