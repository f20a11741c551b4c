"""What an installation needs beside this package: a sentence for what is missing, and for what is in its way."""

from collections.abc import Iterable, Mapping
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType
from typing import Final

from swarm.errors import ConfigError

# the dependencies of pyproject.toml, and the name that each is imported by; a test compares them with both
LIBRARIES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "aiohttp": "aiohttp",
        "cryptography": "cryptography",
        "eclipse-zenoh": "zenoh",
        "msgpack": "msgpack",
        "msgspec": "msgspec",
        "numba": "numba",
        "numpy": "numpy",
        "pillow": "PIL",
        "pymunk": "pymunk",
        "pyyaml": "yaml",
        "rich": "rich",
        "shapely": "shapely",
        "shtab": "shtab",
    }
)
ROBOT: Final = (
    "cryptography",
    "eclipse-zenoh",
    "msgpack",
    "msgspec",
    "numba",
    "numpy",
    "pyyaml",
)  # all that `swarm robot` needs
EXTRAS: Final[Mapping[str, Mapping[str, str]]] = MappingProxyType(
    {
        "rerun": {"rerun-sdk": "rerun"},
        "mcap": {"mcap": "mcap"},
        "ros2": {"rosbags": "rosbags", "xxhash": "xxhash"},
        "foxglove": {"foxglove-sdk": "foxglove", "rosbags": "rosbags"},
        "vda5050": {"paho-mqtt": "paho"},
    }
)
NAMES: Final = {  # of extras, for people
    "rerun": "Rerun",
    "ros2": "the bridge to ROS 2",
    "foxglove": "the bridge to Foxglove",
    "vda5050": "the bridge to VDA 5050",
}
TOPS: Final = ("world", "dashboard")  # installed beside `swarm`, under names that others have too
HOME: Final = Path(__file__).parents[1]


def check(needed: Iterable[str] = LIBRARIES) -> None:
    """Check that the libraries that are needed are installed and that nothing hides a part of this package.

    Raises:
        ConfigError: one is missing, or another module comes before ours on Python's path.
    """
    for name in TOPS:
        spec = find_spec(name)
        found = Path(spec.origin) if spec is not None and spec.origin is not None else None
        if found is None or found.resolve() != (HOME / name / "__init__.py").resolve():
            raise ConfigError(
                f"{name}: expected {HOME / name}, a part of zenoh-swarm, got {found}, which is first on Python's path; "
                "rename that, or take its folder out of PYTHONPATH"
            )
    for library in needed:
        if find_spec(LIBRARIES[library]) is None:
            raise ConfigError(f"{library}: expected it with zenoh-swarm, found none; run `pip install {library}`")


def installed_libraries() -> list[str]:
    """Return the libraries that are installed of those that this package uses, those of its extras last."""
    known = {**LIBRARIES} | {name: module for extra in EXTRAS.values() for name, module in extra.items()}
    return [name for name, module in known.items() if find_spec(module) is not None]


def hint_for_extra(extra: str) -> str | None:
    """Return a sentence that says how to install an extra, or None if it is installed."""
    missing = any(find_spec(name) is None for name in EXTRAS[extra].values())
    return f"{NAMES.get(extra, extra)} is not installed: pip install 'zenoh-swarm[{extra}]'" if missing else None


if __name__ == "__main__":  # what the image of a robot installs
    print("\n".join(ROBOT))
