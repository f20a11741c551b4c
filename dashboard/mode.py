"""The choice of where the dashboard is shown, and the addresses of its pages; it works without Rerun."""

from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from socket import create_connection, gethostname
from typing import Final, Literal, cast

from swarm.errors import ConfigError

Mode = Literal["viewer", "web", "off-screen"]
ASKED: Final = ("auto", "viewer", "web", "box", "off")
BOX: Final = "box"  # the page of dashboard/box, which needs no Rerun
TOKEN: Final = 18  # bytes of chance in the token of a box
LOOPBACK: Final = "127.0.0.1"
ANY: Final = "0.0.0.0"  # all addresses of this machine
ANSWERS: Final = 2.0  # s in which a port of this machine answers
SCREENS: Final = ("DISPLAY", "WAYLAND_DISPLAY")


def resolve_auto(asked: str, environ: Mapping[str, str], otherwise: str = BOX) -> str:
    """Return what ``auto`` means on this machine: the viewer if there is a display and Rerun, else ``otherwise``."""
    if asked != "auto":
        return asked
    return "viewer" if has_screen(environ) and find_spec("rerun_cli") else otherwise


def choose(asked: str, environ: Mapping[str, str], *, record: bool = False) -> Mode | None:
    """Return the mode of Rerun for what was asked, or None for no Rerun; ``auto`` is one of its two viewers.

    With ``record``, ``off`` still draws into the file (``off-screen``), and so does ``box``, which is none of Rerun's.

    Raises:
        ConfigError: ``asked`` is not in ``ASKED``.

    >>> choose("auto", {}), choose("off", {}), choose("off", {}, record=True)
    ('web', None, 'off-screen')
    """
    if asked not in ASKED:
        raise ConfigError(f"dashboard: expected one of {', '.join(ASKED)}, got {asked!r}")
    if asked in {"off", BOX}:
        return "off-screen" if record else None
    return cast("Mode", resolve_auto(asked, environ, "web"))


def has_screen(environ: Mapping[str, str]) -> bool:
    """Return True if there is a display on which a window can be opened."""
    return any(environ.get(name) for name in SCREENS)


def answers(port: int) -> bool:
    """Return True if somebody listens on a port of this machine."""
    try:
        create_connection((LOOPBACK, port), ANSWERS).close()
    except OSError:
        return False
    return True


def page_address(web_port: int, grpc_port: int, bind: str = LOOPBACK) -> str:
    """Return the address of the page on which a dashboard in mode ``web`` with these ports is seen."""
    host = gethostname() if bind == ANY else bind
    return f"http://{host}:{web_port}{page_path(host, grpc_port)}"


def page_path(host: str, grpc_port: int) -> str:
    """Return the path of the page, which tells it where the data is; without it, Rerun welcomes its visitor."""
    return f"/?url=rerun%2Bhttp://{host}:{grpc_port}/proxy&hide_welcome_screen=1&persist=0&theme=dark"


def box_address(port: int, token: str) -> str:
    """Return the address of the box: who has the token may see and steer the fleet."""
    return f"http://{LOOPBACK}:{port}/?token={token}"


def viewer_program() -> Path | None:
    """Return the native viewer itself: the ``rerun`` on the path is a script, and the viewer would outlive it."""
    spec = find_spec("rerun_cli")
    places = spec.submodule_search_locations if spec is not None else None
    found = [Path(place) / name for place in places or () for name in ("rerun", "rerun.exe")]
    return next((path for path in found if path.is_file()), None)
