"""The command `swarm status`: a line on the run, and one on each robot; or all that is known of one robot."""

import argparse
from math import degrees
from pathlib import Path
from typing import Any, Final

import msgspec

from swarm.cli.argument_parser import Commands, Parser
from swarm.cli.columns import align_rows
from swarm.cli.fleet_lookup import add_client_options, find_fleet, find_tape
from swarm.errors import ConfigError, suggest
from swarm.messages import Event, Liveness, RobotStatus, Status
from swarm.secure.names import WATCHER

HEAD: Final[tuple[str, ...]] = (
    "robot", "is", "x, y [m]", "yaw [deg]", "does", "target", "left [m]", "waits for", "last event",
)  # fmt: skip
EVENTS: Final = 10  # last ones of one robot


def status(options: argparse.Namespace) -> int:
    """Print the status of a running fleet: the phase, and where each robot is and what it does; or of one robot."""
    from swarm.bus import Bus
    from swarm.launch.summary import format_tape_line
    from swarm.messages import STATUS

    here = find_fleet(options, WATCHER)
    with Bus(*here) as bus:
        found = bus.fetch(STATUS)
    if not found:
        raise ConfigError(
            "status: expected a world in that fleet, found none; if `swarm run` is just starting it, ask again in a "
            "few seconds, else start one with `swarm world`"
        )
    whole, name = found[0], options.robot
    if options.json:
        print(msgspec.json.encode(whole if name is None else robot_as_json(whole, name)).decode())
    else:
        print(format_status(whole) if name is None else format_robot(whole, name))
        if name is None and (file := find_tape(options, here.fleet)) is not None:
            print(*format_tape_line(Path(file)), sep="\n")
    return 0


def format_status(status: Status) -> str:
    """Return the status as text."""
    pool = status.pool
    errands = (
        [f"pool: {pool.done} of {pool.given} targets done, {pool.taken} under way, {pool.waiting} waiting"]
        if pool is not None
        else []
    )
    return "\n".join([_head(status), *errands, align_rows([HEAD, *map(_row, status.robots)])])


def robot_as_json(status: Status, name: str) -> dict[str, Any]:
    """Return all that is known of one robot as values of JSON: its row, its events of this run, and the run.

    Raises:
        ConfigError: the fleet has no such robot.
    """
    row, events = _find_robot_rows(status, name)
    run = {"scenario": status.scenario, "run": status.run, "time": status.time, "phase": status.phase}
    whole: dict[str, Any] = msgspec.to_builtins(run | msgspec.structs.asdict(row) | {"events": events})
    return whole


def format_robot(status: Status, name: str) -> str:
    """Return all that is known of one robot as text.

    Raises:
        ConfigError: the fleet has no such robot.
    """
    row, events = _find_robot_rows(status, name)
    x, y, yaw = row.pose
    state, account = row.state, row.account
    at = state.target < len(state.reached)
    facts = [
        ("is", row.liveness.value + _since(row)),
        ("pose", f"{x:.2f}, {y:.2f} m, yaw {degrees(yaw):.0f} deg"),
        (
            "does",
            f"{_format_activity(row)}, target {state.target + 1} of {len(state.reached)}, {state.distance:.1f} m left"
            if at
            else _format_activity(row),
        ),
        ("waits for", row.why or ", ".join(row.waits) or "nobody"),
        ("has", f"{row.mission}{f', number {state.assignment}' if state.assignment else ''}"),
    ]
    if account is not None:
        facts += [(label, text) for label, text in _targets(row)]
        longest = ", ".join(f"{other} {seconds:.1f} s" for other, seconds in account.waits_for.items())
        facts += [
            ("drove", f"{account.path_length:.1f} m; paths planned after the first: {account.replans}"),
            (
                "waited",
                f"{account.waiting:.1f} s{f': {longest}' if longest else ''}; stood {account.standing:.1f} s in all",
            ),
            ("contacts", f"{account.contacts}{f', {account.struck} of them while it stood' if account.struck else ''}"),
        ]
        facts += [("stalled", f"{account.stalled} times")] if account.stalled else []
    told = [f"{event.time:8.1f} s  {event.text}" for event in events[-EVENTS:]]
    last = ["", "last events of this run:", *told] if told else ["", "no event of this run is among the last 100"]
    return "\n".join([f"{name} of {_head(status)}", "", align_rows(facts), *last])


def _find_robot_rows(status: Status, name: str) -> tuple[RobotStatus, list[Event]]:
    """Return a robot's row, and those of the last events that are about it and of this run."""
    rows = {row.robot: row for row in status.robots}
    if name not in rows:
        raise ConfigError(f"status: expected a robot of the fleet, got {name!r}; {suggest(name, rows)}")
    return rows[name], [event for event in status.events if (event.robot, event.run) == (name, status.run)]


def _targets(robot: RobotStatus) -> list[tuple[str, str]]:
    """Return a row for each target: where it is, and when the robot was there."""
    assert robot.account is not None
    reached, rows = robot.account.reached, []
    for number, (x, y) in enumerate(robot.stops):
        home = robot.home and number == len(reached) - 1
        time = reached[number] if number < len(reached) else None
        then = (
            f"reached at {time:.1f} s" if time is not None
            else "given up: no way leads there" if number in robot.account.unreachable
            else "next" if number == robot.state.target else "to come"
        )  # fmt: skip
        rows.append(("home" if home else f"target {number + 1}", f"{x:.2f}, {y:.2f} m  {then}"))
    more = len(reached) - len(robot.stops)
    return [
        *rows,
        *([("", f"and {more} more")] if more > 0 else []),
        *([("laps", str(robot.account.laps))] if robot.account.laps else []),
    ]


def _head(status: Status) -> str:
    head = f"{status.scenario}: {status.phase.value} at {status.time:.1f} s, run {status.run}"
    return head + (f", not complete: {status.reason}" if status.reason else ", complete" * status.complete)


def _since(robot: RobotStatus) -> str:
    return "" if robot.liveness is Liveness.ALIVE else f" since {robot.since:.1f} s"


def _row(robot: RobotStatus) -> tuple[str, ...]:
    x, y, yaw = robot.pose
    state, event = robot.state, robot.event
    left = state.target < len(state.reached)
    return (
        robot.robot,
        robot.liveness.value + _since(robot),
        f"{x:.2f}, {y:.2f}",
        f"{degrees(yaw):.0f}",
        _format_activity(robot),
        f"{state.target + 1} of {len(state.reached)}" if left else "none left",
        f"{state.distance:.1f}" if left else "",
        robot.why or ", ".join(robot.waits),
        f"{event.time:.1f} s: {event.text}" if event is not None else "",
    )


def _format_activity(robot: RobotStatus) -> str:
    """Return what a robot does; of one that is not there, nothing: what it said last is over."""
    return robot.state.activity.value if robot.liveness in {Liveness.ALIVE, Liveness.STALE} else "-"


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line."""
    one = commands.add_parser("status", help="print where the robots of a running fleet are and what they do")
    text = "print all that is known of this robot: why it stands, its targets and when it was there, its last events"
    one.add_argument("robot", nargs="?", metavar="ROBOT", help=text)
    add_client_options(one)
    one.add_argument("--json", action="store_true", help="print all of it as JSON, as the world answers")
    one.set_defaults(command=status)
