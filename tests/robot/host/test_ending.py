"""What a robot's process makes of the end of its run and of its world, and what it says of both."""

import pytest
from msgspec.structs import replace

from swarm.messages import CLOCK, Activity, Clock, Phase, State
from swarm.robot.host.membership import AWAY, Ending
from tests.robot.host.test_joining import Ship, welcome

CLOCK_ = Clock(run=0, tick=100, time=5.0, phase=Phase.RUNNING, robots=["r1"], present=["r1"])
OVER = replace(CLOCK_, phase=Phase.OVER)

# fmt: off
CASES: dict[str, tuple[list[tuple[float, Clock | bool]], list[str], float | None]] = {  # what happens, at which time [s]: what is said, and when it is done: never, at once, or after a while
    "the run goes on":              ([(0.0, CLOCK_)],                              [],                                    None),
    "the run is over":              ([(9.0, OVER)],                                ["the run is over after 5.0 s; waiting for the next"], 9.0),
    "and is told so again":         ([(9.0, OVER), (10.0, OVER)],                  ["the run is over after 5.0 s; waiting for the next"], 9.0),
    "and its world goes":           ([(9.0, OVER), (10.0, False)],                 ["the run is over after 5.0 s; waiting for the next"], 9.0),
    "a restart begins":             ([(9.0, OVER), (10.0, CLOCK_)],                ["the run is over after 5.0 s; waiting for the next"], None),
    "the world is killed":          ([(9.0, False)],                               ["the world has gone without an end of the run; waiting for it"], 9.0 + AWAY),
    "and comes back":               ([(9.0, False), (12.0, True)],                 ["the world has gone without an end of the run; waiting for it"], None),
}
# fmt: on


@pytest.mark.parametrize("name", CASES)
def test_an_ended_run_is_told_from_a_world_that_was_killed(name: str) -> None:
    happens, says, done = CASES[name]
    ending, said = Ending(), []
    for now, what in happens:
        said.append(ending.hear(what) if isinstance(what, Clock) else ending.look(what, now))
    assert [line for line in said if line] == says
    assert ending.done(1e6) is (done is not None)
    if done is not None:
        assert ending.done(done + 0.1)
        assert ending.done(happens[-1][0]) is (done <= happens[-1][0])


def test_who_joins_says_as_whom_and_hears_only_its_own_worlds_clock() -> None:
    ship = Ship()
    ship.world("s")
    state = State(
        robot="r1",
        run=3,
        tick=1,
        activity=Activity.DRIVE,
        target=0,
        reached=[False],
        unreachable=[],
        distance=1.0,
        replans=0,
    )
    ship.join(replace(welcome(session="s"), sender=7, state=state))
    assert ship.joined == ["joined as r1: small, run 3"]
    for sender, lines in ((8, 0), (7, 1)):
        ship.hear(CLOCK, OVER, sender)
        assert len(ship.said) == lines
    ship.world("s", alive=False)
    assert len(ship.said) == 1
