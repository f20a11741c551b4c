"""A release: ``make release`` builds all of it but the upload, ``make release VERSION=0.2.0`` names it first.

With a version, pyproject.toml and CHANGELOG.md get it, as a commit with a tag. ``--home`` writes where the project is
published into pyproject.toml, once it is known. What is built lies in build/release: the wheel and the
source, checked by twine, the site, and the checksums of all; images are built if docker or buildah answers.
"""

import argparse
import hashlib
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
OUT: Final = ROOT / "build" / "release"
VERSION: Final = re.compile(r"\d+\.\d+\.\d+(?:(?:a|b|rc)\d+)?")
UNRELEASED: Final = "## Unreleased\n"
SUMS: Final = "SHA256SUMS"


class ReleaseError(Exception):
    """What stands in the way of a release."""


def main(arguments: list[str] | None = None) -> int:
    """Build a release; return 0, or 2 with a sentence that says what is in the way."""
    parser = argparse.ArgumentParser(prog="make release", description=__doc__)
    parser.add_argument("version", nargs="?", default="", help="such as 0.2.0; without one, that of pyproject.toml")
    parser.add_argument("--home", default="", metavar="URL", help="where the project is, https://HOST/OWNER/PROJECT")
    parser.add_argument("--no-images", action="store_true", help="build no images")
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args(arguments)
    try:
        if options.version:
            name(ROOT, options.version, options.home)
        build(ROOT, options.out, images=not options.no_images)
    except ReleaseError as fault:
        print(f"release: {fault}", file=sys.stderr)
        return 2
    return 0


def name(root: Path, version: str, home: str = "") -> None:
    """Set the project's version, and its addresses if a ``home`` is given: in its files, with a commit and a tag.

    Raises:
        ReleaseError: it is no version, there is nothing new, or the folder has changes that are not committed.
    """
    if VERSION.fullmatch(version) is None:
        raise ReleaseError(f"expected a version such as 0.2.0 or 0.2.0rc1, got {version!r}")
    if _said(["git", "status", "--porcelain"], root):
        raise ReleaseError("expected a clean checkout, got changes that are not committed; commit them first")
    if _said(["git", "tag", "--list", f"v{version}"], root):
        raise ReleaseError(f"expected a new version, got {version}, which has a tag; choose a higher one")
    settings, changes = root / "pyproject.toml", root / "CHANGELOG.md"
    text = changes.read_text(encoding="utf-8")
    text = dated(text, version, datetime.now(UTC).date().isoformat())
    old = settings.read_text(encoding="utf-8")
    new = re.sub(r'(?m)^version = ".*"$', f'version = "{version}"', old, count=1)
    new = addressed(new, home.rstrip("/")) if home else new
    changes.write_text(text, encoding="utf-8")
    settings.write_text(new, encoding="utf-8")
    _done(["git", "commit", "--quiet", "--all", "--message", f"Release {version}"], root)
    _done(["git", "tag", "--annotate", "--message", f"Release {version}", f"v{version}"], root)


def dated(changes: str, version: str, day: str) -> str:
    r"""Return a changelog in which what was unreleased is a version of a day, below an empty section.

    Raises:
        ReleaseError: nothing is unreleased.

    >>> print(dated("# Changelog\n\n## Unreleased\n\n- New.\n", "0.2.0", "2026-11-30"))
    # Changelog
    <BLANKLINE>
    ## Unreleased
    <BLANKLINE>
    ## 0.2.0 - 2026-11-30
    <BLANKLINE>
    - New.
    <BLANKLINE>
    """
    before, found, after = changes.partition(UNRELEASED)
    if not found or not after.split("\n## ")[0].strip():
        raise ReleaseError("CHANGELOG.md: expected something under `## Unreleased`, got nothing; say what is new")
    return f"{before}{UNRELEASED}\n## {version} - {day}\n{after}"


def addressed(settings: str, home: str) -> str:
    r"""Return pyproject.toml with the project's addresses, in place of those that it has.

    Raises:
        ReleaseError: the home is no address.

    >>> print(addressed("[project]\n\n[project.scripts]\n", "https://example.org/swarm"), end="")
    [project]
    <BLANKLINE>
    [project.urls]
    Homepage = "https://example.org/swarm"
    Issues = "https://example.org/swarm/issues"
    Changelog = "https://example.org/swarm/blob/main/CHANGELOG.md"
    <BLANKLINE>
    [project.scripts]
    """
    if re.fullmatch(r"https://[\w.-]+/[\w./-]+", home) is None:
        raise ReleaseError(f"--home: expected https://HOST/OWNER/PROJECT, got {home!r}")
    rest = re.sub(r"(?ms)^\[project\.urls\]\n.*?\n\n", "", settings)
    pages = {"Homepage": home, "Issues": f"{home}/issues", "Changelog": f"{home}/blob/main/CHANGELOG.md"}
    table = "[project.urls]\n" + "".join(f'{page} = "{place}"\n' for page, place in pages.items())
    return rest.replace("[project.scripts]", f"{table}\n[project.scripts]", 1)


def build(root: Path, out: Path, *, images: bool) -> None:
    """Build the wheel, the source and the site into a new folder, with a file of checksums, and the images.

    Raises:
        ReleaseError: a part cannot be built.
    """
    version = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    _done([sys.executable, "-m", "build", "--no-isolation", "--outdir", str(out), "."], root)
    _done([sys.executable, "-m", "twine", "check", "--strict", *map(str, sorted(out.iterdir()))], root)
    site = out / "site"
    _done([sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(site)], root)
    with tarfile.open(out / f"zenoh-swarm-{version}-site.tar.gz", "w:gz") as packed:
        packed.add(site, arcname=f"zenoh-swarm-{version}-site")
    shutil.rmtree(site)
    engine = next(filter(_answers, ("docker", "buildah")), None) if images else None
    if images and engine is None:
        print("no images: neither docker nor buildah answers here")
    if engine is not None:
        _done(["make", "images"], root)
        for role in ("robot", "world", "dashboard"):
            _done([engine, "tag", f"zenoh-swarm-{role}", f"zenoh-swarm-{role}:{version}"], root)
            print(f"image zenoh-swarm-{role}:{version}")
    files = sorted(path for path in out.iterdir())
    sums = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files]
    (out / SUMS).write_text("".join(sums), encoding="ascii")
    print("".join(f"{path.stat().st_size / 1e6:8.1f} MB  {path}\n" for path in files), end="")


def _answers(engine: str) -> bool:
    """Return True if an engine is installed, and its daemon runs if it has one."""
    return (
        shutil.which(engine) is not None
        and subprocess.run([engine, "info"], capture_output=True, check=False).returncode == 0
    )


def _said(command: list[str], root: Path) -> str:
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    if done.returncode:
        raise ReleaseError(f"{' '.join(command)}: {done.stderr.strip() or done.stdout.strip()[-2000:]}")
    return done.stdout.strip()


def _done(command: list[str], root: Path) -> None:
    _said(command, root)


if __name__ == "__main__":
    raise SystemExit(main())
