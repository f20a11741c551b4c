"""The box's child that answers for the tape: ``python -m dashboard.box.answering FILE``.

Each line that it reads is a question as JSON, each line that it writes the answer to one. It is a process of its own,
and a polite one: a tape that is run again keeps a processor busy for seconds.
"""

import argparse
import os
import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import Final

import msgspec

from dashboard.box import frames as telling
from dashboard.box.moments import Moments, PastMoment
from dashboard.box.questions import TRAILS, Answer, Line, Refusal
from dashboard.fold.state import RunState
from dashboard.viewers import end_with
from swarm.errors import SwarmError
from world.explain.clauses import as_text

POLITE: Final = 5  # by which others go before it on this machine's processors


def answered(moments: Moments, line: bytes) -> Answer | Refusal:
    """Return the answer to a line, or a refusal of it."""
    try:
        what, robot, asked = msgspec.json.decode(line, type=Line)
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as fault:
        return Refusal(f"expected a question about the tape as JSON, {fault}")
    try:
        moment = moments.at(asked.at, asked.run)
        if robot is not None:
            moment.taped.check(robot)
        return _why(moment, robot) if what == "why" else _past(moment, robot)
    except SwarmError as fault:
        return Refusal(str(fault))


def _why(moment: PastMoment, robot: str | None) -> Answer | Refusal:
    taped, seen = moment
    if robot is None:
        return Refusal("/why: expected ?robot=NAME, such as ?robot=r1, got none")
    return Answer(run=seen.run, at=seen.time, doubt=taped.doubt, text=as_text(taped.why(robot)))


def _past(moment: PastMoment, robot: str | None) -> Answer:
    state, selected = RunState(), frozenset({robot}) if robot is not None else frozenset()
    for message in moment.messages():
        state.take(message)
    frames = {
        **telling.of_the_wire(state),
        **telling.of_the_run(state, selected, link=True),
        **telling.of_robots(state, selected),
        TRAILS: moment.trails(),
    }
    texts = [msgspec.Raw(telling.framed(key, content).encode()) for key, content in frames.items()]
    return Answer(run=moment.truth.run, at=moment.truth.time, doubt=moment.taped.doubt, frames=texts)


def main(arguments: list[str] | None = None) -> int:
    """Answer the lines of standard input until it ends."""
    parser = argparse.ArgumentParser(prog="python -m dashboard.box.answering")
    parser.add_argument("file", type=Path, help="the tape of a run")
    parser.add_argument("--ends-with", type=int, metavar="PID", help="the process that started this one: end with it")
    given = parser.parse_args(arguments)
    if given.ends_with is not None:
        if not end_with(given.ends_with):
            return 0
        os.nice(POLITE)
    moments, answers = Moments(given.file), sys.stdout.buffer
    with redirect_stdout(sys.stderr):  # nothing else comes between the answers
        for line in sys.stdin.buffer:
            answers.write(msgspec.json.encode(answered(moments, line)) + b"\n")
            answers.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
