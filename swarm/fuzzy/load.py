"""Finds and reads a profile: a built-in one, or a YAML file of the user."""

from functools import lru_cache
from pathlib import Path

import yaml

from swarm.errors import ConfigError, suggest
from swarm.fuzzy.profile import Profile

PROFILES = Path(__file__).parent / "profiles"
LARGEST_FILE = 256 * 1024  # bytes; the paper's profile has 4 KiB


class _ProfileLoader(yaml.SafeLoader):
    """SafeLoader that refuses a key written twice; PyYAML would silently keep the last one."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[object, object]:
        """Construct a mapping whose keys are all different."""
        seen = set()
        for key_node, _ in node.value:
            if isinstance(key_node, yaml.ScalarNode) and key_node.value in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {key_node.value!r} appears twice", key_node.start_mark
                )
            seen.add(key_node.value if isinstance(key_node, yaml.ScalarNode) else id(key_node))
        return super().construct_mapping(node, deep)


def built_in_profiles() -> tuple[str, ...]:
    """Return the names of the profiles that come with the project."""
    return tuple(sorted(path.stem for path in PROFILES.glob("*.yaml")))


def load_profile(name_or_path: str | Path, base: Path | None = None) -> Profile:
    """Load a profile by its name ("paper", "wall_following"), or from a file whose name ends in .yaml or .yml.

    A relative path starts at ``base``, or at the working directory if ``base`` is None. With a ``base`` the file must
    be within it, symbolic links followed, so that a foreign scenario can read only its own files.

    Raises:
        ConfigError: the name or file does not exist, or is not a valid profile.
    """
    text = str(name_or_path)
    if Path(text).suffix.lower() not in {".yaml", ".yml"}:
        if text not in built_in_profiles():
            raise ConfigError(
                f"controller {text!r}: expected a profile's name or a file ending in .yaml; "
                f"{suggest(text, built_in_profiles())}"
            )
        return _read(PROFILES / f"{text}.yaml", f"{text}.yaml")
    if "\0" in text:
        raise ConfigError(f"controller {text!r}: expected a file's path, got one with a NUL character")
    path = ((base or Path()) / text).resolve()
    if base is not None and not path.is_relative_to(base.resolve()):
        raise ConfigError(f"controller {text!r}: expected a file within {base}, got {path}; copy it there")
    return _read(path, text)


def _read(path: Path, where: str) -> Profile:
    try:
        if not path.is_file():
            raise ConfigError(f"{where}: no such file ({path}); built-in profiles: {', '.join(built_in_profiles())}")
        if path.stat().st_size > LARGEST_FILE:
            raise ConfigError(f"{where}: expected at most {LARGEST_FILE} bytes, got {path.stat().st_size}")
        source = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{where}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{where}: expected UTF-8 text, got the byte {error.object[error.start]:#04x}") from error
    return _parse_profile(source, where)


@lru_cache(maxsize=16)
def _parse_profile(source: str, where: str) -> Profile:
    """Read a profile's text; the result is cached, since thousands of short runs read the same profile."""
    try:
        document = yaml.load(source, _ProfileLoader)
    except (yaml.YAMLError, ValueError, TypeError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise ConfigError(f"{where}: expected YAML as in profiles/paper.yaml: {reason}") from error
    if document is None:
        raise ConfigError(f"{where}: the file is empty; copy profiles/paper.yaml and edit it")
    return Profile.from_builtins(document, where)
