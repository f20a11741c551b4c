"""The status of a rehearsal: what a world would tell of it. What nobody has measured is 0."""

from swarm.geometry import wrap
from swarm.messages import Account, Liveness, Phase, RobotStatus, Status
from tests.dashboard.rehearsal import RATE, SPEED, Rehearsal


def status(rehearsal: Rehearsal, tick: int) -> Status:
    """Return what the world tells at a tick."""
    phase = rehearsal.clock(tick).phase
    return Status(
        scenario=rehearsal.scenario.settings.name, run=rehearsal.run, tick=tick, time=tick / RATE, phase=phase,
        complete=phase is Phase.OVER, reason="", edits=0, events=[], world="rehearsal",
        robots=[row(rehearsal, number, tick) for number in range(len(rehearsal.names))],
        contacts={"robot": 0, "wall": 0, "obstacle": 0},
    )  # fmt: skip


def row(rehearsal: Rehearsal, number: int, tick: int) -> RobotStatus:
    """Return what the world tells of a robot."""
    now, told = rehearsal.at(number, tick), rehearsal.state(number, tick)
    account = Account(
        targets=len(now.reached), reached=[tick / RATE if there else None for there in now.reached], laps=0,
        path_length=tick / RATE * SPEED, shortest_length=None, waiting=0.0, waits_for={}, replans=told.replans,
        contacts=0, struck=0, stalled=0, unreachable=[],
    )  # fmt: skip
    return RobotStatus(
        robot=told.robot, liveness=Liveness.ALIVE, since=0.0, pose=(now.x, now.y, wrap(now.yaw)), state=told, waits=[],
        event=None, account=account,
    )  # fmt: skip
