"""Every error that this project raises, split by whose fault it is.

SwarmError
├── ConfigError      the user's to correct: a file, a flag, a port
│   └── ...
└── PeerError        the sender's fault: a message that does not match its key

An error text says where, what was expected, what came, and what to do.
"""

from collections.abc import Iterable
from difflib import get_close_matches


class SwarmError(Exception):
    """Base of all errors; its text is a sentence that a person can act on."""


class ConfigError(SwarmError):
    """A wrong file, flag or machine setup; the user who started the program can correct it."""


class PeerError(SwarmError):
    """A received message that does not match its key; the receiver counts and drops it."""


def suggest(word: str, known: Iterable[str]) -> str:
    """Return ``"did you mean 'radius'?"`` for the most similar known word, or a list of them if none is similar."""
    known = sorted(known)
    return suggest_similar(word, known) or f"known: {', '.join(known)}"


def suggest_similar(word: str, known: Iterable[str]) -> str:
    """Return ``"did you mean 'radius'?"`` for the most similar known word, "" if none is similar."""
    close = get_close_matches(word, sorted(known), n=1)
    return f"did you mean {close[0]!r}?" if close else ""
