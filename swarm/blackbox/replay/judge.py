"""The safety laws of `swarm storm` over a run of processes: its history is made again from the tape."""

from typing import Final, NamedTuple

from swarm.blackbox.replay.answer_values import ReplayedTick
from swarm.blackbox.replay.replay import Replay
from swarm.geometry import Pose, distance
from swarm.messages import Broadcast, Command
from swarm.storm.history.history import History, Moment
from swarm.storm.history.run_facts import EXACT
from swarm.storm.laws.judge import LAWS, Violation, judge
from world.faults import Health
from world.world import World

# what must hold in every tick, also of a run that was cut, had orders, or lost robots
SAFE: Final = (
    "no contact", "no overlap", "no hold without a claim", "claims numbered once", "no false agreement",
    "listens first", "no claim while standing", "takes only what is free", "no wait for the silent",
    "no body outside", "room to brake", "passes the wire", "broadcasts are heard",
)  # fmt: skip

AWAY: Final = -1e4  # m; where no floor is


class Open(NamedTuple):
    """What may still be added to a moment: answers come late."""

    health: dict[str, Health]
    commands: dict[str, Command]
    spoken: dict[str, Broadcast]


class Watch:
    """The history of a replay's last run. Call ``take`` after every tick.

    ``history`` is None until the first one.
    """

    laws: Final = len(SAFE)

    def __init__(self) -> None:
        self.history: History | None = None
        self._run = -1
        self._world: World | None = None
        self._open: dict[int, Open] = {}  # by tick
        self._before: dict[int, tuple[Pose, ...]] = {}  # by tick: where the last world had the robots, before it died

    def take(self, replay: Replay, tick: ReplayedTick) -> None:
        """Take in a tick that is over."""
        world = replay.world
        if self.history is None or world.run != self._run:
            self._open, self._before = {}, {}
            self._run, floor = world.run, replay.scenario.map if world.bodies.edits == 0 else world.bodies.floor
            self.history = History(
                settings=replay.scenario.settings, robots=(), stops=(), floors=[(0, floor)], late=replay.outline.slowest
            )
        history, at = self.history, world.tick - 1
        if world is not self._world:  # it has gone on from what it had saved
            self._world = world
            self._before |= {moment.tick: moment.poses for moment in history.moments if moment.tick >= at}
            history.moments = [moment for moment in history.moments if moment.tick < at]
            history.floors = [one for one in history.floors if one[0] <= at] or history.floors[:1]
        for number in range(len(history.robots), len(world.robots)):  # a place was opened: before, it was nowhere
            away = Pose(AWAY * (number + 1), AWAY, 0.0)
            history.moments = [moment._replace(poses=(*moment.poses, away)) for moment in history.moments]
        history.robots = tuple(world.robots)
        history.stops = tuple(map(world.tasks.missions.stops, range(len(world.robots))))
        history.contacts = world.measures.recorder.counts.begun
        if world.bodies.floor is not history.floors[-1][1]:
            history.floors.append((world.tick, world.bodies.floor))
        for name in tick.joined:
            for moment in reversed(history.moments):
                if name in moment.commands:
                    break
                self._open[moment.tick].health[name] = Health.AWAY
        poses = tuple(Pose(one.x, one.y, one.yaw) for one in tick.senses.values())
        for number, (was, pose) in enumerate(zip(self._before.pop(at, ()), poses, strict=False)):
            if distance(was, pose) > EXACT:
                history.put_back.setdefault(number, []).append(at)
        health = dict.fromkeys(world.robots, Health.SUSPENDED)
        commands, spoken = dict[str, Command](), dict[str, Broadcast]()
        self._open[at] = Open(health, commands, spoken)
        history.moments.append(
            Moment(
                at, poses, health, tick.senses, commands, spoken, tuple(tick.events),
                tuple(command.tick for command in world.tasks.commands),
                frozenset(contact.robot for contact in world.bodies.physics.touching),
            )
        )  # fmt: skip
        for name, command, _ in tick.steps:
            health, commands, spoken = self._open[command.tick]  # a late answer belongs to the tick that it answers
            commands[name] = command
            health[name] = Health.WELL
            said = replay.broadcasts.get((name, command.tick)) if command.sent else None
            if said is not None:
                spoken[name] = said

    def judge_laws(self) -> list[Violation]:
        """Return the first violation of each law by each robot."""
        history, world = self.history, self._world
        if history is None or world is None:
            return []
        history.moments.append(Moment(world.tick, tuple(world.poses()), {}, {}, {}, {}, (), (), frozenset()))
        return judge(history, {law: LAWS[law] for law in SAFE})
