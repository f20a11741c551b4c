"""The past of the run: the process that answers questions about its tape. The first question starts it."""

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from queue import Empty, Queue
from threading import BoundedSemaphore, Lock, Thread
from typing import Final, NamedTuple

import msgspec

from dashboard.box.questions import Question, QuestionRefusal, What
from swarm.errors import PeerError

ANSWER: Final = 60.0  # s for an answer: a long run has to be run again, perhaps on a busy machine
MOST_ASKED: Final = 3  # questions at once: the others wait for the first


class _Child(NamedTuple):
    process: subprocess.Popen[bytes]
    answers: Queue[bytes]  # lines; an empty one: it has ended


class TapeProcess:
    """The process that runs a tape again, and questions to it. It ends with ``close``."""

    def __init__(self, file: Path | None) -> None:
        self._file = file
        self._turn = Lock()  # held while a question is under way
        self._room = BoundedSemaphore(MOST_ASKED)
        self._child: _Child | None = None
        self._over = False

    def close(self) -> None:
        """End the process; a question that is under way is refused."""
        self._over = True
        self._end()

    def ask(self, what: What, robot: str | None, question: Question) -> bytes:
        """Return the answer to a question, as JSON.

        Raises:
            PeerError: the tape does not say, there is none, or no answer comes in time.
        """
        if self._file is None:
            raise PeerError("tape: expected the tape of this run on this machine, found none; start the run here")
        if not self._room.acquire(blocking=False):
            raise PeerError(f"tape: expected at most {MOST_ASKED} questions at once, got one more; ask again later")
        try:
            with self._turn:
                answer = self._answer(msgspec.json.encode((what, robot, question)) + b"\n")
        finally:
            self._room.release()
        with suppress(msgspec.ValidationError):
            raise PeerError(msgspec.json.decode(answer, type=QuestionRefusal).refused)
        return answer

    def _answer(self, line: bytes) -> bytes:
        process, answers = self._child = self._living()
        assert process.stdin is not None
        try:
            process.stdin.write(line)
            process.stdin.flush()
            answer = answers.get(timeout=ANSWER)
        except BrokenPipeError:
            answer = b""
        except Empty:
            self._end()
            hint = f"the run is long; ask in a terminal: swarm why ROBOT {self._file} --at SECONDS"
            raise PeerError(f"tape: expected an answer within {ANSWER:g} s, got none; {hint}") from None
        if not answer:
            self._end()
            raise PeerError("tape: expected an answer, but the process that reads it has ended; ask again")
        return answer

    def _living(self) -> _Child:
        """Return the process that answers; start one if there is none."""
        if self._over:
            raise PeerError("tape: the box has ended")
        if self._child is not None and self._child.process.poll() is None:
            return self._child
        self._end()
        command = [sys.executable, "-P", "-m", "dashboard.box.answer_process", str(self._file)]
        process = subprocess.Popen(
            [*command, "--ends-with", str(os.getpid())], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        child = _Child(process, Queue())
        Thread(target=_read, args=(child,), daemon=True).start()
        return child

    def _end(self) -> None:
        child, self._child = self._child, None
        if child is not None:
            child.process.kill()
            child.process.wait()
            assert child.process.stdin is not None
            with suppress(BrokenPipeError):
                child.process.stdin.close()


def _read(child: _Child) -> None:
    """Hand on what a process writes, until it ends."""
    process, answers = child
    assert process.stdout is not None
    with process.stdout as lines:
        for line in lines:
            answers.put(line)
    answers.put(b"")
