"""What one robot says in a tick: its command always, its broadcast in its turn, its state and path on change."""

from collections.abc import Callable
from typing import NamedTuple

from swarm.messages import STATE, Broadcast, Command, Plan, Sense, State
from swarm.messages.robot import Believed
from swarm.robot.driving.pilot import PilotOutputs
from swarm.robot.mission import Mission
from swarm.robot.navigator import Navigator


class Outputs(NamedTuple):
    """The outputs of one step; None: nothing new to send."""

    command: Command
    broadcast: Broadcast | None
    state: State | None
    plan: Plan | None


class OutputWriter:
    """Writes what one robot says in one run; it knows what it has said last."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._told: tuple[object, ...] = ()
        self._told_at = float("-inf")  # s
        self._plan_told: object = None

    def write(
        self, run: int, sense: Sense, move: PilotOutputs, mission: Mission, navigator: Navigator, replans: int,
        believed: Believed | None, walls: Callable[[], list[int]],
    ) -> Outputs:  # fmt: skip
        """Return the outputs of a tick; ``walls`` gives the learned cells to broadcast, and is asked only then."""
        sends = move.traffic is not None
        command = Command(
            run=run, tick=sense.tick, left=move.speeds.left, right=move.speeds.right, heading=move.heading,
            scale=move.scale, activity=move.activity, reached=list(mission.reached),
            unreachable=list(mission.unreachable), sent=sends, replans=replans,
            held=list(move.held), unconstrained=move.unconstrained, waits=list(move.waits),
            members=list(move.members), notes=list(move.notes), assignment=mission.number,
            believed=believed,
        )  # fmt: skip
        broadcast = plan = None
        if sends:
            broadcast = Broadcast(
                robot=self._name, run=run, tick=sense.tick, x=sense.x, y=sense.y, yaw=sense.yaw,
                activity=move.activity, target=mission.target, distance=navigator.remaining,
                reached=list(mission.reached), traffic=move.traffic, walls=walls(),
            )  # fmt: skip
        state = self._write_state(run, sense, move, mission, navigator, replans)
        if navigator.path is not None and navigator.path is not self._plan_told:
            self._plan_told = navigator.path
            plan = Plan(robot=self._name, run=run, tick=sense.tick, points=list(navigator.path.points))
        return Outputs(command, broadcast, state, plan)

    def _write_state(
        self, run: int, sense: Sense, move: PilotOutputs, mission: Mission, navigator: Navigator, replans: int
    ) -> State | None:
        """Return the state if it has changed, or was told long ago."""
        news = (run, move.activity, mission.number, mission.laps, mission.target, tuple(mission.reached), replans)
        if news == self._told and sense.time - self._told_at < 1.0 / STATE.rate:
            return None
        self._told, self._told_at = news, sense.time
        return State(
            robot=self._name, run=run, tick=sense.tick, activity=move.activity, target=mission.target,
            reached=list(mission.reached), unreachable=list(mission.unreachable), distance=navigator.remaining,
            replans=replans, laps=mission.laps, assignment=mission.number, waits=list(move.waits),
        )  # fmt: skip
