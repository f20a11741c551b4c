"""The robot of foreign_robot.py as a process beside a fleet, and where it begins."""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

from swarm.bus import Bus, Endpoint
from swarm.maps.occupancy import FREE
from swarm.maps.wire import unpack
from swarm.messages import MAP
from tests.launch.actors import FAREWELL, PATIENCE, Fleet

ROBOT: Final = Path(__file__).with_name("foreign_robot.py")


class Where(NamedTuple):
    """How the robot really is."""

    x: float  # m
    y: float  # m
    yaw: float  # rad
    speed: float  # m/s
    turning: float  # rad/s
    told_speed: float  # m/s
    told_turning: float  # rad/s


class ForeignRobot:
    """The other end of its standard input and output."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self.process = process

    def tell(self, *words: object) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(" ".join(map(str, words)) + "\n")
        self.process.stdin.flush()

    def line(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline().rstrip("\n")

    def where(self) -> Where:
        """Return where it really is, how fast, and what it was told last."""
        self.tell("where")
        return Where(*map(float, self.line().split()[1:]))

    def stands(self, told: bool = True) -> Where:
        """Wait until it stands, because it was told to or for another reason; the robot answers at its own pace."""
        for _ in range(round(PATIENCE / 0.02)):
            at = self.where()
            if at.speed == at.turning == 0.0 and (not told or (at.told_speed, at.told_turning) == (0.0, 0.0)):
                return at
        raise AssertionError("it goes on driving")

    def drives(self) -> Where:
        """Wait until it drives."""
        for _ in range(round(PATIENCE / 0.02)):
            at = self.where()
            if at.speed > 0.2:
                return at
        raise AssertionError("it does not drive")

    def end(self) -> tuple[int, float]:
        """End it; return how often it hit a wall, and how far it drove [m]."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        words = self.line().split()
        assert self.process.wait(FAREWELL) == 0
        return int(words[1].rstrip(",")), float(words[3])


@contextmanager
def foreign_robot(router: Endpoint, **settings: Any) -> Iterator[ForeignRobot]:  # noqa: ANN401
    """Start it; it ends with the block."""
    said = json.dumps({"router": str(router), "pose": [0.0, 0.0, 0.0]} | settings)
    process = subprocess.Popen(
        [sys.executable, str(ROBOT), said], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        robot = ForeignRobot(process)
        while (line := robot.line()) != "the robot stands":  # a library may say something first
            assert line, "it has ended"
        yield robot
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            assert pipe is not None
            if not pipe.closed:
                pipe.close()


def floor_of(fleet: Fleet, bus: Bus, robot: str) -> dict[str, Any]:
    """Return where a fleet's robot begins and the walls around it, as the foreign robot takes them, once all are there."""
    fleet.await_all(bus)
    (found,) = bus.fetch(MAP, timeout=PATIENCE)
    floor = unpack(found.packed)
    side, (x, y, yaw) = floor.resolution, floor.origin
    assert yaw == 0.0
    rows, columns = floor.shape
    boxes: list[list[float]] = []
    for row in range(rows):
        solid = [column for column in range(columns) if floor.cells[row, column] != FREE]
        for column in solid:
            if boxes and boxes[-1][1] == y + row * side and boxes[-1][2] == x + column * side:
                boxes[-1][2] += side
            else:
                boxes.append([x + column * side, y + row * side, x + (column + 1) * side, y + (row + 1) * side])
    starts = found.scenario.starts
    assert isinstance(starts, dict)
    return {"pose": list(starts[robot]), "boxes": boxes}
