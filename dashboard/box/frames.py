"""What the box tells a browser beside the wire's own messages: progress in numbers and words, and one robot's rules."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Final, NamedTuple

import msgspec
from msgspec import Struct

from dashboard.fold import palette, phrases
from dashboard.fold.progress import Progress
from dashboard.fold.scene import Scene
from dashboard.fold.state import QueuePlace, RunState
from swarm.errors import SwarmError
from swarm.messages import (
    CLOCK,
    EVENTS,
    MAP,
    PLAN,
    TRUTH,
    Activity,
    Body,
    Events,
    Liveness,
    Phase,
    PoolCounts,
    Truth,
)
from swarm.messages.fields import doc

OVERVIEW: Final = "box/overview"
RULES: Final = "box/rules"
HELLO: Final = "box/hello"
JOINT: Final = "box/joint"
LEARNED: Final = "box/learned"
ALONE: Final = QueuePlace(0, 0)
COLOURS: Final = 32  # robots with a colour of their own; then the colours repeat


class RobotRow(Struct, frozen=True, kw_only=True):
    """One robot's progress."""

    robot: Annotated[str, doc("its name")]
    heard: Annotated[Liveness, doc("whether its process is there and speaks")]
    doing: Annotated[str, doc("in a word or two: `to 2`, `gives way`, `blocked`, `done`")]
    activity: Annotated[Activity, doc("what it is doing")]
    share: Annotated[float, doc("of its way through its targets, 0 to 1, by distance")]
    reached: Annotated[int, doc("targets reached")]
    stops: Annotated[int, doc("targets, and home if the mission returns; 0: it has not spoken yet")]
    target: Annotated[int, doc("index of the target it drives to; the number of targets when all are reached")]
    left: Annotated[float, doc("m; to that target along its path")]
    waits: Annotated[float, doc("s; for how long it has been waiting now")]
    waited: Annotated[float, doc("s; in this run")]
    unreachable: Annotated[tuple[int, ...], doc("targets given up because no path leads there")]
    assignment: Annotated[int, doc("number of its targets; 0: the scenario's")]
    turn: Annotated[
        int,
        doc(
            "its turn among the robots that drive to its target, 1: it is next; by their joint plan as far as it is "
            "heard, else by metres left; 0: no other robot drives there"
        ),
    ]
    queue: Annotated[int, doc("robots that drive to its target, itself included; 0: no other robot drives there")]


class Overview(Struct, frozen=True, kw_only=True):
    """The progress of the run."""

    run: Annotated[int, doc("increases with each restart")]
    time: Annotated[float, doc("s; since the run began")]
    phase: Annotated[Phase, doc("phase of the run")]
    link: Annotated[bool, doc("the box is connected to the fleet's router")]
    share: Annotated[float, doc("of all robots' ways, 0 to 1")]
    contacts: Annotated[int, doc("touches of robots with anything, among the last 100 events")]
    robots: Annotated[tuple[RobotRow, ...], doc("all robots of the run")]
    pool: Annotated[PoolCounts | None, doc("targets for any robot; null: there were none")] = None


class Why(Struct, frozen=True, kw_only=True):
    """Why a robot's wheels turn as they do: the inference of its fuzzy controller."""

    robot: Annotated[str, doc("its name")]
    steering: Annotated[str | None, doc("how its command differs from the tables' speeds")]
    inputs: Annotated[dict[str, float], doc("m, and degrees (right positive)")]
    memberships: Annotated[dict[str, dict[str, float]], doc("0 to 1, of each input in each term")]
    weights: Annotated[dict[str, float], doc("of each behaviour; they sum to 1")]
    rules: Annotated[list[tuple[str, int, float, str]], doc("behaviour, number, strength 0..1, text")]
    left_v: Annotated[float, doc("m/s; the tables' speed of the left rim")]
    right_v: Annotated[float, doc("m/s")]


def hello(fleet: str, scenarios: dict[str, str], tape: Path | None) -> dict[str, object]:
    """Return what a page must know once: the fleet's name, the scenarios by name, the robots' colours, the tape."""
    colours = [palette.hexadecimal(palette.robot(number)) for number in range(COLOURS)]
    return {"fleet": fleet, "scenarios": scenarios, "colours": colours, "tape": tape and str(tape)}


def make_frame(key: str, content: object) -> str:
    """Return a frame of the WebSocket: a key and a message as JSON; a content that is a function is called for it."""
    if callable(content):
        content = content()
    return f'{{"key":"{key}","message":{msgspec.json.encode(content).decode()}}}'


def encode_wire_frames(state: RunState) -> dict[str, object]:
    """Return the frames with messages of the wire, as far as they have come."""
    frames: dict[str, object] = {
        MAP.key: state.floor,
        CLOCK.key: state.clock,
        TRUTH.key: state.truth,
        PLAN.key: list(state.paths.values()),
        EVENTS.key: Events(events=list(state.progress.events)),
    }
    return {key: content for key, content in frames.items() if content is not None}


def encode_run_frames(state: RunState, selected: frozenset[str], *, link: bool) -> dict[str, object]:
    """Return the frames on the run as a whole: its progress, and what the robots plan and learn together."""
    home = state.scene is not None and state.scene.settings.return_home
    frames: dict[str, object] = {OVERVIEW: Overviewing(state.progress, state.turns(), home, link)}
    if state.truth is not None and state.scene is not None and state.overlays is not None:
        joint = state.overlays.joint(state.truth) if selected and state.scene.settings.map.known else []
        frames[LEARNED] = state.overlays.learned_floor(state.truth)
        frames[JOINT] = [plan for plan in joint if selected & plan.ways.keys()]
    return frames


def encode_robot_frame(state: RunState, selected: frozenset[str]) -> dict[str, object]:
    """Return the frame with the rules of the selected robots, if there are any."""
    if not selected or state.truth is None or state.scene is None:
        return {}
    return {RULES: rules(state.scene, state.truth, selected)}


class Overviewing(NamedTuple):
    """An overview that is made when the first browser takes it; the same progress makes the same one.

    ``turns`` are those of the robots that share a target, ``home`` says whether the scenario's mission returns, and
    ``link`` whether the box is connected.
    """

    progress: Progress
    turns: Mapping[str, QueuePlace]
    home: bool
    link: bool

    def __call__(self) -> Overview:
        """Return the progress in numbers and words."""
        progress = self.progress
        return Overview(
            run=max(0, progress.run),
            time=progress.time,
            phase=progress.phase,
            link=self.link,
            share=progress.way,
            contacts=sum(event.kind == phrases.CONTACT and event.run == progress.run for event in progress.events),
            robots=tuple(_row(progress, name, self.turns.get(name, ALONE), self.home) for name in progress.order),
            pool=progress.pool,
        )


def _row(progress: Progress, name: str, turn: QueuePlace, home: bool) -> RobotRow:
    robot = progress.robot(name)
    return RobotRow(
        robot=name,
        heard=progress.radio_freshness(name),
        doing=phrases.lane_label(robot, home),
        activity=robot.activity,
        share=round(robot.share, 4),
        reached=robot.reached_count,
        stops=robot.stops,
        target=robot.target,
        left=round(robot.distance, 3),
        waits=round(progress.waits(name), 1),
        waited=round(progress.seconds(robot.waited), 1),
        unreachable=robot.unreachable,
        assignment=robot.assignment,
        turn=turn.number,
        queue=turn.of,
    )


def rules(scene: Scene, truth: Truth, selected: frozenset[str]) -> dict[str, Why | str]:
    """Return for each selected robot which rules fire, or a sentence that says why that cannot be told."""
    return {body.robot: _why(scene, body) for body in truth.bodies if body.robot in selected}


def _why(scene: Scene, body: Body) -> Why | str:
    try:
        told = scene.explain_wheels(body)
    except SwarmError as fault:
        return str(fault)
    return Why(
        robot=body.robot,
        steering=None if body.steering is None else body.steering.value,
        inputs=told.inputs,
        memberships=told.memberships,
        weights=told.weights,
        rules=[(rule.behaviour, rule.rule, rule.strength, rule.text) for rule in told.rules],
        left_v=told.left_v,
        right_v=told.right_v,
    )
