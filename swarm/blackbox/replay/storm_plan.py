"""The plan of a storm that does what happened in a run of processes: so that it can be shrunk, and kept as a test."""

from collections import Counter, defaultdict
from collections.abc import Iterator
from typing import Any, Final

from msgspec import to_builtins
from msgspec.structs import replace

from swarm.maps.text import floor_as_text
from swarm.maps.wire import unpack
from swarm.messages import Edit, Order, RobotAction
from swarm.settings import EditSettings, MapSettings, OrderSettings, StartSettings
from swarm.storm.plans.plan import FaultKind, PlannedFault, StormPlan, valid
from swarm.tape.reader import Answered, TapeFile
from swarm.tape.rows import ASK, GIVEN, JOIN, RESUME

PROFILE: Final = "tape"  # where another plan names what has drawn it
SHORTEST: Final = 5  # ticks without an answer that are a fault; fewer may be answers that come late
DEAD: Final = 40  # ticks without an answer at the end of a tape, after which a robot counts as dead


class Happened:
    """What happened in the last run on a tape, by robot number and tick."""

    def __init__(self, file: TapeFile) -> None:
        self.left_out: set[str] = set()  # what no plan has, in words
        self._begin()
        for row in file.rows():
            for item in row.items:
                self._take(item)
            self.ticks += row.whole

    def _begin(self) -> None:
        self.ticks = 0
        self.lags: Counter[int] = Counter()  # ticks by which answers came late
        self.answered: defaultdict[int, set[int]] = defaultdict(set)  # ticks by robot
        self.joined: defaultdict[int, set[int]] = defaultdict(set)
        self.foreign: set[int] = set()
        self.asked: list[tuple[int, int | None, object]] = []  # tick, robot and request

    def _take(self, item: Any) -> None:  # noqa: ANN401, as the reader yields them
        match item:
            case Answered():
                self.answered[item.robot].add(self.ticks - item.lag)
                self.lags[item.lag] += 1
            case "restart":
                self._begin()
            case [kind, robot, ours] if kind == JOIN:
                self.joined[robot].add(self.ticks)
                if not ours:
                    self.foreign.add(robot)
            case [kind, robot, message] if kind == GIVEN:
                self.answered[robot].add(message.tick)
            case [kind, robot, message] if kind == ASK:
                self.asked.append((self.ticks, robot, message))
            case [kind, _] if kind == RESUME:
                self.left_out.add("a world that was killed")

    def faults(self, robot: int, name: str) -> Iterator[PlannedFault]:
        """Yield the times in which a robot did not answer."""
        known = sorted(self.answered[robot])
        for last, coming in zip([-1, *known], [*known, self.ticks], strict=True):
            first, missing = last + 1, coming - last - 1
            if missing < SHORTEST:
                continue
            ends = coming == self.ticks
            kind: FaultKind = "dead" if ends and missing >= DEAD else "suspended"
            if not ends and first > 0 and any(last <= tick <= coming for tick in self.joined[robot]):
                kind = "away"
            yield PlannedFault(robot=name, kind=kind, tick=first, ticks=0 if kind == "dead" else missing)


def as_plan(file: TapeFile) -> tuple[StormPlan, list[str]]:
    """Return the plan of the last run on a tape, and in words what of it no plan has.

    The radio loses other broadcasts than it did only if robots sent others: it is drawn from the same seed.

    Raises:
        ConfigError: a row is none, no text can draw the map, or a plan has no room for what happened.
    """
    head, happened = file.head, Happened(file)
    scenario, names = head.map.scenario.settings, list(head.starts)
    floor = unpack(head.map.packed)
    dt = 1.0 / scenario.rate
    late = happened.lags.most_common(1)[0][0] if happened.lags else 0
    edits, orders = list(scenario.edits), list(scenario.orders)
    for tick, robot, request in happened.asked:
        at, name = max(tick, 1) * dt, names[robot] if robot is not None and robot < len(names) else ""
        match request:
            case Edit():
                edits.append(EditSettings(at=at, kind=request.kind.value, low=request.low, high=request.high))
            case Order() if name:
                orders.append(
                    OrderSettings(
                        at=at, robot=name, targets=request.targets, home=request.home, id=request.id,
                        update=request.update, headings=request.headings,
                    )
                )  # fmt: skip
            case RobotAction() if name:
                orders.append(OrderSettings(at=at, robot=name, do=request.do.value, radius=request.radius))
            case _:
                happened.left_out.add(f"a request ({type(request).__name__})")
    if head.outside:
        happened.left_out.add("bodies outside the world")
    start = scenario.start if scenario.start.circle is not None else StartSettings(poses=list(head.starts.values()))
    drawn = MapSettings(
        text=floor_as_text(floor), cell=floor.resolution, known=scenario.map.known, shared=scenario.map.shared
    )
    plan = StormPlan(
        profile=PROFILE,
        seed=head.seed,
        scenario=replace(
            scenario, robots=len(names), seed=head.seed, limit=min(scenario.limit, head.limit), edits=edits,
            orders=orders, map=drawn, start=start,
        ),
        faults=[one for number, name in enumerate(names) for one in happened.faults(number, name)],
        mute=[name for number, name in enumerate(names) if number in happened.foreign],
        late=late,
        slow=max(happened.lags, default=0) - late,
    )  # fmt: skip
    return valid(to_builtins(plan), f"tape {file.path}"), sorted(happened.left_out)
