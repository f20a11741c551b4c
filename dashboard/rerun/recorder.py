"""The destinations of recordings: a server that viewers connect to, and files."""

from collections.abc import Collection
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import Final

import rerun as rr

from dashboard.fold.scene import Scene
from dashboard.frames import finish
from dashboard.mode import ANY, LOOPBACK
from dashboard.rerun.compaction import compact
from dashboard.rerun.drawing import Picture
from dashboard.rerun.layout import APPLICATION, blueprint
from swarm.errors import ConfigError

FLUSH: Final = 0.3  # s between two flushes
SMALLER: Final = 10.0  # s to make files smaller; the launcher waits 15 s for the dashboard
MEMORY: Final = "256MiB"  # of recordings that the server keeps for viewers that come late


class Recordings:
    """The destinations of recordings: a server that viewers connect to, files, or both. Each run has one recording.

    The first run's stream is the server. Later runs are sent to it, so that an open viewer shows them too.
    """

    def __init__(self, *, serve: tuple[str, int] | None, record: Path | None) -> None:
        self._serve = serve
        self._record = record
        self._streams: list[rr.RecordingStream] = []
        self._files: list[Path] = []
        self.url: str | None = None  # for viewers

    def begin(
        self, name: str, scene: Scene, robots: tuple[str, ...], detailed: Collection[str] | None = None
    ) -> Picture:
        """Begin a run's recording; sensors and held cells are drawn of the robots ``detailed``, None for all.

        Raises:
            ConfigError: the file cannot be written.
        """
        stream = rr.RecordingStream(APPLICATION, batcher_config=rr.ChunkBatcherConfig(flush_tick=FLUSH))
        stream.set_log_time_enabled(False)
        sinks: list[rr.GrpcServerSink | rr.GrpcSink | rr.FileSink] = []
        if self._serve is not None and self.url is None:
            host, port = self._serve
            anywhere = None if host == LOOPBACK else ["http://*:*"]
            server = rr.GrpcServerSink(host, port, server_memory_limit=MEMORY, cors_allow_origin=anywhere)
            self.url = f"rerun+http://{LOOPBACK if host == ANY else host}:{port}/proxy"
            sinks.append(server)
        elif self.url is not None:
            sinks.append(rr.GrpcSink(self.url))
        if self._record is not None:
            sinks.append(rr.FileSink(str(self._file()), write_footer=False))
        plan = blueprint(scene)
        try:
            stream.set_sinks(*sinks, default_blueprint=plan)
        except RuntimeError as fault:
            raise ConfigError(f"record: expected to write {self._record}, got {fault}; choose another file") from None
        if self._record is not None:
            self._files.append(self._file())
        stream.send_recording_name(name)
        self._streams.append(stream)
        view = Picture(stream, scene, robots, detailed)
        view.set_stage()
        return view

    def _file(self) -> Path:
        assert self._record is not None
        number = len(self._streams) + 1
        return self._record if number == 1 else self._record.with_stem(f"{self._record.stem}-run{number}")

    @property
    def records(self) -> bool:
        """True if files are written."""
        return self._record is not None

    def close(self, within: float = SMALLER) -> None:
        """Finish all recordings: what is under way is sent, the files get their ends.

        Rerun would keep an index of all chunks, gigabytes in a day, to write it at the end. Its program writes one when
        it makes the files smaller: the newest first, as far as ``within`` [s] suffices.
        """
        for stream in reversed(self._streams):
            stream.disconnect()
        self._streams.clear()
        for file in self._files:
            with suppress(OSError):  # the disk is full: then the file is cut
                finish(file)
        until = monotonic() + within
        for file in reversed(self._files):
            if (left := until - monotonic()) > 0.0:
                compact(file, left)
        self._files.clear()
