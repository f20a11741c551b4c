"""The box's web server: pages, requests and the live frames. Nothing outside this file imports aiohttp.

It answers whoever has the token, from a page of its own or from no page at all (curl). It runs in a thread of its own,
so a slow browser never delays the fleet's messages.
"""

import asyncio
import json
from collections.abc import Awaitable, Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from hmac import compare_digest
from importlib.resources import files
from threading import Thread
from typing import Final

from aiohttp import WSCloseCode, WSMsgType, web

from dashboard.box.board import MOST_VIEWERS, Board, Viewer
from dashboard.box.browser_request import REQUESTS, Asking
from dashboard.box.questions import QUESTIONS
from dashboard.mode import LOOPBACK
from swarm.errors import ConfigError, PeerError, SwarmError

SILENT: Final = 10.0  # s in which a browser answers a ping, and a connection brings its first request
IDLE: Final = 30.0  # s for which a connection is kept for another request
MOST_ASKED: Final = 16  # requests under way; more are refused
LONGEST: Final = 262_144  # bytes of a request, as the wire's longest
SAID: Final = 1000  # bytes of what a page says over its WebSocket
OURS: Final = {LOOPBACK, "localhost", "[::1]"}  # names of this machine
TYPES: Final = {"html": "text/html", "js": "text/javascript", "css": "text/css", "svg": "image/svg+xml"}
HEADERS: Final = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "frame-src http://127.0.0.1:* http://localhost:*; "  # Rerun's viewer
    "img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",  # the token is in the address
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
}

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


def assets() -> dict[str, tuple[bytes, str]]:
    """Return the files of the page by name, each with its type; nothing else is ever served from the disk."""
    folder = files("dashboard.box") / "assets"
    return {
        file.name: (file.read_bytes(), TYPES[file.name.rsplit(".", 1)[1]])
        for file in folder.iterdir()
        if file.name.rsplit(".", 1)[-1] in TYPES
    }


def refusal_of(status: int, reason: str) -> web.Response:
    """Return a refusal: a sentence."""
    return web.json_response({"refused": reason}, status=status, headers=HEADERS)


def refuse_crowd() -> web.Response:
    """Return the refusal of one request too many."""
    return refusal_of(429, f"expected at most {MOST_ASKED} requests under way, got one more; wait for an answer")


def _answer_request(body: bytes, kind: str = "application/json") -> web.Response:
    return web.Response(body=body, content_type=kind, charset="utf-8", headers=HEADERS)


class Server:
    """The server on a port. Use it in a ``with``; ``show`` puts a frame on everybody's page.

    Only the names of this machine's loopback are answered; ``bind`` is for containers that publish the port there.
    """

    def __init__(self, port: int, token: str, asking: Asking, bind: str = LOOPBACK) -> None:
        self._port, self._token, self._wire, self._bind = port, token, asking, bind
        self._board = Board()
        self._news: set[asyncio.Event] = set()  # one a browser: something waits for it
        self._files = assets()
        self._loop = asyncio.new_event_loop()
        self._thread = Thread(target=self._run, name="swarm-box", daemon=True)
        self._asked = 0  # requests under way
        self._spoke: set[object] = set()  # connections that have brought a request
        self._pool = ThreadPoolExecutor(max_workers=MOST_ASKED, thread_name_prefix="swarm-box-ask")
        self._listens: Future[None] = Future()
        self._over: asyncio.Event | None = None

    def __enter__(self) -> "Server":
        """Serve.

        Raises:
            ConfigError: the port is in use.
        """
        self._thread.start()
        self._listens.result()
        return self

    def __exit__(self, *fault: object) -> None:
        if self._over is not None:
            self._loop.call_soon_threadsafe(self._over.set)
        self._thread.join()
        self._pool.shutdown(wait=False, cancel_futures=True)

    @property
    def selection(self) -> frozenset[str]:
        """The robots that browsers have selected."""
        return self._board.selection

    @property
    def is_watched(self) -> bool:
        """True if a browser looks."""
        return bool(self._board.viewers)

    def show(self, frames: Mapping[str, object]) -> None:
        """Put frames on all pages, each in place of the one before of its kind: key -> content."""
        self._loop.call_soon_threadsafe(self._show, dict(frames))

    # --- the thread ---

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve())
        finally:
            self._listens.cancel()  # whoever waits for it learns that it never will
            self._loop.close()

    def _show(self, frames: dict[str, object]) -> None:
        shown = [key for key, content in frames.items() if self._board.show(key, content)]
        if shown:
            self._wake()

    def _wake(self) -> None:
        for news in self._news:
            news.set()

    async def _serve(self) -> None:
        application = web.Application(middlewares=[self._guard_request], client_max_size=LONGEST)
        application.router.add_get("/", self._file)
        application.router.add_get("/page/{name}", self._file)
        application.router.add_get("/live", self._live)
        for path, told, kind in (
            ("/status", self._wire.status, "application/json"),
            ("/topics", self._wire.topics, "application/json"),
            ("/scenario", self._wire.scenario, "text/yaml"),
        ):
            application.router.add_get(path, self._make_get_handler(told, kind))
        application.router.add_post("/viewer", self._make_get_handler(self._wire.viewer, "application/json"))
        for name in REQUESTS:
            application.router.add_post(f"/{name}", self._make_post_handler(partial(self._wire.ask, name)))
        for question in QUESTIONS:
            application.router.add_post(
                f"/{question}", self._make_post_handler(partial(self._wire.of_the_past, question))
            )
        runner = web.AppRunner(application, access_log=None, shutdown_timeout=1.0, keepalive_timeout=IDLE)
        await runner.setup()
        watch = asyncio.create_task(self._drop_silent(runner))
        self._over = asyncio.Event()
        try:
            try:
                await web.TCPSite(runner, self._bind, self._port).start()
            except OSError as fault:
                self._listens.set_exception(ConfigError(f"box: port {self._port}: expected a free port, got {fault}"))
                return
            self._listens.set_result(None)
            await self._over.wait()
            self._wake()
        finally:
            watch.cancel()
            await runner.cleanup()

    async def _drop_silent(self, runner: web.AppRunner) -> None:
        """Drop connections that bring no whole request: each would hold a place for as long as it likes."""
        since: dict[web.RequestHandler, float] = {}
        while runner.server is not None:
            now = self._loop.time()
            there = runner.server.connections
            self._spoke.intersection_update(there)
            since = {one: since.get(one, now) for one in there if one not in self._spoke}
            for one, began in since.items():
                if now - began >= SILENT:
                    one.force_close()
            await asyncio.sleep(SILENT / 4)

    @web.middleware
    async def _guard_request(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Let in only requests to this machine's own name, from the box's own page or from no page."""
        self._spoke.add(request.protocol)
        origin = request.headers.get("Origin")
        if request.host.rsplit(":", 1)[0] not in OURS:
            return refusal_of(403, f"expected a request to 127.0.0.1 or localhost, got one to {request.host[:100]!r}")
        if origin is not None and origin != f"http://{request.host}":
            return refusal_of(403, f"expected a request of the box's own page, got one of {origin[:100]!r}")
        open_to_all = request.path.startswith("/page/")  # they hold no secret
        if not (open_to_all or compare_digest(_token_of(request).encode("utf-8", "replace"), self._token.encode())):
            return refusal_of(
                403, "expected the token of this box, got none or another; use the address that was printed"
            )
        try:
            return await handler(request)
        except web.HTTPRequestEntityTooLarge:
            return refusal_of(413, f"expected at most {LONGEST} bytes, got more")
        except web.HTTPException as fault:
            return refusal_of(fault.status, f"{request.method} {request.path[:100]}: {fault.reason}; see /topics")

    async def _file(self, request: web.Request) -> web.Response:
        found = self._files.get(request.match_info.get("name", "index.html"))
        return refusal_of(404, "no such file") if found is None else _answer_request(*found)

    def _make_get_handler(self, told: Callable[[], bytes], kind: str) -> Handler:
        async def tell(request: web.Request) -> web.Response:
            return await self._in_thread(told, kind)

        return tell

    def _make_post_handler(self, carry_out: Callable[[str | None, bytes], bytes]) -> Handler:
        """Return the handler of a path whose robot and body are carried out."""

        async def ask(request: web.Request) -> web.Response:
            if self._asked >= MOST_ASKED:
                return refuse_crowd()  # before its body takes room
            try:
                body, robot = await asyncio.wait_for(request.read(), SILENT), request.query.get("robot")
            except TimeoutError:
                return refusal_of(408, f"expected the whole request within {SILENT:g} s, got a part of it")
            return await self._in_thread(lambda: carry_out(robot, body))

        return ask

    async def _in_thread(self, work: Callable[[], bytes], kind: str = "application/json") -> web.Response:
        """Do what waits for the fleet in another thread, and only so much of it at once."""
        if self._asked >= MOST_ASKED:
            return refuse_crowd()
        self._asked += 1
        try:
            return _answer_request(await asyncio.get_running_loop().run_in_executor(self._pool, work), kind)
        except ConfigError as fault:
            return refusal_of(400, str(fault))
        except PeerError as fault:
            return refusal_of(409, str(fault))
        except SwarmError as fault:
            return refusal_of(500, str(fault))
        finally:
            self._asked -= 1

    # --- the live frames ---

    async def _live(self, request: web.Request) -> web.StreamResponse:
        if self._board.full:
            return refusal_of(503, f"expected at most {MOST_VIEWERS} browsers, got one more; close one")
        socket = web.WebSocketResponse(heartbeat=SILENT, max_msg_size=SAID, compress=False)
        await socket.prepare(request)
        viewer = self._board.enter()
        sender = asyncio.create_task(self._send(socket, viewer))
        try:
            async for said in socket:
                if said.type is WSMsgType.TEXT and (wrong := _take_selection(viewer, said.data)):
                    await socket.close(code=WSCloseCode.INVALID_TEXT, message=wrong.encode())
        finally:
            self._board.leave(viewer)
            sender.cancel()
        return socket

    async def _send(self, socket: web.WebSocketResponse, viewer: Viewer) -> None:
        """Send what waits for a browser. A browser that does not read stops here: then more than one frame waits."""
        assert self._over is not None
        news = asyncio.Event()
        news.set()  # all that is on the board
        self._news.add(news)
        try:
            while not socket.closed and not self._over.is_set():
                await news.wait()
                news.clear()
                for frame in viewer.take():
                    await socket.send_str(frame)
            await socket.close(code=WSCloseCode.GOING_AWAY, message=b"the box has ended")
        except ConnectionError:
            pass  # the browser has left
        finally:
            self._news.discard(news)


def _token_of(request: web.Request) -> str:
    scheme, _, token = request.headers.get("Authorization", "").partition(" ")
    return token if scheme == "Bearer" else request.query.get("token", "")


def _take_selection(viewer: Viewer, text: str) -> str:
    """Take in what a page says: which robot it has selected. Return what is wrong with it, "" for nothing."""
    try:
        selected = json.loads(text)["select"]
    except (ValueError, KeyError, TypeError, RecursionError):
        return 'expected {"select": "ROBOT"} or {"select": null}'
    if not (selected is None or (isinstance(selected, str) and len(selected) <= 64)):
        return "expected the name of a robot, or null"
    viewer.selected = selected
    return ""
