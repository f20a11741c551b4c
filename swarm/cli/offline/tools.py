"""Commands that need no fleet: explain the controller, plan a path, print schemas, run the benchmarks of a checkout."""

import argparse
import json
import subprocess
import sys
from math import isfinite
from pathlib import Path
from typing import Final

from swarm.cli.argument_parser import Commands, Parser, point
from swarm.errors import ConfigError, suggest
from swarm.maps.occupancy import OccupancyMap

CHECKOUT: Final = Path(__file__).parents[3]  # the folder of the package: in a checkout, the benchmarks are there too


def explain(options: argparse.Namespace) -> int:
    """Print the fuzzy controller's output for one reading, rule by rule."""
    from swarm.kernels import announce_compilation

    announce_compilation()
    from swarm.fuzzy.explain import explain as explanation

    inputs = (options.left, options.front, options.right, options.heading)
    print(explanation(*inputs, profile=options.profile, as_json=options.json, surface_png=options.surface))
    return 0


def plan(options: argparse.Namespace) -> int:
    """Plan one path on a map, or every row of a benchmark file."""
    from swarm.kernels import announce_compilation

    announce_compilation()
    from swarm.planning.solve import solve_one, solve_scen

    if options.scen is not None:
        if options.start is not None or options.goal is not None:
            raise ConfigError("plan: expected either --scen or --from and --to, got both; leave one out")
        numbers = solve_scen(options.map, options.scen)
        print(json.dumps(numbers) if options.json else "\n".join(f"{key}: {value}" for key, value in numbers.items()))
        return 0 if not numbers["mismatches"] else 1
    if options.start is None or options.goal is None:
        raise ConfigError("plan: expected --from X,Y and --to X,Y, or --scen FILE.scen; give them")
    answer = solve_one(_map(options.map), options.start, options.goal, radius=options.radius)
    print(json.dumps(answer.numbers) if options.json else answer.drawing)
    return 0 if answer.numbers["found"] else 1


def schema(options: argparse.Namespace) -> int:
    """Print the JSON Schema of a message, or the names of all messages with their first lines."""
    from swarm.messages.schema import kinds, schema_of

    known = kinds()
    if options.message is None:
        widest = max(map(len, known))
        for name, kind in known.items():
            print(f"{name:<{widest}}  {(kind.__doc__ or '').splitlines()[0]}")
        return 0
    if options.message not in known:
        raise ConfigError(
            f"schema: expected the name of a message, got {options.message!r}; {suggest(options.message, known)}"
        )
    print(schema_of(known[options.message]), end="")
    return 0


def bench(options: argparse.Namespace) -> int:
    """Run benchmarks of the checkout."""
    if not (CHECKOUT / "benchmarks" / "measure.py").is_file():
        raise ConfigError(
            f"bench: expected the folder benchmarks/ in {CHECKOUT}, found none: an installation leaves it out; "
            "get the project's repository, install that with `pip install -e .[dev]` and run the command again"
        )
    command = [sys.executable, "-m", "benchmarks", *(["--write"] if options.write else []), *options.names]
    return subprocess.run(command, cwd=CHECKOUT, check=False).returncode


def _map(path: Path) -> OccupancyMap:
    """Load a map file, or the map of a scenario."""
    from swarm.maps.files import read_file
    from swarm.maps.load import load_map
    from swarm.scenario.load import SIZE_LIMIT, load
    from swarm.scenario.shipped_scenarios import find_scenario

    path = find_scenario(path)
    if path.suffix in {".yaml", ".yml"} and path.is_file() and b"targets:" in read_file(path, SIZE_LIMIT):
        return load(path).map
    return load_map(path)


def _radius(text: str) -> float:
    try:
        radius = float(text)
    except ValueError:
        radius = float("nan")
    if not (isfinite(radius) and radius >= 0):
        raise ConfigError(f"--radius: expected a length of 0 m or more, got {text!r}; 0.2 is usual")
    return radius


def add(commands: "Commands[Parser]") -> None:
    """Add these commands to the command line."""
    one = commands.add_parser("explain", help="print the fuzzy controller's output for a reading, rule by rule")
    for name in ("left", "front", "right"):
        one.add_argument(name, type=float, help="m, free distance")
    one.add_argument("heading", type=float, help="degrees to the target, right is positive (the paper's sign)")
    one.add_argument("--profile", default="paper", help="a built-in profile or a profile file")
    one.add_argument("--json", action="store_true")
    one.add_argument("--surface", type=Path, metavar="FILE.png", help="draw the control surface through this reading")
    one.set_defaults(command=explain)

    one = commands.add_parser("plan", help="plan a path on a map, or check all rows of a benchmark file")
    one.add_argument("map", type=Path, help="ROS .yaml, MovingAI .map or a scenario")
    one.add_argument("--from", dest="start", type=point, metavar="X,Y", help="m")
    one.add_argument("--to", dest="goal", type=point, metavar="X,Y", help="m")
    one.add_argument("--radius", type=_radius, default=0.2, metavar="M", help="radius of the robot")
    one.add_argument("--scen", type=Path, metavar="FILE.scen", help="benchmark; lengths in cells, no corner cutting")
    one.add_argument("--json", action="store_true")
    one.set_defaults(command=plan)

    one = commands.add_parser("schema", help="print the JSON Schema of a message of the wire, or list them")
    one.add_argument("message", nargs="?", metavar="MESSAGE", help="such as Sense; by default all names are listed")
    one.set_defaults(command=schema)

    one = commands.add_parser("bench", help="run the benchmarks of a checkout")
    one.add_argument("--write", action="store_true", help="write docs/benchmarks.md")
    text = "names of benchmarks, by default all; what stands after -- goes to each of them"
    one.add_argument("names", nargs=argparse.REMAINDER, metavar="NAME ... [-- ARGUMENT ...]", help=text)
    one.set_defaults(command=bench)
