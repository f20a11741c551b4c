"""What a request for another set-up makes of a fleet's options; no process is started."""

from collections.abc import Callable
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import msgspec
import pytest

from swarm.bus.codec import decode, encode
from swarm.errors import ConfigError
from swarm.launch.options import Options, ready
from swarm.launch.setup import answer_setup, as_set, change_options
from swarm.messages import DRAWING_LIMIT, SETUP, Accepted, Clock, Phase, Setup
from swarm.scenario.load import Scenario, load
from swarm.scenario.shipped_scenarios import file_of, shipped_scenarios
from swarm.scenario.starts import starts
from tests.launch.actors import SMALL


def options_of(scenario: Scenario, **given: Any) -> Options:  # noqa: ANN401
    return replace(Options(scenario=scenario, robots=scenario.settings.count, pace="max"), **given)


@pytest.fixture
def small_fleet(tmp_path: Path) -> Options:
    (path := tmp_path / "small.yaml").write_text(SMALL + "seed: 7\nrobots: 2\n")
    return ready(options_of(load(path)))


def missions(options: Options) -> list[Any]:
    """Return start and stops of each robot."""
    poses = starts(options.scenario, options.robots, options.seed)
    return [(pose, options.scenario.stops(number, pose[:2])) for number, pose in enumerate(poses)]


def without_start(scenario: Scenario) -> dict[str, Any]:
    raw: dict[str, Any] = msgspec.to_builtins(scenario.settings)
    kinds = {name: kind | {"start": None} for name, kind in raw["kinds"].items()}  # they are in the scenario's start
    return raw | {"start": None, "kinds": kinds}


@pytest.mark.parametrize("name", shipped_scenarios())
def test_the_set_up_that_a_fleet_tells_sets_up_the_same_mission(name: str) -> None:
    before = ready(options_of(load(file_of(name))))
    told = decode(encode(as_set(before)), Setup, SETUP.limit)
    after = change_options(told, before)
    assert (after.robots, after.seed, after.limit) == (before.robots, before.seed, before.limit)
    assert missions(after) == missions(before)
    assert without_start(after.scenario) == without_start(before.scenario)
    assert after.scenario.map.cells.tobytes() == before.scenario.map.cells.tobytes()
    assert (after.scenario.settings.start.circle is None) == (before.scenario.settings.start.circle is None)


def test_the_running_scenario_named_again_keeps_its_robots(small_fleet: Options) -> None:
    three = change_options(Setup(scenario=None, robots=3), small_fleet)
    assert change_options(Setup(scenario="small"), three).robots == 3
    assert change_options(Setup(scenario="small", speed=0.3), three).robots == 3
    assert change_options(Setup(scenario="small", robots=1), three).robots == 1


# fmt: off
NUMBERS: dict[str, tuple[dict[str, Any], Callable[[Options], Any]]] = {  # given on the command line: expected of "paper"
    "nothing":  ({},                    lambda paper: (paper.scenario.settings.seed, paper.scenario.settings.limit)),
    "a seed":   ({"asked_seed": 42},    lambda paper: (42, paper.scenario.settings.limit)),
    "a limit":  ({"asked_limit": 99.0}, lambda paper: (paper.scenario.settings.seed, 99.0)),
}
# fmt: on


@pytest.mark.parametrize("name", NUMBERS)
def test_seed_and_limit_are_those_of_the_named_scenario_unless_they_were_given(name: str, small_fleet: Options) -> None:
    given, expected = NUMBERS[name]
    paper = change_options(Setup(scenario="paper"), replace(small_fleet, **given))
    assert paper.scenario.settings.seed != 7
    assert (paper.seed, paper.limit) == expected(paper)


def test_a_fleet_that_stays_has_no_limit_of_its_own(tmp_path: Path) -> None:
    (path := tmp_path / "small.yaml").write_text(SMALL)
    stays = ready(options_of(load(path, serve=True)))
    paper = change_options(Setup(scenario="paper"), stays)
    assert (stays.limit, paper.limit, paper.scenario.settings.serve) == (inf, inf, True)


def test_no_file_of_the_working_directory_is_read_for_a_request(
    small_fleet: Options, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("paper", "secret.yaml"):
        Path(name).write_text("name: secret\n")
    assert change_options(Setup(scenario="paper"), small_fleet).scenario.settings.name == "paper"
    with pytest.raises(
        ConfigError, match=r"setup: scenario: expected one that comes with the project, got 'secret.yaml'"
    ):
        change_options(Setup(scenario="secret.yaml"), small_fleet)


def test_a_drawing_that_is_too_large_to_tell_is_kept_in_a_request(tmp_path: Path) -> None:
    side = round(DRAWING_LIMIT**0.5) + 10
    lines = ["#" * side, *["#" + "." * (side - 2) + "#"] * (side - 2), "#" * side]
    drawing = "\n".join(f"    {line}" for line in lines)
    (path := tmp_path / "large.yaml").write_text(
        f"name: large\nmap:\n  cell: 0.5\n  text: |\n{drawing}\n"
        "start: {poses: [[2.5, 2.0, 0.0]]}\ntargets: [[9.5, 2.0]]\ntraffic: {cell: 1.5, offset: [0.0, 0.0]}\n"
    )
    large = ready(options_of(load(path)))
    told = decode(encode(as_set(large)), Setup, SETUP.limit)
    assert (told.map, told.cell) == (None, None)
    assert change_options(told, large).scenario.map.shape == (side, side)


class Asked:
    """A request whose answer is kept."""

    def __init__(self, message: Setup) -> None:
        self.message, self.answer = message, ""

    def accept(self, reply: Accepted) -> None:
        self.answer = reply.text

    def refuse(self, reason: str) -> None:
        self.answer = reason


def clock(phase: Phase) -> Clock:
    return Clock(run=4, tick=0, time=0.0, phase=phase, robots=["r1"], present=[])


# fmt: off
ANSWERS: dict[str, tuple[Setup, Clock | None, int, str]] = {  # request, the world's clock, robots added: answer
    "waits":      (Setup(scenario=None, robots=3), clock(Phase.WAITING), 0, "small with 3 robots is set up; it waits for go"),
    "paused":     (Setup(scenario=None, robots=1), clock(Phase.PAUSED),  0, "small with 1 robot is set up; it waits for go"),
    "with added": (Setup(scenario=None, robots=1), clock(Phase.PAUSED),  2,
                   "small with 1 robot is set up; it waits for go. It is without the 2 robots added to the fleet before; add them again"),
    "runs":       (Setup(scenario=None, robots=3), clock(Phase.RUNNING), 0,
                   "setup: expected a run that waits or is paused, got one that is running; pause it first"),
    "no world":   (Setup(scenario=None, robots=3), None,                 0,
                   "setup: expected a run that waits or is paused, got no world that answers; pause it first"),
}
# fmt: on


@pytest.mark.parametrize("name", ANSWERS)
def test_a_request_is_answered_with_a_sentence(name: str, small_fleet: Options) -> None:
    message, told, added, sentence = ANSWERS[name]
    asked: Any = Asked(message)
    another = answer_setup(asked, small_fleet, lambda: told, added)
    assert asked.answer == sentence
    assert (None if another is None else another.run) == (5 if "is set up" in sentence else None)


def test_the_phase_is_asked_for_after_everything_else_is_checked(small_fleet: Options) -> None:
    asked: Any = Asked(Setup(scenario=None, robots=9))

    def never() -> None:
        raise AssertionError("the clock was asked for, though the set-up is wrong")

    assert answer_setup(asked, small_fleet, never) is None
    assert "start.poses: expected at least 9 poses" in asked.answer
