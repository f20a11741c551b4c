"""Recordings of messages, drawn as a dashboard does and read back."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from dashboard.rerun import Recordings
from dashboard.show import Show
from swarm.messages import Map, Message
from tests.dashboard.recorded import Recording
from tests.dashboard.rehearsal import Rehearsal


def floor(rehearsal: Rehearsal, *, known: bool = True) -> Map:
    told, packed = rehearsal.scenario.to_wire()
    settings = replace(told.settings, map=replace(told.settings.map, known=known))
    return Map(scenario=replace(told, settings=settings), packed=packed)


def drawn(path: Path, messages: Iterable[Message | None], **options: Any) -> Recording:  # noqa: ANN401
    """Draw messages into a file, and read it back; each None draws those before it. The rest is options of ``Show``."""
    recorder = Recordings(serve=None, record=path)
    show = Show(recorder, "test", **options)
    for message in messages:
        if message is not None:
            show.take(message)
            continue
        show.draw()
        for stream in recorder._streams:
            stream.flush()  # as time does
    show.draw()
    recorder.close(within=0.0)
    return Recording(path)


def sent(rehearsal: Rehearsal, ticks: Iterable[int], every: int = 10) -> Iterator[Message | None]:
    """Yield the messages of some ticks, and a None after every so many."""
    for tick in ticks:
        yield from (message for _, message, _ in rehearsal.messages(tick))
        if tick % every == 0:
            yield None


def played(path: Path, rehearsal: Rehearsal, ticks: int | None = None, every: int = 10) -> Recording:
    """Draw a rehearsal, or its first ticks, into a file, and read it back."""
    until = rehearsal.ticks if ticks is None else ticks
    return drawn(path, [floor(rehearsal), *sent(rehearsal, range(until + 1), every)])
