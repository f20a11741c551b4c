"""The hooks of ``mkdocs.yml``: what the site has beside the pages of this folder, and links that lead out of it.

The README is the site's first page and CHANGELOG.md its last one. A file of the project to which a page links is in the
site as it is, below ``source/``. The API pages are the docstrings of every room.
"""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from posixpath import normpath, relpath
from typing import Any, Final

from griffe import Extension, Object

ROOT: Final = Path(__file__).parents[1]
PROJECT: Final = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
LINK: Final = re.compile(r"(?<=\]\()(?![a-z]+:|#|/)([^)#\s]+)(#[^)\s]*)?(?=\))")
DOCTEST: Final = re.compile(r"^>>> .*(?:\n.+)*", re.MULTILINE)  # up to an empty line
TURNED: Final = {  # pages that are not in docs/
    "README.md": "index.md",
    "CHANGELOG.md": "changelog.md",
    "schemas/vectors/README.md": "test-vectors.md",
}
DECISIONS: Final = "decisions/index.md"


class Doctests(Extension):
    """Shows the doctests of a docstring as code."""

    def on_object(self, *, obj: Object, **_: Any) -> None:  # noqa: ANN401, griffe says no more
        """Put a fence around each doctest."""
        if obj.docstring is not None:
            obj.docstring.value = DOCTEST.sub(r"```pycon\n\g<0>\n```", obj.docstring.value)


def slug(text: str, separator: str) -> str:
    """Return the anchor of a heading, as GitHub makes it.

    >>> slug("`python -m benchmarks.why`", "-")
    'python--m-benchmarkswhy'
    """
    return re.sub(r"[^\w\s-]", "", text.strip().lower()).replace(" ", separator)


def on_config(config: Any) -> Any:  # noqa: ANN401, mkdocs has no types
    """Name the version on every page, and list the decisions and the rooms in the navigation."""
    config.mdx_configs["toc"]["slugify"] = slug
    config.copyright = f"zenoh-swarm {PROJECT['project']['version']}"
    decisions = sorted(path.name for path in (ROOT / "docs" / "decisions").glob("*.md"))
    listed = {
        "Decisions": [DECISIONS, *(f"decisions/{name}" for name in decisions)],
        "API": [f"api/{room}.md" for room in rooms()],
    }
    config.nav = [
        {title: listed.get(title, pages) for title, pages in entry.items()} if isinstance(entry, dict) else entry
        for entry in config.nav
    ]
    return config


def on_files(files: Any, config: Any) -> Any:  # noqa: ANN401
    """Add the pages that are made here, and the files of the project to which pages link."""
    from mkdocs.structure.files import File

    made = dict(pages())
    for uri, text in made.items():
        files.append(File.generated(config, uri, content=text))
    texts = {file.src_uri: made.get(file.src_uri) or file.content_string for file in files.documentation_pages()}
    for path in sorted({path for uri, text in texts.items() for path in outside(uri, text)}):
        files.append(File.generated(config, f"source/{path}", abs_src_path=str(ROOT / path)))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:  # noqa: ANN401
    """Return a page with the links that lead out of this folder turned to where the site has those files."""
    return turned(page.file.src_uri, markdown)


def turned(uri: str, text: str) -> str:
    """Return a page's text with each link as the site has it; ``uri`` is the page in the site.

    >>> turned("wire.md", "[a](../examples/watch.py), [b](box.md#keys), [c](../README.md)")
    '[a](source/examples/watch.py), [b](box.md#keys), [c](index.md)'
    """

    def link(match: re.Match[str]) -> str:
        goal = place(uri, match[1])
        return match[0] if goal is None else relpath(goal, str(PurePosixPath(uri).parent)) + (match[2] or "")

    return LINK.sub(link, text)


def place(uri: str, link: str) -> str | None:
    """Return where the site has what a page links to; None: where the link says."""
    home = {page: name for name, page in TURNED.items()}.get(uri, f"docs/{uri}")
    path = normpath(str(PurePosixPath(home).parent / link))
    if path in TURNED:
        return TURNED[path]
    if path == "docs/decisions":
        return DECISIONS
    if path.startswith("docs/") and not path.endswith(".py"):
        return path.removeprefix("docs/")
    return f"source/{path}" if (ROOT / path).is_file() else None


def outside(uri: str, text: str) -> Iterator[str]:
    """Yield the files of the project, outside this folder, to which a page links."""
    for match in LINK.finditer(text):
        goal = place(uri, match[1])
        if goal is not None and goal.startswith("source/"):
            yield goal.removeprefix("source/")


def rooms() -> list[str]:
    """Return the packages of the project, without those that have only data."""
    found: list[str] = PROJECT["tool"]["setuptools"]["packages"]
    return sorted(room for room in found if (ROOT / room.replace(".", "/") / "__init__.py").is_file())


def pages() -> Iterator[tuple[str, str]]:
    """Yield the pages that are made here: where they are in the site, and their text."""
    for name, uri in TURNED.items():
        yield uri, (ROOT / name).read_text(encoding="utf-8")
    decisions = sorted((ROOT / "docs" / "decisions").glob("*.md"))
    titles = [(path.name, path.read_text(encoding="utf-8").splitlines()[0].removeprefix("# ")) for path in decisions]
    yield DECISIONS, "# Decisions\n\n" + "".join(f"* [{title}]({name})\n" for name, title in titles)
    for room in rooms():
        modules = [path.stem for path in sorted((ROOT / room.replace(".", "/")).glob("*.py"))]
        names = [room, *(f"{room}.{name}" for name in modules if not name.startswith("__"))]
        yield f"api/{room}.md", f"# {room}\n\n" + "".join(f"::: {name}\n\n" for name in names)
