"""The messages of a run as an MCAP file, as JSON with their schemas: Foxglove and other tools of robotics read it.

No other file imports mcap.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import IO, Final

from mcap.writer import Writer

from swarm.bus.codec import encode
from swarm.errors import ConfigError
from swarm.messages import CLOCK, EVENT, MAP, PLAN, STATE, STATUS, TRUTH, Broadcast, Message
from swarm.messages.schema import schema_of

CHANNELS: Final[dict[type[Message], str]] = {
    Broadcast: "radio/{robot}",  # on the wire there is the zone that it is sent from between
    **{topic.message: topic.key for topic in (CLOCK, EVENT, MAP, PLAN, STATE, STATUS, TRUTH)},
}
LIBRARY: Final = "zenoh-swarm"


class McapFile:
    """The messages of a run that is replayed, one file for each run: the second is in ``FILE-run2.mcap``.

    A channel is named by the key of its messages below the fleet's; times are those of the run, from 0 on.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._run = -1
        self._file: IO[bytes] | None = None
        self._writer: Writer | None = None
        self._schemas: dict[type[Message], int] = {}
        self._channels: dict[str, int] = {}
        self._files: list[Path] = []

    def take(self, run: int, time: float, messages: Iterable[Message]) -> None:
        """Write the messages that were sent at a time of a run [s].

        Raises:
            ConfigError: the file cannot be written.
        """
        try:
            writer = self._writer if run == self._run and self._writer is not None else self._begin(run)
            now = round(time * 1e9)
            for message in messages:
                writer.add_message(self._channel(writer, message), now, encode(message, as_json=True), now)
        except OSError as fault:
            raise self._fault(fault) from None

    def close(self) -> list[Path]:
        """Finish the files and return them.

        Raises:
            ConfigError: they cannot be written.
        """
        try:
            self._end()
        except OSError as fault:
            raise self._fault(fault) from None
        return self._files

    def _begin(self, run: int) -> Writer:
        self._end()
        number = len(self._files) + 1
        path = self._path if number == 1 else self._path.with_stem(f"{self._path.stem}-run{number}")
        self._run, self._schemas, self._channels = run, {}, {}
        self._file = path.open("wb")
        self._files.append(path)
        self._writer = Writer(self._file)
        self._writer.start(library=LIBRARY)
        return self._writer

    def _end(self) -> None:
        writer, file, self._writer, self._file = self._writer, self._file, None, None
        if file is not None and writer is not None:
            with file:
                writer.finish()  # type: ignore[no-untyped-call]

    def _channel(self, writer: Writer, message: Message) -> int:
        kind = type(message)
        key = CHANNELS[kind].format(robot=getattr(message, "robot", ""))
        if key not in self._channels:
            if kind not in self._schemas:
                schema = schema_of(kind).encode()
                self._schemas[kind] = writer.register_schema(f"swarm.{kind.__name__}", "jsonschema", schema)
            self._channels[key] = writer.register_channel(key, "json", self._schemas[kind])
        return self._channels[key]

    def _fault(self, fault: OSError) -> ConfigError:
        return ConfigError(f"--mcap {self._path}: expected to write it, got {fault.strerror}; name another file")
