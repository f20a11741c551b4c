"""Every benchmark, one after the other: ``python -m benchmarks [NAME ...] [--write]``.

Each runs as a process of its own, so that none warms another up. ``--write`` puts what they printed, with the versions
they ran on, into ``docs/benchmarks.md``.
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
NO_BENCHMARK: Final = ("__init__", "__main__", "measure", "fuzz_maps", "mutation")  # shared, or a search for faults
VERSIONS: Final = ("eclipse-zenoh", "numpy", "numba", "pymunk", "msgspec", "msgpack", "rerun-sdk")


def names() -> list[str]:
    """List the modules that are benchmarks; those ending in ``_peer`` are run by others."""
    stems = (path.stem for path in (ROOT / "benchmarks").glob("*.py"))
    return sorted(stem for stem in stems if stem not in NO_BENCHMARK and not stem.endswith("_peer"))


def summary(name: str) -> str:
    """Take the first line of a benchmark's docstring."""
    text = (ROOT / "benchmarks" / f"{name}.py").read_text(encoding="utf-8")
    return text.split('"""')[1].split("\n")[0].split(": ``python")[0].rstrip(".") + "."


def run(name: str) -> tuple[int, str]:
    """Run one and give its exit status and what it printed, which is shown as it comes."""
    process = subprocess.Popen(
        [sys.executable, "-m", f"benchmarks.{name}"], cwd=ROOT, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    lines = []
    for line in process.stdout:
        print(line, end="", flush=True)
        lines.append(line)
    return process.wait(), "".join(lines)


def page(printed: dict[str, str]) -> str:
    """Put the page together."""
    versions = ", ".join(f"{name} {version(name)}" for name in VERSIONS)
    parts = [
        "# Benchmarks",
        "Made by `python -m benchmarks --write`; nothing here is typed by hand.",
        f"{machine()}; {versions}. The load says what else the machine did meanwhile: times under load are longer.",
    ]
    sections = kept() | {name: f"{summary(name)}\n\n{text.strip()}" for name, text in printed.items()}
    for name, text in sorted(sections.items()):
        parts += [f"## `python -m benchmarks.{name}`", text]
    return "\n\n".join(parts) + "\n"


def kept() -> dict[str, str]:
    """Read the sections that stand: a benchmark that is not run again keeps its own, with the load it ran under."""
    if not PAGE.exists():
        return {}
    _, *sections = re.split(r"^## `python -m benchmarks\.(\w+)`\n", PAGE.read_text(encoding="utf-8"), flags=re.M)
    return {name: text.strip() for name, text in zip(sections[::2], sections[1::2], strict=True) if name in names()}


def main() -> int:
    """Run them; 1 when one of them failed or missed what it has to reach."""
    parser = argparse.ArgumentParser(description="Run benchmarks.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(names())}; by default all")
    parser.add_argument("--write", action="store_true", help="write docs/benchmarks.md")
    options = parser.parse_args()
    if unknown := set(options.names) - set(names()):
        parser.error(f"expected some of {', '.join(names())}, got {', '.join(sorted(unknown))}")
    printed, failed = {}, []
    for name in options.names or names():
        print(f"\n== {name}", flush=True)
        status, printed[name] = run(name)
        failed += [name] if status else []
        if options.write:  # after each: what an interrupted run has printed stays
            PAGE.write_text(page(printed), encoding="utf-8")
    if failed:
        print(f"not as it has to be: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
