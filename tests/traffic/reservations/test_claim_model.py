"""The claim protocol, in every order and with every loss of messages."""

from collections.abc import Mapping

import pytest

from swarm.traffic.reservations.rules import ASK, GRANT, TAKE, ClaimCase, Rule
from tests.traffic.reservations.claim_model import Model

HOLDS = ("I hold the cell", "somebody holds it")
OLDER = ("I have an older claim", "I have acknowledged an older claim")


def without(rules: Mapping[str, Rule], *names: str) -> dict[str, Rule]:
    return {name: rule for name, rule in rules.items() if name not in names}


@pytest.mark.parametrize(
    "model",
    [
        Model(robots=2, cells=1, claims=2, in_flight=1, ask={}),
        Model(robots=2, cells=1, claims=3, in_flight=0, ask={}),
        Model(robots=2, cells=2, claims=1, in_flight=0),
    ],
    ids=["late or lost, claims of held cells", "three claims", "two cells"],
)
def test_two_robots_never_hold_one_cell(model: Model) -> None:
    run, states, complete = model.explore()
    assert run is None
    assert complete
    assert states > 500


@pytest.mark.long("every order of 100,000 states; make test explores smaller models")
def test_two_robots_with_two_notices_under_way() -> None:
    run, states, complete = Model(robots=2, cells=1, claims=2, in_flight=2).explore()
    assert run is None
    assert complete
    assert states > 100_000


def test_three_robots_never_hold_one_cell_within_some_steps() -> None:
    run, states, _ = Model(robots=3, cells=1, claims=1, in_flight=0).explore(states=20_000)
    assert run is None
    assert states > 20_000


@pytest.mark.long("every state of three robots; make test explores 20,000")
def test_three_robots_never_hold_one_cell() -> None:
    run, _, complete = Model(robots=3, cells=1, claims=1, in_flight=0).explore()
    assert run is None
    assert complete


def any_acknowledgement(case: ClaimCase) -> bool:
    """The rule as it would be without claim numbers: an old acknowledgement counts for a new claim."""
    return all(case.me in [robot for robot, _ in case.others[robot].acks] for robot in case.near)


@pytest.mark.parametrize(
    ("model", "wrong"),
    [
        (Model(2, 1, 2, take=without(TAKE, "not all have acknowledged")), "nobody is asked"),
        (Model(2, 1, 2, take={**TAKE, "not all have acknowledged": any_acknowledgement}), "any number will do"),
        (Model(2, 1, 2, grant=without(GRANT, *HOLDS), take=without(TAKE, *HOLDS)), "holds do not count"),
        (Model(2, 1, 2, grant=without(GRANT, *OLDER), take=without(TAKE, *OLDER)), "the older has no right"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_each_rule_is_needed(model: Model, wrong: str) -> None:
    """The rules about holds, and about older claims, are there once for each side: one alone would do."""
    run, _, _ = model.explore()
    assert run is not None, f"no overlap was found although {wrong}"


def test_the_rules_for_asking_only_save_vain_claims() -> None:
    assert set(ASK) == {"somebody claims it", "somebody holds it"}
    run, _, complete = Model(2, 1, 2, in_flight=0, ask={}).explore()
    assert run is None
    assert complete
