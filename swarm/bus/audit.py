"""`swarm router --audit`: it names the members that try what the access list refuses, as read from Zenoh's log.

Zenoh tells nobody of a refusal, except in its log at the level ``trace``, on the standard output. The log has a line
for each message, refused or not. So the audit is for looking closer, not for every run (docs/security.md: its cost).

A key may hold line breaks, with which a member could write lines in the name of another one. So the log is read through
a socket that keeps what is written at once together: Zenoh writes each record at once.
"""

import os
import re
import socket
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Thread
from typing import Final

import zenoh

FILTER: Final = "error,zenoh_link_tls=warn,zenoh::net::routing::interceptor::access_control=trace"
COLOUR: Final = re.compile(r"\x1b\[[0-9;]*m")
RECORD: Final = re.compile(r"\S+Z +[A-Z]+ [^\n]*?ThreadId\((\d+)\) (zenoh\S+): (.*)", re.DOTALL)
CACHING: Final = re.compile(r"ACL \((in|e)gress\): caching permissions for `(.*)` \.\.\.", re.DOTALL)
REFUSED: Final = re.compile(
    r"(Using cached result: )?(\w+)(?: on \S*CertCommonName\(([^)]*)\)\S*)?"
    r" is unauthorized to ([^(]+) \(ingress\) on (.*)",
    re.DOTALL,
)
NO_MEMBER: Final = re.compile(r"(.+?)\.? Hint: ")
LONGEST: Final = 1_000_000  # bytes of a record; a key has at most 64 kB
NAMED: Final = 1000  # most different refusals that are told; more are only counted


class Audit:
    """The refusals in a log, each told once: who, what, and on which key."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._names: dict[str, str] = {}  # of members, by the id of their session
        self._looking_up: dict[str, tuple[str, set[str]]] = {}  # by thread: a new key, and the actions so far
        self.refused: Counter[tuple[str, str, str]] = Counter()  # by name, action and key
        self.uncounted = 0  # refusals of further kinds

    def read(self, record: str) -> None:
        """Take in one record of the log."""
        match = RECORD.fullmatch(COLOUR.sub("", record.removesuffix("\n")))
        if match is None:
            return
        thread, where, text = match.groups()
        if where.startswith("zenoh_link_tls") and (found := NO_MEMBER.match(text)):
            self._refuse("somebody", "connect", found[1])
        elif found := CACHING.fullmatch(text):
            self._looking_up[thread] = (found[2], set()) if found[1] == "in" else ("", set())
        elif (found := REFUSED.fullmatch(text)) and not found[4].startswith("Undeclare"):
            cached, session, name, action, key = found.groups()
            if name is not None:
                self._names[session] = name
            if cached is not None or not self._looked_up(thread, action, key):
                self._refuse(self._names.get(session, session), action.lower(), key)

    def _looked_up(self, thread: str, action: str, key: str) -> bool:
        """Return True if nobody tried this: Zenoh looks up every action once when a key is declared, inwards first."""
        declared, actions = self._looking_up.get(thread, ("", set()))
        if key != declared or action in actions:
            return False
        actions.add(action)
        return True

    def _refuse(self, name: str, action: str, key: str) -> None:
        kind = name, action, key
        if kind not in self.refused:
            if len(self.refused) >= NAMED:
                self.uncounted += 1
                return
            self._say(f"refused: {name}: {action}{': ' if action == 'connect' else ' on '}{key!r}")
        self.refused[kind] += 1

    def close(self) -> None:
        """Log how often each refusal was repeated, the most frequent first."""
        for (name, action, key), times in self.refused.most_common():
            if times == 1:
                break
            self._say(f"refused {times} times: {name}: {action}{': ' if action == 'connect' else ' on '}{key!r}")
        if self.uncounted:
            self._say(f"refused {self.uncounted} times: more than {NAMED} kinds, not told one by one")


@contextmanager
def audited() -> Iterator[None]:
    """Read Zenoh's log, instead of printing it, inside the block; print the refusals."""
    sys.stdout.flush()
    ours = os.fdopen(os.dup(1), "w", buffering=1, encoding="utf-8")
    reading, writing = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with writing:
        os.dup2(writing.fileno(), 1)
    os.environ["RUST_LOG"] = FILTER
    zenoh.init_log_from_env_or(FILTER)
    audit = Audit(lambda line: print(f"router: {line}", file=ours))

    def follow() -> None:
        with reading:
            while record := reading.recv(LONGEST):
                audit.read(record.decode(errors="replace"))

    reader = Thread(target=follow, daemon=True)
    reader.start()
    try:
        yield
    finally:
        os.dup2(ours.fileno(), 1)  # the socket has no writer left, so the reader comes to its end
        reader.join()
        audit.close()
        ours.close()
