"""The fingerprint of the code that decides: the same code and libraries give the same run again, bit for bit."""

import hashlib
import sys
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Final

ROOMS: Final = ("swarm", "world")
LEFT_OUT: Final = (
    "swarm/cli",
    "swarm/launch",
    "swarm/secure",
    "swarm/storm",
    "swarm/blackbox/replay",
    "swarm/blackbox/explain",
)  # they decide nothing
ENDINGS: Final = (".py", ".so")  # rules and maps are on the tape
OF_ROBOTS: Final = ("numpy", "numba", "msgspec")  # the libraries that compute in a robot's process
LIBRARIES: Final = (*OF_ROBOTS, "pymunk", "shapely")


@cache
def fingerprint(left_out: tuple[str, ...] = LEFT_OUT, libraries: tuple[str, ...] = LIBRARIES) -> str:
    """Return 16 hexadecimal digits of this package's code, the libraries that compute, and this Python."""
    found = hashlib.blake2b(digest_size=8)
    for room in ROOMS:
        spec = find_spec(room)
        for folder in (spec.submodule_search_locations or ()) if spec is not None else ():
            for file in sorted(Path(folder).rglob("*")):
                name = f"{room}/{file.relative_to(folder).as_posix()}"
                if file.suffix in ENDINGS and not name.startswith(left_out):
                    found.update(name.encode() + b"\0" + hashlib.blake2b(file.read_bytes()).digest())
    for library in filter(_is_installed, libraries):  # a robot's image has no others
        found.update(f"{library} {version(library)}\n".encode())
    found.update(f"{sys.implementation.cache_tag}".encode())
    return found.hexdigest()


def _is_installed(library: str) -> bool:
    return find_spec(library) is not None
