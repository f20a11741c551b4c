"""A pool of worker processes on several cores. If a worker dies, only its own job is lost."""

import gc
import multiprocessing
import signal
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from multiprocessing import connection
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerContext
from multiprocessing.process import BaseProcess
from time import monotonic
from typing import Any, Final, Generic, NamedTuple, TypeVar

J = TypeVar("J")
A = TypeVar("A")

LOOK: Final = 0.2  # s between two checks whether to stop
PATIENCE: Final = 900.0  # s of wall time for one job; the slowest seed of 2,000 took 150 s on a busy core
PRELOAD: Final = ("swarm.storm.results",)


class Lost(NamedTuple):
    """A job without an answer, and why."""

    why: str


class _Worker(NamedTuple, Generic[J]):
    process: BaseProcess
    pipe: Connection
    job: J
    since: float  # s, monotonic


def answers(
    work: Callable[[J], A],
    jobs: Iterable[J],
    *,
    workers: int,
    stop: Callable[[], bool] = lambda: False,
    patience: float = PATIENCE,
) -> Iterator[tuple[J, A | Lost]]:
    """Run jobs in parallel and yield each answer as it comes, in any order, until ``stop`` returns True.

    ``work`` is a function of a module, because the workers import it. Leaving the iteration ends the workers.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(PRELOAD))
    waiting = iter(jobs)
    crew: list[_Worker[J]] = []
    try:
        while not stop():
            crew.extend(_start_worker(context, work, job) for job in islice(waiting, workers - len(crew)))
            if not crew:
                return
            ready = connection.wait([worker.pipe for worker in crew], LOOK)
            for worker in list(crew):
                if worker.pipe in ready:
                    crew.remove(worker)
                    answer: A | Lost = _answer(worker)
                    following: list[J] = [] if isinstance(answer, Lost) else list(islice(waiting, 1))
                    for job in following:
                        worker.pipe.send(job)
                        crew.append(worker._replace(job=job, since=monotonic()))
                    if not following:
                        _end(worker)
                    if isinstance(answer, Lost) and stop():
                        return  # what told us to stop has ended the worker: its job is not at fault
                    yield worker.job, answer
                elif monotonic() - worker.since > patience:
                    crew.remove(worker)
                    _end(worker)
                    yield worker.job, Lost(f"its run took more than {patience:g} s and was ended")
    finally:
        for worker in crew:
            _end(worker)


def _start_worker(context: ForkServerContext, work: Callable[[J], A], job: J) -> _Worker[J]:
    pipe, theirs = context.Pipe()
    process = context.Process(target=_serve, args=(theirs, work), daemon=True)
    process.start()
    theirs.close()  # closed here, so that ``recv`` raises EOFError when the worker dies
    pipe.send(job)
    return _Worker(process, pipe, job, monotonic())


def _answer(worker: _Worker[J]) -> Any:  # noqa: ANN401, what the work gives, or Lost
    try:
        return worker.pipe.recv()
    except (EOFError, OSError):
        worker.process.join()
        status = worker.process.exitcode or 0
        how = f"was ended by signal {-status}" if status < 0 else f"ended with status {status}"
        return Lost(f"its process {how}")


def _end(worker: _Worker[J]) -> None:
    worker.process.kill()
    worker.process.join()
    worker.process.close()
    worker.pipe.close()


def _serve(pipe: Connection, work: Callable[[J], A]) -> None:
    """Answer jobs until the pipe is closed. The parent handles Ctrl-C; the worker ignores it.

    Garbage is collected only between jobs: a run leaves only about 200 objects in reference cycles, and looking for
    them during the run takes an eighth of its time.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    gc.freeze()  # what was imported stays
    gc.disable()
    try:
        while True:
            pipe.send(work(pipe.recv()))
            gc.collect()
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return
