"""How a fleet is, as ROS's diagnostics and batteries: what is a warning and what an error is in tables."""

from collections.abc import Mapping, Sequence
from math import nan
from typing import Final, NamedTuple

from swarm.bridge.cdr.writer import CdrWriter
from swarm.messages import Activity, Clock, Event, Liveness, State

FULL: Final = 1.0  # of a battery's percentage, from 0 to 1
OK, WARN, ERROR = range(3)  # diagnostic_msgs/msg/DiagnosticStatus

# fmt: off
OF_PROCESS: Final[Mapping[Liveness, tuple[int, str]]] = {
    Liveness.ALIVE: (OK,    "its process is there and speaks"),
    Liveness.STALE: (WARN,  "its process is there, but says nothing"),
    Liveness.GONE:  (ERROR, "its process is gone; it stands until it is started again"),
    Liveness.LOST:  (ERROR, "it counts as lost; the run may end without it"),
}
OF_DRIVING: Final[Mapping[Activity, int]] = {  # the others are well
    Activity.BLOCKED: WARN, Activity.STOPPED: WARN,
}
OF_EVENT: Final[Mapping[str, int]] = {  # by kind; all others are well
    "contact": ERROR, "traffic_fault": ERROR, "gone": ERROR, "lost": ERROR, "rival": ERROR, "impostor": ERROR,
    "false_claim": ERROR, "unsolvable": ERROR, "stalled": ERROR, "body_refused": ERROR, "body_jumped": ERROR,
    "body_silent": ERROR, "pose_worse": ERROR, "pose_lost": ERROR,
    "pose_jumped": WARN,
    "stale": WARN, "silent": WARN, "left": WARN, "unreachable": WARN, "duplicate": WARN, "edit_refused": WARN,
    "request_refused": WARN, "refused": WARN, "plan_refused": WARN, "plan_ignored": WARN, "no_plan_found": WARN,
    "mute_in_the_way": WARN, "halted": WARN, "overdue": WARN, "errand_back": WARN, "other_world": WARN,
}
# fmt: on


class DiagnosticStatus(NamedTuple):
    """A diagnostic_msgs/msg/DiagnosticStatus; its tools show the newest one of each name."""

    level: int
    name: str
    text: str
    robot: str  # "": it is of the whole fleet
    values: tuple[tuple[str, str], ...] = ()


def process_statuses(clock: Clock, names: Mapping[str, str]) -> list[DiagnosticStatus]:
    """Return whether each robot of ``names`` is there."""
    found = []
    for robot in names:
        seen = clock.presence.get(robot)
        level, text = OF_PROCESS[Liveness.ALIVE if seen is None else seen.liveness]
        found.append(DiagnosticStatus(level, f"{robot}: process", text, robot))
    return found


def driving_status(state: State) -> DiagnosticStatus:
    """Return what a robot does, and how far it is."""
    level = OF_DRIVING.get(state.activity, OK)
    done = f"{sum(state.reached)} of {len(state.reached)}"
    values = (("targets reached", done), ("waits for", ", ".join(state.waits)), ("replans", f"{state.replans}"))
    return DiagnosticStatus(level, f"{state.robot}: driving", state.activity.value, state.robot, values)


def event_status(event: Event) -> DiagnosticStatus:
    """Return an event of the run."""
    robot = event.robot or ""
    return DiagnosticStatus(
        OF_EVENT.get(event.kind, OK), f"{robot or 'fleet'}: events", event.text, robot,
        (("kind", event.kind), ("time in the run [s]", f"{event.time:.2f}")),
    )  # fmt: skip


def write_diagnostics(at: int, found: Sequence[DiagnosticStatus]) -> bytes:
    """Return a diagnostic_msgs/msg/DiagnosticArray."""
    out = CdrWriter()
    out.write_header(at, "")
    out.write_numbers("I", len(found))
    for row in found:
        out.write_numbers("B", row.level)
        out.write_text(row.name, row.text, row.robot)
        out.write_numbers("I", len(row.values))
        for pair in row.values:
            out.write_text(*pair)
    return out.to_bytes()


def write_battery(at: int, frame: str, robot: str) -> bytes:
    """Return a sensor_msgs/msg/BatteryState that is full: no robot of a fleet has one, but Open-RMF and Nav2 ask."""
    out = CdrWriter()
    out.write_header(at, frame)
    out.write_numbers(
        "f", *[nan] * 6, FULL
    )  # voltage, temperature, current, charge, capacity, design capacity; percentage
    out.write_numbers("B", 0, 1, 0, 1)  # supply: status unknown, health good, technology unknown; present
    out.write_numbers("I", 0, 0)  # voltages and temperatures of cells
    out.write_text("", robot)  # the place in the robot, the serial number
    return out.to_bytes()
