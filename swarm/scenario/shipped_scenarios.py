"""The scenarios that come with the project; they are found by name from any folder."""

from itertools import takewhile
from pathlib import Path
from typing import Final

PACKAGE: Final = Path(__file__).parents[1]
# inside an installed package; beside the package in a checkout
FOLDER: Final = PACKAGE / "scenarios" if (PACKAGE / "scenarios").is_dir() else PACKAGE.parent / "scenarios"


def shipped_scenarios() -> dict[str, str]:
    """Return the name of each shipped scenario with the first sentence of its file's first comment."""
    return {path.stem: _first_sentence(path.read_text(encoding="utf-8")) for path in sorted(FOLDER.glob("*.yaml"))}


def _first_sentence(text: str) -> str:
    lines = takewhile(lambda line: line.startswith("#"), text.splitlines())
    return " ".join(line.lstrip("# ") for line in lines).split(". ")[0].rstrip(".")


def find_scenario(path: Path) -> Path:
    """Return the file of the shipped scenario that ``path`` names if no such path exists, else ``path``.

    >>> find_scenario(Path("paper")).name, find_scenario(Path("no_such.yaml")).name
    ('paper.yaml', 'no_such.yaml')
    """
    if (
        not path.exists()
        and path.parent == Path()
        and path.suffix in {"", ".yaml"}
        and path.stem in shipped_scenarios()
    ):
        return file_of(path.stem)
    return path


def file_of(name: str) -> Path:
    """Return the file of the shipped scenario of that name."""
    return FOLDER / f"{name}.yaml"
