"""The box's child that answers for the tape: ``python -m dashboard.box.answer_process FILE``.

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
from dashboard.box.questions import TRAILS, Line, MomentAnswer, QuestionRefusal
from dashboard.box.tape_moments import Moments, PastMoment
from dashboard.fold.state import RunState
from dashboard.viewers import end_with_process
from swarm.blackbox.explain.clauses import as_text
from swarm.errors import SwarmError

POLITE: Final = 5  # by which others go before it on this machine's processors


def answer_line(moments: Moments, line: bytes) -> MomentAnswer | QuestionRefusal:
    """Return the answer to a line, or a refusal of it."""
    try:
        what, robot, asked = msgspec.json.decode(line, type=Line)
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as fault:
        return QuestionRefusal(f"expected a question about the tape as JSON, {fault}")
    try:
        moment = moments.moment_at(asked.at, asked.run)
        if robot is not None:
            moment.taped.check(robot)
        return _why(moment, robot) if what == "why" else _answer_past(moment, robot)
    except SwarmError as fault:
        return QuestionRefusal(str(fault))


def _why(moment: PastMoment, robot: str | None) -> MomentAnswer | QuestionRefusal:
    taped, seen = moment
    if robot is None:
        return QuestionRefusal("/why: expected ?robot=NAME, such as ?robot=r1, got none")
    return MomentAnswer(run=seen.run, at=seen.time, doubt=taped.doubt, text=as_text(taped.why(robot)))


def _answer_past(moment: PastMoment, robot: str | None) -> MomentAnswer:
    state, selected = RunState(), frozenset({robot}) if robot is not None else frozenset()
    for message in moment.messages():
        state.take(message)
    frames = {
        **telling.encode_wire_frames(state),
        **telling.encode_run_frames(state, selected, link=True),
        **telling.encode_robot_frame(state, selected),
        TRAILS: moment.trails(),
    }
    texts = [msgspec.Raw(telling.make_frame(key, content).encode()) for key, content in frames.items()]
    return MomentAnswer(run=moment.truth.run, at=moment.truth.time, doubt=moment.taped.doubt, frames=texts)


def main(arguments: list[str] | None = None) -> int:
    """Answer the lines of standard input until it ends."""
    parser = argparse.ArgumentParser(prog="python -m dashboard.box.answer_process")
    parser.add_argument("file", type=Path, help="the tape of a run")
    parser.add_argument("--ends-with", type=int, metavar="PID", help="the process that started this one: end with it")
    given = parser.parse_args(arguments)
    if given.ends_with is not None:
        if not end_with_process(given.ends_with):
            return 0
        os.nice(POLITE)
    moments, answers = Moments(given.file), sys.stdout.buffer
    with redirect_stdout(sys.stderr):  # nothing else comes between the answers
        for line in sys.stdin.buffer:
            answers.write(msgspec.json.encode(answer_line(moments, line)) + b"\n")
            answers.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
