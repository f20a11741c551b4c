"""The command `swarm drill`: it injects each fault of a table into a live fleet and says what holds afterwards."""

import argparse
import json
from pathlib import Path

from swarm.cli.argument_parser import Commands, Parser
from swarm.errors import ConfigError


def drill(options: argparse.Namespace) -> int:
    """Run the rows of the drill; return 1 if one fails."""
    from swarm.launch.drill.run import as_json, run_drills, select_rows

    rows = select_rows(options.row)
    if options.list:
        print("\n".join(f"{row.name:17}{row.fault}" for row in rows))
        return 0
    if not 1 <= options.repeat <= 1000:
        raise ConfigError(f"--repeat: expected 1 to 1000, got {options.repeat}")
    if options.keep is not None:
        try:
            options.keep.mkdir(parents=True, exist_ok=True)
        except OSError as fault:
            why = fault.strerror or fault
            raise ConfigError(f"--keep: expected a folder that can be made, got {options.keep}: {why}") from None
    outcomes = []
    for outcome in run_drills(rows, options.repeat, options.keep):
        outcomes.append(outcome)
        if not options.json:
            print(outcome.line(), flush=True)
    count = {kind: sum(one.outcome == kind for one in outcomes) for kind in ("pass", "fail", "skip")}
    if options.json:
        print(json.dumps(count | {"rows": [as_json(one) for one in outcomes]}, indent=1))
    else:
        seconds = sum(one.seconds for one in outcomes)
        print(f"{count['pass']} passed, {count['fail']} failed, {count['skip']} skipped in {seconds:.0f} s")
    return 1 if count["fail"] else 0


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line."""
    one = commands.add_parser("drill", help="inject faults into live fleets and check what holds afterwards")
    one.add_argument("--list", action="store_true", help="print the faults and end")
    one.add_argument("--row", action="append", default=[], metavar="NAME", help="only this fault; may be repeated")
    one.add_argument("--repeat", type=int, default=1, metavar="N", help="run each fault N times, 1 by default")
    one.add_argument("--keep", type=Path, metavar="DIR", help="keep scenario, output and report of what fails in DIR")
    one.add_argument("--json", action="store_true")
    one.set_defaults(command=drill)
