"""Commands to the robots of a running fleet: orders and the pool of targets, stop, go on, home and cancel."""

import argparse
from uuid import uuid4

from swarm.cli.argument_parser import Commands, Parser, parse_number_within, point, stop_at
from swarm.cli.fleet_lookup import add_client_options, fleet_bus, send_request
from swarm.cli.steer.control import button
from swarm.secure.names import OPERATOR

RADIUS = "load: --radius: expected 0.01 to 5 m"
ACTIONS = {
    "go-on": "let a robot that was stopped go on",
    "home": "send a robot home now; the targets that it has left are dropped",
    "cancel": "drop the targets that a robot has left; it stays where it is",
}


def order(options: argparse.Namespace) -> int:
    """Give a robot targets, instead of the stops that it has left; with --wait stay until the order has ended."""
    from swarm.bridge.errand import OrderErrand
    from swarm.cli.steer import order_progress
    from swarm.messages import ORDER, Order

    name = options.id or uuid4().hex
    targets, headings = [(x, y) for x, y, _ in options.targets], [yaw for _, _, yaw in options.targets]
    while headings and headings[-1] is None:
        headings.pop()
    request = Order(id=name, update=options.update, targets=targets, home=options.home, headings=headings)
    with fleet_bus(options, OPERATOR) as bus:
        if options.wait:
            order_progress.listen(bus, options.robot)  # before the request: nothing is missed
        reply = bus.ask(ORDER, request, robot=options.robot)
        print(reply.text, flush=True)
        if not options.wait:
            return 0
        return order_progress.follow_order(bus, OrderErrand.from_answer(options.robot, request, reply))


def pool(options: argparse.Namespace) -> int:
    """Put targets into the pool: any robot that is free visits them."""
    from swarm.messages import POOL, PoolTargets

    return send_request(options, POOL, PoolTargets(id=options.id or uuid4().hex, targets=options.targets))


def act(options: argparse.Namespace) -> int:
    """Carry out an action for one robot."""
    from swarm.messages import ROBOT_ACTION, RobotAction, RobotDo

    return send_request(options, ROBOT_ACTION, RobotAction(do=RobotDo(options.action)), robot=options.robot)


def load(options: argparse.Namespace) -> int:
    """Give a robot a load that makes it wider, or take its load away."""
    from swarm.messages import ROBOT_ACTION, RobotAction, RobotDo

    radius = None if options.radius is None else parse_number_within(0.01, 5.0, options.radius, RADIUS)
    return send_request(options, ROBOT_ACTION, RobotAction(do=RobotDo.LOAD, radius=radius), robot=options.robot)


def stop(options: argparse.Namespace) -> int:
    """Stop one robot, or end the run if none is named."""
    return button(options) if options.robot is None else act(options)


def add(commands: "Commands[Parser]") -> None:
    """Add these commands to the command line."""
    one = commands.add_parser("order", help="give a robot of a running fleet new targets")
    one.add_argument("robot", metavar="ROBOT")
    text = "m; visited in order; with a YAW [rad; 0 along x, left is positive] the robot turns to that there"
    one.add_argument("targets", type=stop_at, nargs="+", metavar="X,Y[,YAW]", help=text)
    one.add_argument("--home", action="store_true", help="drive home after the last target")
    text = "name of the order, a new one by default; the same order given again changes nothing"
    one.add_argument("--id", metavar="NAME", help=text)
    text = "version of the order, 0 by default; a higher one replaces a lower one"
    one.add_argument("--update", type=int, default=0, metavar="N", help=text)
    text = "stay until the order has ended, and print how far it is; status 0: done, 1: not; Ctrl-C leaves the order"
    one.add_argument("--wait", action="store_true", help=text)
    add_client_options(one)
    one.set_defaults(command=order)
    one = commands.add_parser("pool", help="give a running fleet targets that any free robot visits")
    one.add_argument("targets", type=point, nargs="+", metavar="X,Y", help="m; each is visited once, in any order")
    text = "name of the request, a new one by default; the same request given again changes nothing"
    one.add_argument("--id", metavar="NAME", help=text)
    add_client_options(one)
    one.set_defaults(command=pool)
    for name, text in ACTIONS.items():
        one = commands.add_parser(name, help=text)
        one.add_argument("robot", metavar="ROBOT")
        add_client_options(one)
        one.set_defaults(command=act, action=name.replace("-", "_"))
    one = commands.add_parser("load", help="give a robot a load that makes it wider, or take it away")
    one.add_argument("robot", metavar="ROBOT")
    one.add_argument("--radius", metavar="METRES", help="of the circle around the robot with its load")
    add_client_options(one)
    one.set_defaults(command=load)
    one = commands.add_parser("stop", help="end the run; with ROBOT, stop only that robot until `swarm go-on`")
    one.add_argument("robot", nargs="?", metavar="ROBOT")
    add_client_options(one)
    one.set_defaults(command=stop, button="stop", action="stop")
