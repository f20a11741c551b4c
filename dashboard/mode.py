"""Where the dashboard shows itself, decided without Rerun being there."""

from collections.abc import Mapping
from importlib.util import find_spec
from typing import Final, Literal, cast

from swarm.errors import ConfigError

Mode = Literal["viewer", "web", "off-screen"]
ASKED: Final = ("auto", "viewer", "web", "off")
SCREENS: Final = ("DISPLAY", "WAYLAND_DISPLAY")


def choose(asked: str, environ: Mapping[str, str], *, record: bool = False) -> Mode | None:
    """Turn what was asked for into a mode; None: no dashboard.

    ``auto`` is the native viewer where there is a display and the viewer is installed, else the web viewer. With
    ``record``, ``off`` still draws into the file (``off-screen``).

    Raises:
        ConfigError: ``asked`` is none of ``ASKED``.

    >>> choose("auto", {}), choose("off", {}), choose("off", {}, record=True)
    ('web', None, 'off-screen')
    """
    if asked not in ASKED:
        raise ConfigError(f"dashboard: expected one of {', '.join(ASKED)}, got {asked!r}")
    if asked == "off":
        return "off-screen" if record else None
    if asked == "auto":
        screen = any(environ.get(name) for name in SCREENS)
        return "viewer" if screen and find_spec("rerun_cli") else "web"
    return cast("Mode", asked)


def missing() -> str | None:
    """Say in one sentence that the dashboard's own dependencies are not installed; None: they are."""
    if find_spec("rerun") is None:
        return "the dashboard needs Rerun, which is not installed: pip install 'zenoh-swarm[dashboard]', or run without"
    return None
