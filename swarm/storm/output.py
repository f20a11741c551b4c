"""The output of a storm: at once a JSON line for each seed, a plan for each failure, and progress on the terminal."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from json import dumps
from pathlib import Path
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from swarm.errors import ConfigError
from swarm.storm.plans.plan import StormPlan
from swarm.storm.results import RunResult

Say = Callable[[str], None]


class Lines:
    """A file that gets one JSON line per seed at once. If it cannot be written, the lines are printed instead."""

    def __init__(self, path: Path | None, say: Say) -> None:
        self.failed = False  # whether a line could not be written
        self._path, self._say = path, say
        self._file: int | None = None

    def __enter__(self) -> Self:
        """Open the file to append to it.

        Raises:
            ConfigError: the file cannot be opened.
        """
        if self._path is not None:
            try:
                self._file = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
            except OSError as fault:
                raise ConfigError(
                    f"--results {self._path}: expected a file that can be written, got {fault.strerror}; name another"
                ) from None
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            os.close(self._file)

    def add(self, result: RunResult) -> None:
        """Write one result."""
        if self._file is None:
            return
        line = dumps(result.to_builtins(), separators=(",", ":"))
        if not self.failed:
            try:
                self._write(self._file, line.encode() + b"\n")
                return
            except OSError as fault:
                self.failed = True
                self._say(f"--results {self._path}: {fault.strerror}; the missing lines follow here")
        self._say(line)

    def _write(self, file: int, left: bytes) -> None:
        while left:
            left = left[os.write(file, left) :]


def write_plan(plan: StormPlan, path: Path) -> None:
    """Write a plan as a file.

    Raises:
        ConfigError: the file cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(plan.to_yaml(), encoding="utf-8")
    except OSError as fault:
        raise ConfigError(
            f"{path}: expected a file that can be written, got {fault.strerror}; name another folder"
        ) from None


@contextmanager
def show_progress(total: int) -> Iterator[tuple[Say, Say]]:
    """Show progress on stderr if it is a terminal; yield a function that prints a line and one that counts a seed."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield (lambda text: print(text, file=sys.stderr, flush=True)), (lambda text: None)
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, TimeRemainingColumn(), console=console, transient=True) as bar:
        task = bar.add_task("storm", total=total)
        yield (
            lambda text: bar.console.print(text, markup=False, highlight=False, soft_wrap=True),
            lambda text: bar.update(task, advance=1, description=text),
        )
