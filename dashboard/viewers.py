"""Rerun's viewers of a fleet: its own window, and a page in the browser, which may ask no other host than its own.

Rerun's program serves the page to this process only. This process hands it on with a content security policy: the
browser then refuses the viewer's own requests for fonts, updates and telemetry.
"""

import ctypes
import http.client
import os
import re
import shutil
import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from time import monotonic
from typing import Final

from dashboard.mode import LOOPBACK, answers, page_address, page_path, viewer_program
from swarm.bus import Endpoint
from swarm.errors import ConfigError

SET_DEATH_SIGNAL: Final = 1  # PR_SET_PDEATHSIG of Linux's prctl
STARTED: Final = 20.0  # s, wall time for Rerun's program to answer
SILENT: Final = 30.0  # s without a word, after which a connection is dropped
FILES: Final = frozenset({"/", "/favicon.ico", "/favicon.svg", "/re_viewer.js", "/re_viewer_bg.wasm", "/sw.js"})
HOST: Final = re.compile(r"[A-Za-z0-9.-]{1,253}|\[[0-9a-fA-F:.]{2,45}\]")
QUIET: Final = {"RERUN_ANALYTICS": "0"}  # for Rerun's program itself: it asks nobody either


def policy(hosts: list[str], data: int) -> str:
    """Return the content security policy of a page: its scripts are its own, and it may ask for data at ``hosts``.

    >>> policy(["127.0.0.1"], 9876).split("; ")[1]
    "connect-src 'self' http://127.0.0.1:9876"
    """
    sources = " ".join(f"http://{host}:{data}" for host in hosts)
    scripts = "'unsafe-inline' 'unsafe-eval' 'wasm-unsafe-eval'"  # what Rerun's page is made of
    return (
        f"default-src 'self'; connect-src 'self' {sources}; script-src 'self' {scripts}; "
        "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; worker-src 'self' blob:; form-action 'none'"
    )


def end_with_starter() -> None:
    """Let Linux end this process, a child, when the thread ends that started it, whatever ended that."""
    with suppress(OSError, AttributeError):  # another system
        ctypes.CDLL(None).prctl(SET_DEATH_SIGNAL, signal.SIGTERM)


def end_with_process(parent: int) -> bool:
    """Let Linux end this process with its ``parent``; return False if that has ended meanwhile."""
    end_with_starter()
    return os.getppid() == parent


def rerun_program() -> Path:
    """Return the program of Rerun.

    Raises:
        ConfigError: it is not installed.
    """
    program = viewer_program()
    if program is None:
        raise ConfigError("dashboard: expected the program `rerun`, found none; install rerun-sdk again")
    return program


def open_window(url: str, program: Path) -> "subprocess.Popen[bytes]":
    """Open the native viewer in its own window, which outlives this process."""
    print(f"dashboard: {url}")
    return _start_rerun(program, url, "--hide-welcome-screen", "--port", "auto", "--bind", LOOPBACK, ends_with_us=False)


@contextmanager
def serve_page(url: str, program: Path, bind: str, port: int, data: int) -> Iterator[None]:
    """Serve the page on one address as long as the block lasts, and print its address.

    The data comes from the port ``data``; ``bind`` is where both listen.

    Raises:
        ConfigError: Rerun's program ended, or did not answer in time, or the port is in use.
    """
    behind = Endpoint(LOOPBACK, 0).claim().port
    page = ("--serve-web", "--bind", LOOPBACK, "--web-viewer-port", str(behind))
    process = _start_rerun(program, url, *page, ends_with_us=True)
    try:
        deadline = monotonic() + STARTED
        while not answers(behind):
            with suppress(subprocess.TimeoutExpired):
                process.wait(0.05)
            if process.returncode is not None or monotonic() > deadline:
                raise ConfigError(f"dashboard: expected a page on port {port}, got none; try --dashboard off")
        try:
            server = _server(bind.strip("[]"), port, behind, data)
        except OSError as fault:
            raise ConfigError(f"dashboard: expected to serve port {port}, got: {fault.strerror}") from None
        Thread(target=server.serve_forever, daemon=True).start()
        print(f"dashboard: {page_address(port, data, bind)}")
        try:
            yield
        finally:
            server.shutdown()
            server.server_close()
    finally:
        process.terminate()
        process.wait(5)


def _start_rerun(program: Path, *arguments: str, ends_with_us: bool) -> "subprocess.Popen[bytes]":
    """Start Rerun's program, which says nothing."""
    quiet, ending = subprocess.DEVNULL, end_with_starter if ends_with_us else None
    return subprocess.Popen(
        [program, *arguments],
        stdin=quiet,
        stdout=quiet,
        stderr=quiet,
        env=os.environ | QUIET,
        start_new_session=not ends_with_us,
        preexec_fn=ending,
    )


def _server(bind: str, port: int, behind: int, data: int) -> ThreadingHTTPServer:
    """Return a server that hands on the viewer's files from the port ``behind``."""

    class Handler(BaseHTTPRequestHandler):
        timeout = SILENT

        def do_GET(self) -> None:
            if self.path == "/":  # as one types it, who has read which port it is
                self.send_response(302)
                self.send_header("Location", page_path(self._host_name(), data))
                self.send_header("Content-Length", "0")
                self.end_headers()
                return
            if self.path.partition("?")[0] not in FILES:
                self.send_error(404)
                return
            asked = http.client.HTTPConnection(LOOPBACK, behind, timeout=SILENT)
            try:
                asked.request("GET", self.path.partition("?")[0])
                self._hand_on(asked.getresponse())
            except (OSError, http.client.HTTPException):
                self.close_connection = True
            finally:
                asked.close()

        def _hand_on(self, answer: http.client.HTTPResponse) -> None:
            self.send_response(answer.status)
            for name in ("Content-Type", "Content-Length", "Cache-Control"):
                if (value := answer.getheader(name)) is not None:
                    self.send_header(name, value)
            here = {LOOPBACK, "localhost", socket.gethostname(), self._host_name()}
            self.send_header("Content-Security-Policy", policy(sorted(here), data))
            self.end_headers()
            shutil.copyfileobj(answer, self.wfile)

        def _host_name(self) -> str:
            """Return the name by which a browser has found this host."""
            named = self.headers.get("Host", "").rpartition(":")[0]
            return named if HOST.fullmatch(named) else LOOPBACK

        def log_message(self, *words: object) -> None:
            """Log nothing: the dashboard's lines are about the fleet."""

    family = ThreadingHTTPServer
    family.address_family = socket.AF_INET6 if ":" in bind else socket.AF_INET
    return family((bind, port), Handler)
