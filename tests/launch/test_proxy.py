"""The slow network: the proxy hands on every byte in order, no earlier than its delay; its option is checked."""

import asyncio
from collections.abc import Awaitable, Callable
from random import Random

import pytest

from swarm.bus import Endpoint
from swarm.cli import main
from swarm.errors import ConfigError
from swarm.launch import proxy
from swarm.launch.proxy import LONGEST, UNDER_WAY, Delay, hand_on

HOST = "127.0.0.1"
PATIENCE = 30.0  # s; more means that it hangs
Streams = tuple[asyncio.StreamReader, asyncio.StreamWriter]


def through(delay: Delay, work: Callable[[Streams], Awaitable[None]], answers: bool = True) -> None:
    """Let ``work`` speak through a proxy to a server that sends everything back; or to none."""

    async def echo(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while piece := await reader.read(4096):
                writer.write(piece)
                await writer.drain()
        finally:
            writer.close()
            await writer.wait_closed()

    async def all_of_it() -> None:
        server, over = await asyncio.start_server(echo, HOST, 0), asyncio.Event()
        port = server.sockets[0].getsockname()[1]
        if not answers:
            server.close()
            await server.wait_closed()
        place = Endpoint(HOST, 0).claim()
        handing = asyncio.create_task(hand_on(over.is_set, place, Endpoint(HOST, port), delay, Random(1)))
        while True:
            try:
                streams = await asyncio.open_connection(HOST, place.port)
                break
            except ConnectionRefusedError:  # it does not listen yet
                await asyncio.sleep(0)
        await work(streams)
        streams[1].close()
        await streams[1].wait_closed()
        over.set()
        await handing
        server.close()

    asyncio.run(asyncio.wait_for(all_of_it(), PATIENCE))


@pytest.mark.parametrize("delay", [Delay(0.0), Delay(0.005), Delay(0.005, 0.005)])
def test_every_byte_is_handed_on_in_order_and_so_is_the_end(delay: Delay) -> None:
    sent = Random(2).randbytes(1_000_000)

    async def work(streams: Streams) -> None:
        reader, writer = streams

        async def speak() -> None:
            for first in range(0, len(sent), 7000):
                writer.write(sent[first : first + 7000])
                await writer.drain()
            writer.write_eof()

        got, _ = await asyncio.gather(reader.read(-1), speak())
        assert got == sent

    through(delay, work)


def test_nothing_comes_back_before_two_delays() -> None:
    delay = Delay(0.05)

    async def work(streams: Streams) -> None:
        reader, writer = streams
        loop = asyncio.get_running_loop()
        began = loop.time()
        writer.write(b"sense")
        assert await reader.readexactly(5) == b"sense"
        assert loop.time() - began >= 2 * delay.delay

    through(delay, work)


def test_while_the_router_is_away_a_connection_ends() -> None:
    async def work(streams: Streams) -> None:
        assert await streams[0].read(-1) == b""

    through(Delay(0.0), work, answers=False)


def test_both_sides_are_closed_although_the_wait_for_one_is_cut_short() -> None:
    class Side:
        closed = False

        def close(self) -> None:
            self.closed = True

        async def wait_closed(self) -> None:
            await asyncio.Event().wait()

    sides = Side(), Side()

    async def work() -> None:
        closing = asyncio.create_task(proxy.close(*sides))  # type: ignore[arg-type]  # no streams
        await asyncio.sleep(0)
        closing.cancel()
        await asyncio.wait([closing])

    asyncio.run(work())
    assert [side.closed for side in sides] == [True, True]


def test_what_is_under_way_is_bounded() -> None:
    assert UNDER_WAY * 65_536 <= 64 * 2**20, "64 MiB in one direction"


# fmt: off
READ = {
    "0":             Delay(0.0),
    "30":            Delay(0.03),
    "28.5":          Delay(0.0285),
    "30,20":         Delay(0.03, 0.02),
    "30,30":         Delay(0.03, 0.03),
    f"{LONGEST:g}":  Delay(LONGEST / 1000.0),
}
# fmt: on


@pytest.mark.parametrize("text", READ)
def test_a_delay_is_read_in_milliseconds(text: str) -> None:
    assert Delay.parse(text) == READ[text]


@pytest.mark.parametrize("text", ["", "x", "-1", "30,40", "30,x", "1,2,3", "nan", "inf", "10001", "30,-1"])
def test_another_delay_is_a_sentence(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ConfigError, match="--delay: expected MS or MS,JITTER"):
        Delay.parse(text)
    assert main(["run", "paper", f"--delay={text}", "--dashboard", "off"]) == 2
    assert f"got {text!r}" in capsys.readouterr().err
