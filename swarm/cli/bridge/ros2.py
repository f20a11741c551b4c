"""The command `swarm bridge ros2`: a running fleet as robots of ROS 2."""

import argparse

from swarm.cli.argument_parser import Commands, Parser, endpoint
from swarm.cli.bridge import clock
from swarm.cli.bridge.body import add_body_options, body, check
from swarm.cli.fleet_lookup import add_client_options, find_fleet
from swarm.errors import ConfigError
from swarm.installation import hint_for_extra
from swarm.secure.names import BRIDGE

DISTROS = ("jazzy", "kilted", "lyrical")
DIALECTS = ("rmw_zenoh", "ros2dds")
DOMAINS = range(233)  # ROS_DOMAIN_ID of all platforms: 0 to 232


def bridge(options: argparse.Namespace) -> int:
    """Show a fleet to ROS 2 until its run is over or we are told to stop."""
    check(options)
    if options.secure is not None and options.ros is None:
        raise ConfigError(
            "--secure: expected --ros ENDPOINT too, got none: the router of a fleet with keys serves no others; "
            "name the router of ROS"
        )
    if (lacks := hint_for_extra("ros2")) is not None:
        raise ConfigError(f"bridge ros2: {lacks}")
    if options.body is not None:
        return body(options)
    from swarm.bridge.ros2.process import run
    from swarm.bridge.ros2.wire import Dialect

    router, fleet = find_fleet(options, BRIDGE)
    ros = router if options.ros is None else endpoint(options.ros, None, BRIDGE)
    return run(
        router, fleet, ros, options.domain, options.distro, dialect=Dialect(options.dialect),
        wall_time=options.clock == "wall", final_turn=options.final_turn, without=options.without,
    )  # fmt: skip


def domain(text: str) -> int:
    """Read the number of a domain of ROS.

    Raises:
        ConfigError: it is none.
    """
    if not text.isdecimal() or int(text) not in DOMAINS:
        raise ConfigError(f"--domain: expected a whole number from 0 to {DOMAINS[-1]}, got {text!r}")
    return int(text)


def add(commands: "Commands[Parser]") -> None:
    """Add this command below `swarm bridge`."""
    said = "show a running fleet to ROS 2 over Zenoh, and take goals from it"
    one = commands.add_parser("ros2", help=said, description=f"{said}; see docs/ros2.md")
    add_client_options(one)
    text = "router of ROS, tcp/HOST:PORT; by default the fleet's"
    one.add_argument("--ros", metavar="ENDPOINT", help=text)
    one.add_argument("--domain", type=domain, default=0, metavar="N", help="ROS_DOMAIN_ID; 0 by default")
    one.add_argument("--distro", choices=DISTROS, default=DISTROS[0], help=f"of ROS; {DISTROS[0]} by default")
    text = (
        "how ROS travels: as its own middleware does, by default, or as zenoh-bridge-ros2dds, for Open-RMF's free_fleet"
    )
    one.add_argument("--dialect", choices=DIALECTS, default=DIALECTS[0], help=text)
    clock.add(one)
    text = "a robot turns to the yaw of a goal, within 0.1 rad, before the goal counts; else it stands as it came"
    one.add_argument("--final-turn", action="store_true", help=text)
    add_body_options(one)
    text = "a robot of the fleet that is not shown, since ROS has it already: see --body; may be repeated"
    one.add_argument("--without", action="append", default=[], metavar="ROBOT", help=text)
    one.set_defaults(command=bridge)
