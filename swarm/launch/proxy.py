"""A slow network on one machine: a proxy that hands on every byte, in order and late.

It stands between robots and their router. What enters it leaves ``delay`` later, in both directions; ``jitter`` is
drawn anew for each piece, and nothing overtakes. It reads no more while much is under way, as a real line does.
"""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from random import Random
from typing import Final, NamedTuple

from swarm.bus import Endpoint
from swarm.errors import ConfigError
from swarm.stop_signal import stop_flag

PIECE: Final = 65_536  # bytes read at once
UNDER_WAY: Final = 1024  # pieces in one direction of one connection; then the proxy stops reading
LONGEST: Final = 10_000.0  # ms; a session without news for its lease has long ended by then
LOOK: Final = 0.1  # s between two checks whether the process must stop


class Delay(NamedTuple):
    """How long a piece is under way, each way."""

    delay: float  # s
    jitter: float = 0.0  # s; up to so much more or less, evenly drawn

    @classmethod
    def parse(cls, text: str) -> "Delay":
        """Read ``MS`` or ``MS,JITTER_MS``.

        >>> Delay.parse("30,20")
        Delay(delay=0.03, jitter=0.02)

        Raises:
            ConfigError: the text does not have that form, or the jitter is longer than the delay.
        """
        delay, _, jitter = text.partition(",")
        try:
            read = cls(float(delay), float(jitter or 0.0))
        except ValueError:
            read = cls(-1.0)
        if not 0.0 <= read.jitter <= read.delay <= LONGEST:
            raise ConfigError(
                f"--delay: expected MS or MS,JITTER, with 0 <= JITTER <= MS <= {LONGEST:g}, got {text!r}; "
                "for example 30 or 30,20"
            )
        return cls(read.delay / 1000.0, read.jitter / 1000.0)


def serve(endpoint: Endpoint, router: Endpoint, delay: Delay) -> int:
    """Hand on between ``endpoint`` and ``router`` until this process is told to stop.

    Raises:
        ConfigError: it cannot listen on the endpoint.
    """
    with stop_flag() as stop:
        asyncio.run(hand_on(stop.is_set, endpoint, router, delay, Random("delay 1")))
    return 0


async def hand_on(
    stopped: Callable[[], bool], endpoint: Endpoint, router: Endpoint, delay: Delay, chance: Random
) -> None:
    """Hand on all connections until ``stopped`` returns True.

    Raises:
        ConfigError: it cannot listen on the endpoint.
    """

    async def open_proxy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            far_reader, far_writer = await asyncio.open_connection(router.host, router.port)
        except OSError:  # the router is away: the robot tries again
            await close(writer)
            return
        ways = (_one_way(reader, far_writer, delay, chance), _one_way(far_reader, writer, delay, chance))
        try:
            await asyncio.gather(*ways, return_exceptions=True)  # a connection that breaks ends both its ways
        finally:
            await close(far_writer, writer)

    try:
        server = await asyncio.start_server(open_proxy, endpoint.host, endpoint.port)
    except OSError as fault:
        raise ConfigError(f"proxy: expected to listen on {endpoint}, got: {fault.strerror or fault}") from None
    while not stopped():
        await asyncio.sleep(LOOK)
    server.close()


async def close(*writers: asyncio.StreamWriter) -> None:
    """Close streams, and wait until they are closed."""
    for writer in writers:  # all of them at once: the wait ends early if this process is told to stop
        writer.close()
    for writer in writers:
        with suppress(OSError):  # it was broken
            await writer.wait_closed()


async def _one_way(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, delay: Delay, chance: Random) -> None:
    """Hand on all that comes, late and in order, and then its end."""
    loop = asyncio.get_running_loop()
    under_way: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue(UNDER_WAY)

    async def leave() -> None:
        while True:
            due, piece = await under_way.get()
            await asyncio.sleep(due - loop.time())
            if not piece:
                return
            writer.write(piece)
            await writer.drain()

    async def enter() -> None:
        due = 0.0
        while True:
            try:
                piece = await reader.read(PIECE)
            except OSError:
                piece = b""
            due = max(due, loop.time() + delay.delay + chance.uniform(-delay.jitter, delay.jitter))
            await under_way.put((due, piece))
            if not piece:
                return

    entering = asyncio.create_task(enter())
    try:
        await leave()
    finally:
        entering.cancel()
        with suppress(OSError):  # the other side has gone already
            writer.write_eof()
