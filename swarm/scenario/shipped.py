"""The scenarios that come with the project: found by name, from any folder."""

from itertools import takewhile
from pathlib import Path
from typing import Final

from swarm import errors

PACKAGE: Final = Path(errors.__file__).parent
# an installed package holds them; in a checkout they lie beside it
FOLDER: Final = PACKAGE / "scenarios" if (PACKAGE / "scenarios").is_dir() else PACKAGE.parent / "scenarios"


def shipped() -> dict[str, str]:
    """Return the name of each with the first sentence of the comment that its file begins with."""
    return {path.stem: _about(path.read_text(encoding="utf-8")) for path in sorted(FOLDER.glob("*.yaml"))}


def _about(text: str) -> str:
    lines = takewhile(lambda line: line.startswith("#"), text.splitlines())
    return " ".join(line.lstrip("# ") for line in lines).split(". ")[0].rstrip(".")


def found(path: Path) -> Path:
    """Return a scenario's file: the path itself where there is one, else the shipped scenario of that name.

    >>> found(Path("paper")).name, found(Path("no_such.yaml")).name
    ('paper.yaml', 'no_such.yaml')
    """
    if not path.exists() and path.parent == Path() and path.suffix in {"", ".yaml"} and path.stem in shipped():
        return FOLDER / f"{path.stem}.yaml"
    return path
