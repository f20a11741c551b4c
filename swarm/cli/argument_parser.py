"""An argument parser that reports an error in one sentence, and the values that several commands read."""

import argparse
import re
from collections.abc import Sequence
from math import nan, pi
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NoReturn

from swarm.errors import ConfigError, suggest_similar
from swarm.settings import Pace

if TYPE_CHECKING:
    from swarm.bus import Endpoint
    from swarm.maps.occupancy import Point

DEFAULT_PLACE: Final = "127.0.0.1:7447"
PACES: Final[dict[str, Pace]] = {"realtime": 1.0, "max": "max"}
FAR: Final = 1e6  # m; no message names a place beyond
POINTS: Final = ("--from", "--to", "--at", "--start", "--target")

Commands = argparse._SubParsersAction  # argparse gives it no public name


class Parser(argparse.ArgumentParser):
    """An argument parser that raises ``ConfigError`` instead of ending the process.

    If it is ``mixed``, arguments without a name may stand before and behind options.
    """

    mixed = False
    _inside = False  # argparse reads mixed ones by two calls of ``parse_known_args``

    def error(self, message: str) -> NoReturn:
        """Raise a ``ConfigError`` that says what is wrong and how to get help."""
        command = self.prog.removeprefix("swarm").strip()  # none: it is the parser of `swarm` itself
        raise ConfigError(f"{command}{': ' * bool(command)}{message}; see {self.prog} --help")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:  # noqa: ANN401, as argparse has it
        """Read what is known; refuse the rest here, where the command is known and may have an option like it."""
        if self._inside or not self.mixed:
            found, others = super().parse_known_args(args, namespace)
        else:
            self._inside = True
            try:
                found, others = self.parse_known_intermixed_args(args, namespace)
            finally:
                self._inside = False
        if others and not self._inside:
            options = [name for action in self._actions for name in action.option_strings]
            meant = suggest_similar(others[0], options)
            self.error(f"unrecognized arguments: {' '.join(others)}{'; ' * bool(meant)}{meant}")
        return found, others


class Version(argparse.Action):
    """Prints the version and the versions that a run depends on."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        """Print and end the process."""
        from importlib.metadata import version
        from platform import python_version

        from swarm.fingerprint import fingerprint
        from swarm.installation import installed_libraries
        from swarm.messages import VERSION

        print(f"zenoh-swarm {version('zenoh-swarm')}")
        print(f"wire swarm/v{VERSION}, code {fingerprint()}, Python {python_version()}")
        print(", ".join(f"{name} {version(name)}" for name in installed_libraries()))
        parser.exit()


def join_points(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with points such as ``-1,2`` written so that argparse does not take them for flags.

    >>> join_points(["edit", "wall", "-1,2", "3,4"]), join_points(["plan", "--from", "-1,2"])
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
    """Read ``X,Y`` [m].

    Raises:
        ConfigError: the text does not have that form, or is not a place: not a number, or too far away.
    """
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        x = y = nan
    if not (abs(x) <= FAR and abs(y) <= FAR):
        raise ConfigError(f"expected a point X,Y, each within 1e6 m, got {text.strip()!r}; for example 1.5,2")
    return x, y


def stop_at(text: str) -> "tuple[float, float, float | None]":
    """Read ``X,Y`` [m] or ``X,Y,YAW`` [m, m, rad]; the yaw is None if there is none.

    Raises:
        ConfigError: the text has neither form, or is not a place; or the yaw is not within a half turn.

    >>> stop_at("1.5,2"), stop_at("1.5,2,-1.57")
    ((1.5, 2.0, None), (1.5, 2.0, -1.57))
    """
    place, comma, turn = text.strip(), "", ""
    if text.count(",") == 2:
        place, comma, turn = text.strip().rpartition(",")
    x, y = point(place)
    if not comma:
        return x, y, None
    try:
        yaw = float(turn)
    except ValueError:
        yaw = nan
    if not abs(yaw) <= pi:
        raise ConfigError(f"expected X,Y or X,Y,YAW with a yaw from -3.14 to 3.14 rad, got {text.strip()!r}")
    return x, y, yaw


def seconds(text: str) -> float:
    """Read how long a tool listens [s].

    Raises:
        ConfigError: the text is no number from 0.1 to 1e6.
    """
    return parse_number_within(0.1, 1e6, text, "--seconds: expected 0.1 to 1e6 s")


def secure(parser: Parser) -> None:
    """Add the option that names the folder with the keys."""
    text = "folder with the keys of this fleet (`swarm keys`); without it the fleet is open to all on this machine"
    parser.add_argument("--secure", type=Path, metavar="DIR", help=text)


def endpoint(place: str | None, keys: Path | None, member: str) -> "Endpoint":
    """Read the endpoint that is given, or return the usual one, for a member of a fleet.

    Raises:
        ConfigError: the endpoint is wrong, or it needs keys and none are given.
    """
    from swarm.bus import Endpoint

    return Endpoint.parse(place or f"{'tcp' if keys is None else 'tls'}/{DEFAULT_PLACE}", keys, member)


def robots_of(text: str) -> int | dict[str, int]:
    """Read a number of robots, or how many of each kind, such as ``scout=6,cart=2``.

    Raises:
        ConfigError: the text is neither.
    """
    from swarm.kinds import parse_mix

    return parse_mix(text)


def pace(text: str) -> Pace:
    """Read ``realtime``, ``max`` (lockstep) or a speed-up factor.

    Raises:
        ConfigError: the text is none of them.
    """
    if text in PACES:
        return PACES[text]
    return parse_number_within(0.001, 1000.0, text, "--pace: expected realtime, max or a factor from 0.001 to 1000")


def parse_number_within(low: float, high: float, text: str, expected: str) -> float:
    """Read a number from ``low`` to ``high``.

    Raises:
        ConfigError: the text is none; it says what was ``expected``, and what came.
    """
    try:
        number = float(text)
    except ValueError:
        number = nan
    if not low <= number <= high:
        raise ConfigError(f"{expected}, got {text!r}")
    return number
