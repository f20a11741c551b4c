"""A robot steps once a tick: a sense that comes again gets the same answer."""

import msgspec

from swarm.robot.brain import Inputs
from swarm.robot.process import Given, Repeats
from tests.robot.shared import robot
from tests.robot.test_inbox import FITS


def test_a_sense_that_comes_again_gets_the_same_answer() -> None:
    repeats = Repeats(most=3)
    one = robot()
    answer = Given(one.step(Inputs(FITS, [])), (0, 0))
    repeats.keep(FITS, answer)
    assert repeats.to(FITS) is answer
    assert repeats.to(msgspec.structs.replace(FITS, tick=8)) is None
    assert repeats.to(msgspec.structs.replace(FITS, run=1)) is None


def test_only_the_last_answers_are_kept() -> None:
    repeats = Repeats(most=3)
    answer = Given(robot().step(Inputs(FITS, [])), (0, 0))
    for tick in range(5):
        repeats.keep(msgspec.structs.replace(FITS, tick=tick), answer)
    kept = [tick for tick in range(5) if repeats.to(msgspec.structs.replace(FITS, tick=tick)) is not None]
    assert kept == [2, 3, 4]
