"""The destinations of recordings: a server that viewers connect to, and files.

A file that is finished is written again: Rerun writes many small chunks, and few large ones take less room.
"""

import os
import subprocess
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import Final

import rerun as rr

from dashboard.fold.scene import Scene
from dashboard.mode import ANY, LOOPBACK, viewer_program
from dashboard.rerun.layout import APPLICATION, blueprint
from dashboard.rerun.run_picture import Picture
from swarm.errors import ConfigError

FLUSH: Final = 0.3  # s between two flushes
SMALLER: Final = 10.0  # s to make files smaller; the launcher waits 15 s for the dashboard
LARGEST: Final = 1_000_000_000  # bytes of a file that is made smaller; Rerun's program holds all of it in memory
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

    def begin(self, name: str, scene: Scene, robots: tuple[str, ...], detailed: tuple[str, ...]) -> Picture:
        """Begin a run's recording; sensors and held cells are drawn of the robots ``detailed``.

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
        files: list[Path] = []
        if self._record is not None:
            number = len(self._streams) + 1
            files = [self._record if number == 1 else self._record.with_stem(f"{self._record.stem}-run{number}")]
        sinks += [rr.FileSink(str(file), write_footer=False) for file in files]
        try:
            stream.set_sinks(*sinks, default_blueprint=blueprint(scene))
        except RuntimeError as fault:
            raise ConfigError(f"record: expected to write {self._record}, got {fault}; choose another file") from None
        self._files += files
        self._streams.append(stream)
        stream.send_recording_name(name)
        picture = Picture(stream, scene, robots, detailed)
        picture.stage.set()
        return picture

    def close(self, within: float = SMALLER) -> list[Path]:
        """Finish all recordings, and return the files: what is under way is sent.

        Rerun would keep an index of all chunks, gigabytes in a day, to write it at the end. Its program writes one when
        it writes the files again: the newest first, as far as ``within`` [s] suffices. Without an index, viewers read a
        file from its beginning.
        """
        for stream in reversed(self._streams):
            stream.disconnect()
        self._streams.clear()
        until = monotonic() + within
        for file in reversed(self._files):
            if (left := until - monotonic()) > 0.0:
                compact(file, left)
        files, self._files = self._files, []
        return files


def compact(recording: Path, within: float) -> None:
    """Write a recording again, in large chunks and with an index, which makes all but short ones smaller.

    It stays as it is if that takes longer than ``within`` [s], or fails in any way.
    """
    program = viewer_program()
    if program is None or not recording.is_file() or recording.stat().st_size > LARGEST:
        return
    part = recording.with_name(f".{recording.name}.part")
    quiet = subprocess.DEVNULL
    # "live": chunks of a size that the viewer shows well; those for servers are hardly smaller
    command = [str(program), "rrd", "optimize", "--profile", "live", str(recording), "-o", str(part)]
    try:
        done = subprocess.run(command, stdin=quiet, stdout=quiet, stderr=quiet, timeout=within, check=False)
        if done.returncode == 0:
            os.replace(part, recording)
    except (OSError, subprocess.TimeoutExpired):
        return
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
