"""A stranger on a fleet's router: it sends any bytes on any key and answers for others, as only drills do."""

from collections.abc import Callable
from typing import Any

import zenoh

from swarm.bus import settings
from swarm.messages.topic import below


class Stranger:
    """A session that keeps to no table of topics; use it in a ``with``. Keys are below the fleet's."""

    def __init__(self, endpoint: settings.Endpoint, fleet: str) -> None:
        self._endpoint, self._prefix = endpoint, below(fleet)
        self._declared: list[Any] = []

    def __enter__(self) -> "Stranger":
        self._session = zenoh.open(settings.client(self._endpoint))
        return self

    def __exit__(self, *fault: object) -> None:
        self._session.close()  # type: ignore[no-untyped-call]

    def put(self, key: str, payload: bytes) -> None:
        """Send bytes; the key may have wildcards."""
        self._session.put(self._prefix + key, payload)

    def pretend(self, key: str) -> None:
        """Announce somebody who is not there."""
        self._declared.append(self._session.liveliness().declare_token(f"{self._prefix}alive/{key}"))

    def answer(self, key: str, reply: Callable[[bytes], bytes]) -> None:
        """Answer every request on a key with what ``reply`` makes of it."""
        full = self._prefix + key

        def on_query(query: zenoh.Query) -> None:
            query.reply(full, reply(query.payload.to_bytes() if query.payload is not None else b""))
            query.drop()  # type: ignore[no-untyped-call]

        self._declared.append(self._session.declare_queryable(full, zenoh.handlers.Callback(on_query, indirect=False)))
