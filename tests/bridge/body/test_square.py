"""The square and what it shows, with robots whose latency, accelerations and errors are known."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from math import pi
from pathlib import Path
from typing import Any

import pytest
import yaml

from swarm.bridge.body.body import BodyOptions, RosBody
from swarm.bridge.body.measure import tell_result
from swarm.bridge.body.readings import Odometry
from swarm.bridge.body.square import (
    OdometrySample,
    Square,
    SquareKind,
    SquareResult,
    format_kind_entry,
    measure_square,
)
from swarm.cli import main
from swarm.errors import ConfigError, PeerError
from swarm.geometry import Pose, Twist, integrate
from swarm.kinds import settings_of
from swarm.motion.drive import ramp
from tests.shared import scenario_of

STEP = 0.02  # s, between two odometries
WIDTH = 0.4  # m


@dataclass
class Plant:
    late: float = 0.1  # s
    acceleration: float = 0.5  # m/s2
    turning: float = 1.0
    share: float = 1.0
    pose: Pose = field(default_factory=lambda: Pose(3.0, 4.0, 1.0))
    twist: Twist = field(default_factory=lambda: Twist(0.0, 0.0))

    def drives(self, square: Square, most: float = 120.0) -> Iterator[Twist]:
        """Drive the square; yield what it commands."""
        waiting = deque([Twist(0.0, 0.0)] * round(self.late / STEP))
        gain = self.acceleration * STEP
        for tick in range(round(most / STEP)):
            command = square.add_sample(
                OdometrySample(tick * STEP, Odometry(tick * STEP, self.pose, self.twist), self.pose)
            )
            yield command
            if square.is_done:
                return
            waiting.append(command)
            now = waiting.popleft()
            self.twist = Twist(
                ramp(self.twist.linear, now.linear * self.share, gain),
                ramp(self.twist.angular, now.angular * self.turning * self.share, gain * 2 / WIDTH),
            )
            self.pose = integrate(self.pose, self.twist, STEP)


@pytest.mark.parametrize("late", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("acceleration", [0.3, 1.0])
@pytest.mark.parametrize("turning", [0.8, 1.0, 1.1])
def test_a_square_shows_how_late_quick_and_wide_a_robot_is(late: float, acceleration: float, turning: float) -> None:
    square = Square(1.0, 0.3, 1.0)
    plant = Plant(late, acceleration, turning)
    commands = list(plant.drives(square))
    assert square.is_done
    assert commands[-1] == Twist(0.0, 0.0)
    found = measure_square(square, WIDTH)
    assert found.rate == pytest.approx(50.0)
    assert found.latency[1] == pytest.approx(late + 0.3 * 0.1 / acceleration, abs=2.5 * STEP)
    assert found.acceleration == pytest.approx(acceleration, rel=0.2)
    assert found.braking == pytest.approx(acceleration, rel=0.2)
    assert found.top_speed == pytest.approx(0.3)
    assert found.driven == pytest.approx(1.0, abs=0.01)
    assert found.turned == pytest.approx(turning, rel=0.02)


def test_the_robot_stands_between_two_moves_and_the_moves_alternate() -> None:
    square = Square(1.0, 0.3, 1.0)
    commands = list(Plant().drives(square))
    changes = [after for before, after in pairwise(commands) if after != before]
    stands, forward, left = Twist(0.0, 0.0), Twist(0.3, 0.0), Twist(0.0, 1.0)
    assert changes == [forward, stands, left, stands] * 4


def test_what_is_told_first_is_what_was_measured() -> None:
    lines: list[str] = []
    tell_result(measured(), SETTING, 0.3, None, None, lines.append)
    assert "turning             0.800 of what was commanded, by /pose" in lines
    assert "track width         0.500 m in effect; 0.400 m in the robot's driver" in lines


@pytest.mark.parametrize("share", [0.0, 0.2])
def test_a_robot_that_does_not_do_what_it_is_told_is_given_up(share: float) -> None:
    with pytest.raises(PeerError, match=r"expected a side in 3.3 s, got .* m and 0.00 rad in 12.\d s; does the robot"):
        list(Plant(share=share).drives(Square(1.0, 0.3, 1.0)))


def test_a_turn_is_a_quarter() -> None:
    square = Square(1.0, 0.3, 1.0)
    list(Plant(late=0.0, acceleration=50.0).drives(square))
    assert [move.told for move in square.moves if move.is_turn] == pytest.approx([pi / 2] * 4, abs=2 * STEP)


SETTING = BodyOptions("r2", "/odom", "/pose", None, "/cmd", None, track_width=WIDTH)
# what is said after the empty line, without a kind: as it was before there were kinds
PLAIN = """\
give the bridge --track-width 0.4, and the scenario these lines:
robot:
  track_width: 0.500
  wheel_acceleration: 0.50
  speed_scale: 0.075  # wheels of at most 0.30 m/s
"""
USE = """\
put {place} into the scenario, below its `kinds` if it has some, and burger into its `robots`, as in
robots: {{burger: 1, other: 3}}: robots have their numbers in that order, and r2 is to be a burger;
start the world with --body r2, and give the bridge --track-width 0.4
"""
ENTRY = """\
kinds:
  burger:
    radius: 0.105  # m, of the circle around all of it, from the point between its wheels
    track_width: 0.500
    wheel_acceleration: 0.50
    speed_scale: 0.075  # wheels of at most 0.30 m/s
"""
BURGER = SquareKind("burger", 0.105)


def measured() -> SquareResult:
    """Return what a robot shows that turns 0.8 of what it is told."""
    square = Square(1.0, 0.3, 1.0)
    list(Plant(turning=0.8).drives(square))
    return measure_square(square, WIDTH)


def told(kind: SquareKind | None, out: Path | None = None, setting: BodyOptions = SETTING) -> str:
    """Return what is said below what was measured."""
    lines: list[str] = []
    tell_result(measured(), setting, 0.3, kind, out, lines.append)
    return "".join(f"{line}\n" for line in lines[lines.index("") + 1 :])


def test_without_a_kind_what_is_told_is_what_it_was() -> None:
    assert told(None) == PLAIN


def test_with_a_kind_what_is_told_is_an_entry_and_what_to_do_with_it(tmp_path: Path) -> None:
    assert told(BURGER) == USE.format(place="these lines") + ENTRY
    out = tmp_path / "burger.yaml"
    assert told(BURGER, out) == USE.format(place=f"what is in {out}") + ENTRY
    assert out.read_text(encoding="utf-8") == ENTRY
    warned = told(BURGER, setting=SETTING._replace(localisation=None))
    assert warned.endswith(
        ENTRY + "# odometry does not see wheels that slip: measure where it really ends, or give --pose\n"
    )


def test_a_file_that_is_there_is_left_alone_and_what_was_measured_is_told(tmp_path: Path) -> None:
    (out := tmp_path / "mixed.yaml").write_text("name: mixed\n")
    lines: list[str] = []
    with pytest.raises(ConfigError) as refused:
        tell_result(measured(), SETTING, 0.3, BURGER, out, lines.append)
    assert (
        str(refused.value)
        == f"--out {out}: expected a new file that can be written, got: File exists; name another one"
    )
    assert out.read_text() == "name: mixed\n"
    assert "    track_width: 0.500" in lines


# the kind, what was measured otherwise, and the body that a fleet plans with: radius, track width, acceleration, speed
ENTRIES: list[tuple[SquareKind, dict[str, Any], tuple[float, float, float, float]]] = [
    (BURGER, {}, (0.105, 0.5, 0.5, 0.3)),
    (SquareKind("1.5"), {}, (0.2, 0.5, 0.5, 0.3)),
    (SquareKind("on"), {"top_speed": 9.0}, (0.2, 0.5, 0.5, 4.0)),
    (SquareKind("a:b", 0.4), {"acceleration": 0.25}, (0.4, 0.5, 0.25, 0.3)),
    (SquareKind("-"), {"braking": 0.001}, (0.2, 0.5, 0.01, 0.3)),
    (SquareKind("turtle_3"), {"acceleration": None, "braking": None}, (0.2, 0.5, 2.0, 0.3)),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "changed", "body"), ENTRIES, ids=[entry[0].name for entry in ENTRIES])
def test_what_was_measured_is_what_the_fleet_plans_with(
    kind: SquareKind, changed: dict[str, Any], body: tuple[float, float, float, float]
) -> None:
    entry = yaml.safe_load("\n".join(format_kind_entry(kind, measured()._replace(**changed), WIDTH)))
    settings = scenario_of(**entry, robots={kind.name: 1}).settings
    own = settings_of(settings, kind.name).robot
    assert (own.radius, own.track_width, own.wheel_acceleration, own.top_speed) == pytest.approx(body, abs=0.01)
    driver = RosBody(SETTING._replace(scan=None, track_width=None), settings_of(settings, kind.name), 0.0)
    assert driver.compute_twist(0.0)[0] == Twist(0.0, 0.0)


# the words behind `swarm bridge ros2`, and what is said
WRONG = {
    "--kind cart": "--kind: expected --body ROBOT too, got none; name the robot of the fleet",
    "--body r2 --kind cart": "--kind: expected --square too, got none: a kind is made of what a square shows; drive one",
    "--body r2 --square --track-width 0.2 --radius 0.1": "--radius: expected --kind NAME too, got none; name the kind that the robot is to be",
    "--body r2 --square --track-width 0.2 --out new.yaml": "--out: expected --kind NAME too, got none; name the kind that the robot is to be",
    "--body r2 --square --track-width 0.2 --kind a/b": "--kind: expected 1 to 64 letters, digits or _ . : -, got 'a/b'; choose another name",
    "--body r2 --square --track-width 0.2 --kind cart --radius 9": "--radius: expected 0.01 to 5, got '9'",
    "--body r2 --square --track-width 0.2 --kind cart --out there.yaml": "--out there.yaml: expected a new file, got one that is there; name another one",
    "--body r2 --square --track-width 0.2 --kind cart --out no/new.yaml": "--out no/new.yaml: expected a folder no, found none; make it first",
}


@pytest.mark.parametrize("words", WRONG)
def test_wrong_words_about_a_kind_are_one_sentence(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.yaml").touch()
    assert main(["bridge", "ros2", *words.split()]) == 2
    assert capsys.readouterr().err == f"swarm: {WRONG[words]}\n"
