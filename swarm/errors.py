"""Every error this project raises, split by whose fault it is.

SwarmError
├── ConfigError      ours to mend: a file, a flag, a port
│   └── ...
└── PeerError        theirs: a message that is not what its key promises

A message says where, what was expected, what came, and what to do.
"""

from collections.abc import Iterable
from difflib import get_close_matches


class SwarmError(Exception):
    """Anything this project refuses, with a sentence a person can act on."""


class ConfigError(SwarmError):
    """A file, a flag or the machine is not as it has to be; the person who started us can mend it."""


class PeerError(SwarmError):
    """Something that arrived from outside is not what its key promises; it is counted and dropped."""


def nearest(word: str, known: Iterable[str]) -> str:
    """Return which known word was probably meant: ``"; did you mean 'radius'?"``, or list them when none is near."""
    known = sorted(known)
    close = get_close_matches(word, known, n=1)
    return f"did you mean {close[0]!r}?" if close else f"known: {', '.join(known)}"
