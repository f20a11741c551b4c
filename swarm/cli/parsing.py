"""argparse with one sentence for what is wrong, and the values that several commands take."""

import argparse
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NoReturn

from swarm.errors import ConfigError
from swarm.settings import Pace

if TYPE_CHECKING:
    from swarm.maps.occupancy import Point

DEFAULT_ENDPOINT: Final = "tcp/127.0.0.1:7447"
PACES: Final[dict[str, Pace]] = {"realtime": 1.0, "max": "max"}
POINTS: Final = ("--from", "--to")

Commands = argparse._SubParsersAction  # argparse gives it no public name


class Parser(argparse.ArgumentParser):
    """argparse, with one sentence for what is wrong."""

    def error(self, message: str) -> NoReturn:
        """Raise what is wrong, and how to see what is right."""
        raise ConfigError(f"{self.prog}: {message}; see {self.prog} --help")


def joined(arguments: Sequence[str]) -> list[str]:
    """Join ``--from -1,2`` to ``--from=-1,2``, and begin any other ``-1,2`` with a blank: argparse sees flags in them.

    >>> joined(["edit", "wall", "-1,2", "3,4"]), joined(["plan", "--from", "-1,2"])
    (['edit', 'wall', ' -1,2', '3,4'], ['plan', '--from=-1,2'])
    """
    words: list[str] = []
    for word in arguments:
        if words and words[-1] in POINTS:
            words[-1] += f"={word}"
        elif re.match(r"-[\d.][^,]*,", word):
            words.append(f" {word}")
        else:
            words.append(word)
    return words


def point(text: str) -> "Point":
    """Read ``X,Y`` [m]."""
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise ConfigError(f"expected a point X,Y in metres, got {text.strip()!r}; for example 1.5,2") from None
    return x, y


def pace(text: str) -> Pace:
    """Read ``realtime``, ``max`` (lockstep) or a speed-up factor."""
    if text in PACES:
        return PACES[text]
    try:
        factor = float(text)
    except ValueError:
        factor = 0.0
    if not 0.001 <= factor <= 1000:
        raise ConfigError(f"--pace: expected realtime, max or a factor from 0.001 to 1000, got {text!r}")
    return factor
