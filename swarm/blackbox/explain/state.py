"""The whole state of one robot at a tick, as plain data: sensed, heard, decided, held, known of others."""

from math import degrees
from typing import Annotated, Any

from msgspec import Struct

from swarm.blackbox.explain.run_history import RecentPast
from swarm.fuzzy import Controller
from swarm.messages.fields import doc
from swarm.messages.traffic import Claim, Epoch, Record
from swarm.robot.brain import Robot
from swarm.settings import Settings
from world.host.last_messages import Sent


class KnownRobot(Struct, frozen=True, kw_only=True):
    """What a robot knows of another."""

    stamp: Annotated[int, doc("tick of the newest record")]
    silent: Annotated[bool, doc("it counts as silent")]
    held: tuple[int, ...]
    claims: tuple[Claim, ...]
    acknowledged: Annotated[tuple[int, ...], doc("numbers of this robot's claims that it has acknowledged")]


class InTraffic(Struct, frozen=True, kw_only=True):
    """The decisions of a robot's last step of coordination."""

    tick: int
    goal: Annotated[int, doc("cell")]
    held: Annotated[tuple[int, ...], doc("cells; the last is the head")]
    claims: tuple[Claim, ...]
    route: Annotated[tuple[int, ...], doc("cells to come")]
    waits: tuple[str, ...]
    call: Annotated[str, doc("its part in a joint plan to come: free, frozen, collecting, searching")]
    called: Annotated[Epoch | None, doc("the joint plan to come")]
    follows: Annotated[Epoch | None, doc("the joint plan that it follows")]
    knows: dict[str, KnownRobot]


class RobotState(Struct, frozen=True, kw_only=True):
    """One robot at the end of a tick."""

    robot: str
    tick: int
    time: Annotated[float, doc("s")]
    answered: Annotated[bool, doc("it answered in this tick; else what follows is of its last answer")]
    activity: str | None
    pose: Annotated[tuple[float, float, float], doc("m, m, rad; in the map")]
    sensed: Annotated[dict[str, float], doc("m; the nearest in each sector")]
    wheels: Annotated[tuple[float, float], doc("m/s; left and right")]
    target: Annotated[int | None, doc("index of the stop that it drives to")]
    stops: Annotated[list[tuple[float, float]], doc("m")]
    heard: Annotated[list[Sent], doc("broadcasts that reached it in this tick: who spoke, and when")]
    tables: Annotated[dict[str, Any], doc("what the fuzzy tables say at its aim, and the rules that fired")]
    traffic: InTraffic | None


def state_of(
    name: str, robot: Robot | None, past: RecentPast, settings: Settings, controller: Controller
) -> RobotState:
    """Return the state of a robot at the last tick of ``past``; None: it runs other code, whose state is not known."""
    sense, command = past.senses[name], past.commands.get(name)
    tables: dict[str, Any] = {}
    if command is not None:
        unit = settings.robot.distance_scale * command.scale
        said = controller.explain(sense.left / unit, sense.front / unit, sense.right / unit, -degrees(command.heading))
        tables = said.to_json_dict()
    return RobotState(
        robot=name, tick=past.tick, time=past.tick / settings.rate, answered=past.answers(name),
        activity=command.activity.value if command is not None else None,
        pose=(sense.x, sense.y, sense.yaw), sensed={"left": sense.left, "front": sense.front, "right": sense.right},
        wheels=(command.left, command.right) if command is not None else (0.0, 0.0),
        target=robot.mission.target if robot is not None else None,
        stops=[(x, y) for x, y in robot.mission.stops] if robot is not None else [],
        heard=past.broadcasts_heard(name, past.tick), tables=tables, traffic=_traffic(name, robot),
    )  # fmt: skip


def _traffic(name: str, robot: Robot | None) -> InTraffic | None:
    decided = robot.last_decision if robot is not None else None
    if decided is None:
        return None
    progress, situation, joint = decided.progress, decided.situation, decided.joint
    own = progress.reservations
    return InTraffic(
        tick=situation.tick, goal=decided.goal.cell, held=own.held, claims=own.all_claims, route=progress.route,
        waits=decided.waits, call=type(joint.call).__name__.lower(), called=joint.call_epoch, follows=joint.epoch,
        knows={
            other: _known_of_robot(name, record, silent=other not in situation.fresh)
            for other, record in situation.others.items()
        },
    )  # fmt: skip


def _known_of_robot(name: str, record: Record, *, silent: bool) -> KnownRobot:
    mine = tuple(number for robot, number in record.acks if robot == name)
    return KnownRobot(stamp=record.stamp, silent=silent, held=record.held, claims=record.claims, acknowledged=mine)
