"""Commands that run a whole fleet on this machine, or one process of a fleet."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from swarm.cli.argument_parser import Commands, Parser, endpoint, pace, robots_of, secure
from swarm.errors import ConfigError
from swarm.kinds import format_mix
from swarm.secure.names import ROUTER, WORLD
from swarm.settings import BAG, TAPE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from swarm.scenario.source import Source


def run(options: argparse.Namespace) -> int:
    """Launch a whole fleet on this machine; without a scenario, list those that come with the project."""
    from swarm.kernels import announce_compilation
    from swarm.launch.supervise.fleet import call_off, warm_up
    from swarm.scenario.shipped_scenarios import find_scenario, shipped_scenarios
    from swarm.scenario.source import Source

    if options.scenario is None:
        print("swarm run SCENARIO: a scenario file, or one of these:")
        print("\n".join(f"  {name:15}{about}" for name, about in shipped_scenarios().items()))
        return 0
    _check_launch(options)
    if options.scen is not None and isinstance(options.robots, dict):
        raise ConfigError(f"--robots: expected a number with --scen, got {format_mix(options.robots)}; leave out kinds")
    source = Source(find_scenario(options.scenario), options.scen, options.robots, options.serve)
    if source.file.is_file():
        announce_compilation()
        warm_up(source, secure=options.secure is not None)
    try:
        return _launch_fleet(options, source)
    except ConfigError:
        call_off()
        raise


def _launch_fleet(options: argparse.Namespace, source: "Source") -> int:
    """Read the scenario and launch the fleet, while the fork server gets ready."""
    from swarm.launch.options import Options
    from swarm.launch.proxy import Delay
    from swarm.launch.run import run as launch

    scenario, robots = source.read().with_robots(options.robots)
    return launch(
        Options(
            scenario=scenario,
            robots=robots,
            robots_per_process=_at_least_one("--robots-per-process", options.robots_per_process),
            asked_seed=options.seed,
            pace=pace(options.pace),
            asked_limit=options.limit,
            wait=options.wait,
            dashboard=options.dashboard,
            rules=options.rules,
            record=_record_file(options.record, ".rrd"),
            tape=_record_file(options.record, TAPE),
            bag=_record_file(options.record, BAG),
            report=options.report,
            port=options.port,
            fleet=options.fleet,
            secure=options.secure,
            outside=options.body,
            bridges=options.bridge,
            quiet=options.quiet,
            delay=None if options.delay is None else Delay.parse(options.delay),
        )
    )


def router(options: argparse.Namespace) -> int:
    """Run the router."""
    from swarm.bus.router import serve

    place = endpoint(options.listen, options.secure, ROUTER)
    others = [endpoint(text, options.secure, ROUTER) for text in options.join]
    far = [one for one in others if not one.is_local]
    option, open_to = ("--join", far[0]) if place.is_local and far else ("--listen", place)
    if options.secure is None and not open_to.is_local:
        if not options.insecure:
            raise ConfigError(
                f"{option}: expected an address of this machine only, such as 127.0.0.1, got {open_to.host}, where "
                "others could steer the robots; make keys with `swarm keys` and give --secure DIR, or add --insecure"
            )
        print(f"router: {open_to} is open: anybody who reaches it can steer the robots", file=sys.stderr, flush=True)
    if others and place.identity is not None and not place.identity.joins:
        raise ConfigError(
            f"--join: expected keys with which routers may join each other, got {options.secure}; "
            "make them with `swarm keys --several-routers`"
        )
    place = place.claim()
    joins = f", and joins {', '.join(map(str, others))}" if others else ""
    print(f"router: listening on {place}{joins}", flush=True)
    return serve(place, others)


def world(options: argparse.Namespace) -> int:
    """Run the world."""
    from swarm.kernels import announce_compilation

    announce_compilation()
    from swarm.launch.fleet_registry import default_fleet_name, tape_of
    from swarm.scenario.check import check
    from swarm.scenario.load import load
    from swarm.scenario.shipped_scenarios import find_scenario
    from world.host.process import run as run_world

    scenario = load(find_scenario(options.scenario), serve=options.serve)
    _check_given(options)
    scenario, robots = scenario.with_robots(options.robots)
    seed, limit = scenario.settings.seed if options.seed is None else options.seed, scenario.limit(options.limit)
    scenario = check(scenario, robots, seed).scenario
    if options.resume is not None and not options.resume.is_file():
        raise ConfigError(
            f"--resume {options.resume}: expected a snapshot, found none; begin a run with --snapshot FILE"
        )
    fleet = options.fleet or default_fleet_name(scenario.settings.name)
    print(f"fleet {fleet}", flush=True)
    try:
        tape = options.record or tape_of(fleet)
        print(f"tape {tape}", flush=True)
    except ConfigError as fault:  # there is no folder for it
        tape = None
        print(f"this run has no tape: {fault}; give --record FILE{TAPE}", flush=True)
    return run_world(
        endpoint(options.connect, options.secure, WORLD),
        fleet,
        scenario,
        robots,
        seed,
        pace(options.pace),
        limit,
        wait=options.wait,
        report_to=options.report,
        snapshot=options.resume or options.snapshot,
        outside=options.body,
        tape=tape,
        hand_over=(options.resume or options.snapshot) is not None,
    )


def robot(options: argparse.Namespace) -> int:
    """Run one robot, or more of them in this process."""
    from swarm.cli.fleet_lookup import await_fleet
    from swarm.kernels import announce_compilation

    announce_compilation()
    from swarm.robot.host.process import run as be_robots

    count = _at_least_one("--count", options.count)
    if options.id is not None and count > 1:
        raise ConfigError(f"--id: expected no name with --count {count}, got {options.id!r}; leave one of them out")
    if options.secure is not None and (options.id is None or count > 1):
        raise ConfigError(
            "--secure: expected one robot with --id, since a robot's keys are for its name only; "
            "start a process for each robot, such as `swarm robot --id r1`"
        )
    router = endpoint(options.connect, options.secure, options.id)
    fleet = options.fleet or await_fleet(router)
    return 0 if fleet is None else be_robots(router, fleet, [options.id] * count, once=options.once)


def _record_file(files: "Sequence[Path]", ending: str) -> Path | None:
    """Return the file of ``--record`` that has an ending; one that is no tape and no bag is the dashboard's.

    Raises:
        ConfigError: there are two.
    """
    found = [file for file in files if file.suffix == ending or (ending == ".rrd" and file.suffix not in {TAPE, BAG})]
    if len(found) > 1:
        raise ConfigError(f"--record: expected one file that ends in {ending}, got {', '.join(map(str, found))}")
    return found[0] if found else None


def _at_least_one(option: str, robots: int) -> int:
    if robots < 1:
        raise ConfigError(f"{option}: expected at least 1 robot, got {robots}")
    return robots


def _check_launch(options: argparse.Namespace) -> None:
    """Check what can be known without the scenario, before anything is read or started."""
    if not 0 <= options.port <= 65535:
        raise ConfigError(f"--port: expected 0 (a free one) to 65535, got {options.port}")
    _at_least_one("--robots-per-process", options.robots_per_process)
    pace(options.pace)
    _check_given(options)


def _check_given(options: argparse.Namespace) -> None:
    """Check the numbers of a run that the command line gives instead of the scenario."""
    if options.seed is not None and not 0 <= options.seed <= 2**53:
        raise ConfigError(f"--seed: expected 0 to 2**53, got {options.seed}")
    if options.limit is not None and not 0 < options.limit <= 1e6:
        raise ConfigError(f"--limit: expected seconds above 0, at most 1e6, got {options.limit:g}")


def add(commands: "Commands[Parser]") -> None:
    """Add these commands to the command line."""
    launch = commands.add_parser("run", help="launch a whole fleet on this machine")
    _of_a_launch(launch)
    launch.add_argument("--dashboard", default="auto", help="auto, viewer, web, box or off")
    launch.set_defaults(command=run)

    one = commands.add_parser("box", help="open the paper's box in the browser: draw a world, press go, watch")
    _of_a_launch(one)  # a fleet that stays and waits for `go`, on an empty floor
    one.set_defaults(command=run, scenario=Path("box"), dashboard="box", wait=True, serve=True)

    one = commands.add_parser("router", help="run the router of fleets")
    one.add_argument("--listen", metavar="ENDPOINT", help="tcp/127.0.0.1:7447 by default; tls/... with --secure")
    text = "another host's router: what each hears reaches the other, if anybody there wants it; may be repeated"
    one.add_argument("--join", action="append", default=[], metavar="ENDPOINT", help=text)
    one.add_argument("--insecure", action="store_true", help="let others than this machine connect without keys")
    secure(one)
    one.set_defaults(command=router)

    one = commands.add_parser("world", help="run the world of a fleet")
    one.add_argument("scenario", type=Path)
    _of_a_run(one)
    _of_a_process(one, "USER-SCENARIO")
    text = "save the run here each second; if told to stop, leave it there; if the file exists, the run in it goes on"
    saved = one.add_mutually_exclusive_group()
    saved.add_argument("--snapshot", type=Path, metavar="FILE", help=text)
    saved.add_argument("--resume", type=Path, metavar="FILE", help="go on with the run in this file, and save it there")
    text = "append the tape of the run to this file; by default to one in the folder of fleets, whose path is printed"
    one.add_argument("--record", type=Path, metavar=f"FILE{TAPE}", help=text)
    one.set_defaults(command=world)

    one = commands.add_parser("robot", help="run one robot of a fleet, or several in one process")
    one.add_argument("--id", help="its name, such as r1; by default the first free one")
    one.add_argument("--count", type=int, default=1, metavar="K", help="robots in this process, 1 by default")
    text = "end when the run is over, or 30 s after its world has gone; by default wait for the next run"
    one.add_argument("--once", action="store_true", help=text)
    _of_a_process(one, "the only one on the router; the robot waits for it")
    one.set_defaults(command=robot)


def _of_a_launch(parser: Parser) -> None:
    text = "a scenario .yaml, the name of one that comes with the project, or a MovingAI .map with --scen"
    parser.add_argument("scenario", type=Path, nargs="?", help=text)
    parser.add_argument("--scen", type=Path, metavar="FILE.scen", help="row i is robot i's start and target")
    _of_a_run(parser)
    text = "robots that share a process, 1 by default; if one of them fails, all of them are started again"
    parser.add_argument("--robots-per-process", type=int, default=1, metavar="K", help=text)
    text = "show the fleet to other software, too: what `swarm bridge` of that name does, on the fleet's own router"
    parser.add_argument("--bridge", choices=("ros2",), action="append", default=[], help=text)
    parser.add_argument("--quiet", action="store_true", help="print only addresses, trouble and the summary")
    parser.add_argument("--rules", metavar="ROBOT", help="robot whose fired rules are shown; by default the first")
    text = "save the run: FILE.swarm, its tape, for `swarm replay`; FILE.mcap, a bag of ROS 2; FILE.rrd, as it is drawn"
    files = "FILE.swarm|FILE.mcap|FILE.rrd"
    parser.add_argument("--record", type=Path, metavar=files, action="append", default=[], help=text)
    parser.add_argument("--port", type=int, default=0, help="port of the router; 0 picks a free one")
    text = "try a slow network: what robots send and receive is so much later, each way, give or take JITTER"
    parser.add_argument("--delay", metavar="MS[,JITTER]", help=text)
    parser.add_argument("--fleet", help="name of the fleet; by default USER-SCENARIO")
    secure(parser)


def _of_a_run(parser: Parser) -> None:
    text = "how many, or how many of each kind, such as scout=6,cart=2"
    parser.add_argument("--robots", type=robots_of, metavar="N", help=text)
    parser.add_argument("--seed", type=int, metavar="S")
    parser.add_argument("--pace", default="realtime", help="realtime, max (lockstep) or a factor")
    parser.add_argument("--limit", type=float, metavar="SECONDS", help="simulated time after which the run ends")
    parser.add_argument("--wait", action="store_true", help="wait for `swarm go` before the start")
    text = "a fleet that stays: who is done waits for `swarm order`; the run ends by `swarm stop`, or at --limit"
    parser.add_argument("--serve", action="store_true", help=text)
    text = "the body of this robot is outside: it reports on robot/NAME/body; may be repeated"
    parser.add_argument("--body", action="append", default=[], metavar="NAME", help=text)
    parser.add_argument("--report", type=Path, metavar="FILE.json")


def _of_a_process(parser: Parser, fleet: str) -> None:
    parser.add_argument("--connect", metavar="ENDPOINT", help="the router; tcp/127.0.0.1:7447 by default")
    parser.add_argument("--fleet", metavar="NAME", help=f"name of the fleet; by default {fleet}")
    secure(parser)
