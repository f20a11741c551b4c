"""Runs all benchmarks in turn: ``python -m benchmarks [NAME ...] [--write] [-- ARGUMENT ...]``.

Each benchmark runs in its own process, so that none warms up another. ``--write`` puts their output, the versions and
the commit into ``docs/benchmarks.md``. Arguments after ``--`` are passed to each named benchmark, whose output has a
section of its own then.
"""

import argparse
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Final

from benchmarks.measure import machine

ROOT: Final = Path(__file__).parents[1]
PAGE: Final = ROOT / "docs" / "benchmarks.md"
NO_BENCHMARK: Final = ("__init__", "__main__", "asked", "measure")  # shared
VERSIONS: Final = ("eclipse-zenoh", "numpy", "numba", "pymunk", "msgspec", "msgpack", "rerun-sdk")


def names() -> list[str]:
    """Return the names of the benchmarks."""
    stems = (path.stem for path in (ROOT / "benchmarks").glob("*.py"))
    return sorted(stem for stem in stems if stem not in NO_BENCHMARK)


def summary(name: str) -> str:
    """Return the first line of a benchmark's docstring."""
    text = (ROOT / "benchmarks" / f"{name}.py").read_text(encoding="utf-8")
    return text.split('"""')[1].split("\n")[0].split(": ``python")[0].rstrip(".") + "."


def run(name: str, arguments: list[str]) -> tuple[int, str]:
    """Run one benchmark, show its output as it comes, and return its exit status and output."""
    command = [sys.executable, "-m", f"benchmarks.{name}", *arguments]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    lines = []
    for line in process.stdout:
        print(line, end="", flush=True)
        lines.append(line)
    return process.wait(), "".join(lines)


def stamp() -> str:
    """Return the line that states the present commit and its date."""
    command = ["git", "log", "-1", "--format=Measured at commit %h (%cs)."]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False).stdout.strip()


def section(name: str, stamped: str, text: str) -> str:
    """Return the text of a section, without its heading."""
    return "\n\n".join(part for part in (summary(name), stamped, text.strip()) if part)


def page(fresh: dict[str, str]) -> str:
    """Return the page: the sections made now, and those kept from before."""
    versions = ", ".join(f"{name} {version(name)}" for name in VERSIONS)
    parts = [
        "# Benchmarks",
        "Made by `python -m benchmarks --write`; nothing here is typed by hand.",
        f"{machine()}; {versions}. The load says what else the machine did meanwhile: times under load are longer.",
    ]
    for name, text in sorted((kept() | fresh).items()):
        parts += [f"## `python -m benchmarks.{name}`", text]
    return "\n\n".join(parts) + "\n"


def divided(arguments: list[str]) -> tuple[list[str], list[str]]:
    """Return the arguments before ``--``, and those after it, which are for the benchmarks."""
    end = arguments.index("--") if "--" in arguments else len(arguments)
    return arguments[:end], arguments[end + 1 :]


def kept() -> dict[str, str]:
    """Return the sections of the page by name and arguments; what does not run again keeps its section."""
    if not PAGE.exists():
        return {}
    _, *sections = re.split(r"^## `python -m benchmarks\.([^`]+)`\n", PAGE.read_text(encoding="utf-8"), flags=re.M)
    found = zip(sections[::2], sections[1::2], strict=True)
    return {called: text.strip() for called, text in found if called.split()[0] in names()}


def main() -> int:
    """Run the benchmarks; return 1 if one exits with another status than 0.

    ``fuzzy``, ``planner`` and ``survival`` exit so if they miss a target; the tables of the others name it beside what
    was measured.
    """
    parser = argparse.ArgumentParser(description="Run benchmarks.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"some of {', '.join(names())}; default: all")
    parser.add_argument("--write", action="store_true", help="write docs/benchmarks.md")
    own, passed_on = divided(sys.argv[1:])
    options = parser.parse_args(own)
    if unknown := set(options.names) - set(names()):
        parser.error(f"expected some of {', '.join(names())}, got {', '.join(sorted(unknown))}")
    sections, failed = {}, []
    for name in options.names or names():
        print(f"\n== {name}", flush=True)
        stamped = stamp()
        status, printed = run(name, passed_on)
        sections[" ".join((name, *passed_on))] = section(name, stamped, printed)
        failed += [name] if status else []
        if options.write:  # after each benchmark, so that an interrupted run keeps its finished sections
            PAGE.write_text(page(sections), encoding="utf-8")
    if failed:
        print(f"exited with another status than 0: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
