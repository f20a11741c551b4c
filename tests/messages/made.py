"""Messages of a run, of which a test says only what matters to it."""

from msgspec.structs import replace

from swarm.messages import Activity, Body, Broadcast, Clock, Event, Phase, State, Truth


def clock(tick: int = 0, run: int = 1, phase: Phase = Phase.RUNNING, robots: tuple[str, ...] = ("a", "b")) -> Clock:
    return Clock(run=run, tick=tick, time=tick / 20, phase=phase, robots=list(robots), present=list(robots))


def broadcast(tick: int, robot: str = "a", **changed: object) -> Broadcast:
    plain = Broadcast(
        robot=robot, run=1, tick=tick, x=1.0, y=2.0, yaw=0.5, activity=Activity.DRIVE, target=0, distance=5.0,
        reached=[False] * 3,
    )  # fmt: skip
    return replace(plain, **changed)


def state(tick: int, robot: str = "a", **changed: object) -> State:
    plain = State(
        robot=robot, run=1, tick=tick, activity=Activity.DRIVE, target=0, reached=[False] * 3, unreachable=[],
        distance=5.0, replans=0,
    )  # fmt: skip
    return replace(plain, **changed)


def truth(tick: int, run: int = 1, x: float = 3.0) -> Truth:
    body = Body(
        robot="a", x=x, y=0.0, yaw=0.0, left_v=0.0, right_v=0.0, left=1.0, front=1.0, right=1.0, heading=0.0,
        steering=None, activity=Activity.READY,
    )  # fmt: skip
    return Truth(run=run, tick=tick, time=tick / 20, bodies=[body])


def event(tick: int, run: int = 1) -> Event:
    return Event(run=run, tick=tick, time=tick / 20, robot=None, kind="go", text="go")
