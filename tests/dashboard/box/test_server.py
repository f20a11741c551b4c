"""The box's server without a browser: who is let in, what is refused, and what a crowd of requests does."""

import asyncio
import json
from collections.abc import Iterator
from http.client import HTTPConnection
from socket import create_connection
from threading import Event as Flag
from threading import Thread
from typing import Any, Final

import aiohttp
import pytest

from dashboard.box.browser_request import REQUESTS, Asking
from dashboard.box.server import LONGEST, Server
from dashboard.box.tape_process import TapeProcess
from swarm.bus import Bus, Endpoint, Request
from swarm.errors import ConfigError, PeerError
from swarm.messages import ACTION, ORDER, Accepted, Action, Do, Order
from tests.conftest import MakeBus

TOKEN: Final = "a-token-of-this-test"
BEARER: Final = {"Authorization": f"Bearer {TOKEN}"}
PATIENCE: Final = 20.0  # s


class Fleet:
    """Answers `action` and `order` on a real wire as a world does, and counts what it has carried out."""

    def __init__(self, bus: Bus) -> None:
        self._bus, self._over = bus, Flag()
        self.carried_out: list[Any] = []
        bus.serve(ACTION)
        bus.serve(ORDER)
        self._thread = Thread(target=self._answer)
        self._thread.start()

    def _answer(self) -> None:
        while not self._over.is_set():
            asked = self._bus.receive(timeout=0.05)
            if not isinstance(asked, Request):
                continue
            self.carried_out.append(asked.message)
            if asked.message == Action(do=Do.PAUSE):
                asked.refuse("the run is waiting: expected one of (go), got pause")
            else:
                asked.accept(Accepted(text=f"done for {asked.ids.get('robot', 'all')}"))

    def end(self) -> None:
        self._over.set()
        self._thread.join()


def no_viewer() -> str:
    """Refuse, as on a machine without Rerun."""
    raise PeerError("viewer: the dashboard needs Rerun, which is not installed")


@pytest.fixture
def fleet(make_bus: MakeBus) -> Iterator[Fleet]:
    answering = Fleet(make_bus())
    yield answering
    answering.end()


@pytest.fixture
def port(make_bus: MakeBus, fleet: Fleet) -> Iterator[int]:
    free = Endpoint("127.0.0.1", 0).claim().port
    with Server(free, TOKEN, Asking(make_bus(), no_viewer, TapeProcess(None))) as server:
        server.show({"test/frame": 1})
        yield free


def said(port: int, method: str, path: str, body: bytes = b"", headers: dict[str, str] = BEARER) -> tuple[int, Any]:
    connection = HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
    try:
        connection.request(method, path, body=body or None, headers=headers)
        answer = connection.getresponse()
        text = answer.read().decode()
        return answer.status, json.loads(text) if answer.headers.get_content_subtype() == "json" else text
    finally:
        connection.close()


GO: Final = b'{"do":"go"}'
# fmt: off
TABLE: Final = {  # what comes: method, path, body, headers -> status, a part of the answer
    "go":               ("POST", "/action", GO, BEARER, 200, "done for all"),
    "an order":         ("POST", "/order?robot=r3", b'{"id":"a","targets":[[1,2]]}', BEARER, 200, "done for r3"),
    "a refusal":        ("POST", "/action", b'{"do":"pause"}', BEARER, 409, "the run is waiting: expected one of (go)"),
    "the page":         ("GET", f"/?token={TOKEN}", b"", {}, 200, "<title>the box</title>"),
    "a module":         ("GET", "/page/main.js", b"", {}, 200, "import"),
    "the topics":       ("GET", "/topics", b"", BEARER, 200, "robot/{robot}/order"),
    "no token":         ("POST", "/action", GO, {}, 403, "expected the token of this box"),
    "a wrong token":    ("POST", "/action", GO, {"Authorization": "Bearer wrong"}, 403, "expected the token of this box"),
    "the page, no token": ("GET", "/", b"", {}, 403, "use the address that was printed"),
    "live, no token":   ("GET", "/live", b"", {}, 403, "expected the token of this box"),
    "another origin":   ("POST", "/action", GO, BEARER | {"Origin": "https://evil.example"}, 403, "the box's own page"),
    "no origin of ours": ("POST", "/action", GO, BEARER | {"Origin": "null"}, 403, "the box's own page"),
    "another host":     ("POST", "/action", GO, BEARER | {"Host": "evil.example"}, 403, "expected a request to 127.0.0.1"),
    "garbage":          ("POST", "/action", b"\xff{]", BEARER, 400, "expected Action as JSON"),
    "nothing":          ("POST", "/action", b"", BEARER, 400, "expected Action as JSON"),
    "deep garbage":     ("POST", "/action", b'{"do":' + b"[" * 20_000, BEARER, 400, "expected Action as JSON"),
    "a wrong word":     ("POST", "/action", b'{"do":"fly"}', BEARER, 400, "Invalid enum value 'fly' - at `$.do`"),
    "no number":        ("POST", "/order?robot=r3", b'{"id":"a","targets":[[1e999,2]]}', BEARER, 400, "as JSON"),
    "no robot":         ("POST", "/order", b'{"id":"a","targets":[]}', BEARER, 400, "expected ?robot=NAME"),
    "all robots":       ("POST", "/order?robot=*", b'{"id":"a","targets":[]}', BEARER, 400, "expected ?robot=NAME"),
    "another version":  ("POST", "/action", b'{"v":2,"do":"go"}', BEARER, 400, "Invalid value 2"),
    "an unknown field": ("POST", "/order?robot=r3", b'{"id":"a","targets":[[1,2]],"hom":true}', BEARER, 400, "got 'hom'; did you mean 'home'?"),
    "too long":         ("POST", "/edit", b" " * (LONGEST + 1), BEARER, 413, "expected at most"),
    "a wrong method":   ("GET", "/action", b"", BEARER, 405, "see /topics"),
    "no such path":     ("GET", "/nothing", b"", BEARER, 404, "see /topics"),
    "a path upwards":   ("GET", "/page/..%2f..%2fprocess.py", b"", BEARER, 404, ""),
    "no such file":     ("GET", "/page/secret.txt", b"", BEARER, 404, "no such file"),
    "no world":         ("GET", "/status", b"", BEARER, 409, "expected a world in that fleet, found none"),
    "no viewer":        ("POST", "/viewer", b"", BEARER, 409, "the dashboard needs Rerun"),
    "the viewer, no token": ("POST", "/viewer", b"", {}, 403, "expected the token of this box"),
    "no tape":          ("POST", "/past", b'{"at":1}', BEARER, 409, "expected the tape of this run on this machine, found none"),
    "why, no tape":     ("POST", "/why?robot=r1", b"{}", BEARER, 409, "expected the tape of this run on this machine"),
    "the past, no token": ("POST", "/past", b"{}", {}, 403, "expected the token of this box"),
    "the past by GET":  ("GET", "/past", b"", BEARER, 405, "see /topics"),
    "no time":          ("POST", "/past", b'{"at":-1}', BEARER, 400, "expected Question as JSON"),
    "no question":      ("POST", "/past", b'{"at":1,"file":"/etc/passwd"}', BEARER, 400, "got 'file'"),
    "why all robots":   ("POST", "/why?robot=*", b"{}", BEARER, 400, "expected ?robot=NAME"),
    "no launcher":      ("GET", "/scenario", b"", BEARER, 409, "expected a world and a launcher, found none"),
}
# fmt: on


@pytest.mark.parametrize("name", TABLE)
def test_a_request_gets_its_answer_or_a_sentence(name: str, port: int, fleet: Fleet) -> None:
    method, path, body, headers, status, part = TABLE[name]
    got, answer = said(port, method, path, body, headers)
    text = answer if isinstance(answer, str) else answer.get("refused") or json.dumps(answer)
    assert (got, part in text) == (status, True), text
    carried_out = {
        "go": [Action(do=Do.GO)],
        "a refusal": [Action(do=Do.PAUSE)],
        "an order": [Order(id="a", targets=[(1.0, 2.0)])],
    }
    assert fleet.carried_out == carried_out.get(name, []), "what is refused never reaches the fleet"


def test_every_request_of_the_wire_has_a_path_and_says_so(port: int) -> None:
    _, told = said(port, "GET", "/topics")
    assert {path.split("?")[0].removeprefix("/") for path in told["paths"]} == set(REQUESTS)
    assert told["paths"]["/order?robot=NAME"] == {
        "topic": "robot/{robot}/order",
        "message": "Order",
        "answer": "Accepted",
    }
    assert "world/truth" in told["topics"]


def test_the_page_may_ask_nobody_else(port: int) -> None:
    connection = HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
    connection.request("GET", f"/?token={TOKEN}")
    answer = connection.getresponse()
    policy = answer.headers["Content-Security-Policy"]
    answer.read()
    connection.close()
    assert "default-src 'none'" in policy
    assert "connect-src 'self'" in policy
    assert policy.replace("frame-src http://127.0.0.1:* http://localhost:*", "").count("http") == 0, (
        "Rerun's viewer on this machine"
    )
    assert answer.headers["Referrer-Policy"] == "no-referrer", "the token is in the address"


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dashboard.box.server.SILENT", 0.2)


SILENCE: Final = {
    "not a word": (b"", b""),
    "half a line": (b"GET / HT", b""),
    "half a head": (b"POST /action HTTP/1.1\r\nHost: 127.0.0.1\r\n", b""),
    "half a body": (
        b"POST /action HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer a-token-of-this-test\r\n"
        b"Content-Length: 11\r\n\r\n{",
        b"expected the whole request within 0.2 s",
    ),
}


@pytest.mark.parametrize("name", SILENCE)
def test_a_connection_that_stays_silent_is_dropped(name: str, hasty: None, port: int, fleet: Fleet) -> None:
    says, hears = SILENCE[name]
    with create_connection(("127.0.0.1", port), PATIENCE) as silent:
        silent.sendall(says)
        heard = b"".join(iter(lambda: silent.recv(4096), b""))
    assert hears in heard
    assert bool(heard) is bool(hears)
    assert fleet.carried_out == []
    assert said(port, "POST", "/action", GO)[0] == 200


CLICKS: Final = 1000


def test_a_thousand_clicks_are_each_answered_and_the_frames_go_on(port: int, fleet: Fleet) -> None:
    async def click(session: aiohttp.ClientSession) -> int:
        async with session.post(f"http://127.0.0.1:{port}/action", data=GO, headers=BEARER) as answer:
            told = await answer.json()
            assert ("text" in told) is (answer.status == 200)
            assert answer.status == 200 or "requests under way" in told["refused"]
            return answer.status

    async def crowd() -> list[int]:
        async with (
            aiohttp.ClientSession() as session,
            session.ws_connect(f"http://127.0.0.1:{port}/live?token={TOKEN}") as live,
        ):
            answers = await asyncio.gather(*(click(session) for _ in range(CLICKS)))
            assert await live.receive_json(timeout=PATIENCE) == {"key": "test/frame", "message": 1}
            return answers

    answers = asyncio.run(crowd())
    assert set(answers) <= {200, 429}
    assert answers.count(200) == len(fleet.carried_out) > 0, "each one that is not refused is carried out once"
    assert said(port, "POST", "/action", GO)[0] == 200, "and then there is room again"


SAYINGS: Final = {"{]": 1007, '{"select": 3}': 1007, "[]": 1007, '{"select": "' + "r" * 2000 + '"}': 1009}


@pytest.mark.parametrize("saying", SAYINGS)
def test_a_page_that_says_garbage_is_sent_away(saying: str, port: int) -> None:
    async def say() -> int | None:
        async with (
            aiohttp.ClientSession() as session,
            session.ws_connect(f"http://127.0.0.1:{port}/live?token={TOKEN}") as live,
        ):
            await live.send_str(saying)
            while (await live.receive(timeout=PATIENCE)).type is aiohttp.WSMsgType.TEXT:
                pass
            return live.close_code

    assert asyncio.run(say()) == SAYINGS[saying]
    assert said(port, "POST", "/action", GO)[0] == 200


def test_a_port_in_use_is_a_sentence(port: int, make_bus: MakeBus) -> None:
    with (
        pytest.raises(ConfigError, match=rf"box: port {port}: expected a free port"),
        Server(port, TOKEN, Asking(make_bus(), no_viewer, TapeProcess(None))),
    ):
        pass
