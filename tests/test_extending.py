"""Each walk of docs/extending.md, followed: its files are written, its changes made in a copy of the code, and tried."""

import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

from swarm.cli import main
from swarm.errors import ConfigError
from swarm.fuzzy import Controller, load_profile
from swarm.scenario.load import load
from swarm.storm.plans.plan import read
from tests.shared import ROOT
from world.faults import Faults, Health, Spell
from world.simulate import Simulation

PAGE: Final = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
BLOCK: Final = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
WALKS: Final = {  # title: language: the block in it
    walk.split("\n", 1)[0]: dict(BLOCK.findall(walk)) for walk in PAGE.split("\n## ")[1:]
}
ROOMS: Final = ("swarm", "world", "dashboard", "docs")


def apply(walk: str, folder: Path, *how: str) -> str:
    """Apply the diff of a walk to the code in a folder, as the page says; return what git has against it."""
    done = subprocess.run(
        ["git", "apply", *how], input=WALKS[walk]["diff"], cwd=folder, capture_output=True, text=True, timeout=60
    )
    return done.stderr if done.returncode else ""


def copy_of_the_code(folder: Path) -> Path:
    """Copy the code, with what numba has compiled."""
    for room in ROOMS:
        shutil.copytree(ROOT / room, folder / room, ignore=shutil.ignore_patterns("pictures"))
    return folder


def follow(walk: str, folder: Path) -> None:
    """Make a walk's changes in a folder; those of who has made them in this checkout are there already."""
    if apply(walk, folder, "--reverse", "--check"):
        assert not (fault := apply(walk, folder)), f"the walk '{walk}' has to follow the code: {fault}"


DIFFS: Final = [walk for walk in WALKS if "diff" in WALKS[walk]]


def test_the_changes_of_the_page_are_taken_by_git_and_found_again(tmp_path: Path) -> None:
    """Whoever follows the page in a checkout has the changes there: they are no reason for a red test."""
    code = copy_of_the_code(tmp_path)
    for walk in DIFFS:
        follow(walk, code)
        before = {file: file.read_bytes() for file in code.rglob("*.py")}
        follow(walk, code)
        assert {file: file.read_bytes() for file in code.rglob("*.py")} == before


def followed(walk: str, tmp_path: Path, code: str) -> str:
    """Make a walk's changes in a copy of the code, run some Python there, and return what it prints."""
    follow(walk, copy_of_the_code(tmp_path))
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


# ---- a behaviour

SCENARIO: Final = """\
name: mine
controller: bumper.yaml
map: {cell: 1.0, text: "##########\\n#........#\\n#........#\\n#........#\\n##########"}
start: {poses: [[1.5, 2.5, 1.57]]}
targets: [[7.5, 2.5]]
return_home: false
"""


def test_a_profile_of_ones_own_drives_a_robot_to_its_stop(tmp_path: Path) -> None:
    (tmp_path / "bumper.yaml").write_text(WALKS["A behaviour"]["yaml"])
    (tmp_path / "mine.yaml").write_text(SCENARIO)
    (tmp_path / "paper.yaml").write_text(SCENARIO.replace("bumper.yaml", "paper"))
    mine, papers = (Simulation.of(load(tmp_path / name), 1, 1).run(60.0) for name in ("mine.yaml", "paper.yaml"))
    assert mine["complete"]
    assert mine["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert mine["digest"] != papers["digest"]


def test_a_profile_of_ones_own_is_explained_as_the_walk_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bumper.yaml").write_text(WALKS["A behaviour"]["yaml"])
    (command,) = re.findall(r"`swarm (explain [^`]+)`", PAGE)
    assert main(command.split()) == 0
    assert "rule  4: IF front_obs is near THEN left_v is fast AND right_v is slow" in capsys.readouterr().out
    left, right = Controller(load_profile("bumper.yaml")).wheel_speeds(1.0, 0.5, 1.0, 20.0)
    assert left > right, "it turns right where something is ahead"


def test_a_profile_with_a_gap_is_refused(tmp_path: Path) -> None:
    rules = WALKS["A behaviour"]["yaml"].splitlines(keepends=True)
    path = tmp_path / "bumper.yaml"
    path.write_text("".join(line for line in rules if not line.lstrip().startswith("4 ")))
    with pytest.raises(ConfigError, match="no rule fires at"):
        load_profile(path)


# ---- a message

MESSAGE: Final = """
import threading
from time import monotonic
from docs import fields
from swarm.bus import Arrival, Bus, Endpoint
from swarm.bus.codec import decode, encode
from swarm.bus.router import run
from swarm.errors import PeerError
from swarm.messages import BATTERY, Battery

full = Battery(robot="r1", lasts=1800.0)
assert decode(encode(full), Battery, BATTERY.limit) == full
try:
    decode(encode(Battery(robot="r1", lasts=-1.0)), Battery, BATTERY.limit)
except PeerError as fault:
    print("refused:", fault)
assert "`robot/{robot}/battery`" in fields.topics() and "### Battery" in fields.messages()

place, over = Endpoint("127.0.0.1", 0).claim(), threading.Event()
router = threading.Thread(target=run, args=(place, over.wait))
router.start()
try:
    with Bus(place, "walk", log=str) as listener, Bus(place, "walk") as robot:
        listener.listen(BATTERY)
        heard, deadline = None, monotonic() + 60.0
        while (heard is None or not listener.refused_counts) and monotonic() < deadline:  # a busy machine may drop one
            robot.send(BATTERY, full, robot="r2")  # in another robot's key
            robot.send(BATTERY, full, robot="r1")
            arrived = listener.receive(0.1)
            heard = arrived if isinstance(arrived, Arrival) else heard
        print("heard:", heard.ids["robot"], heard.message.lasts, list(listener.refused_counts))
finally:
    over.set()
    router.join()
"""


@pytest.mark.processes
def test_a_message_of_ones_own_crosses_the_bus_and_is_checked(tmp_path: Path) -> None:
    refused, heard = followed("A message", tmp_path, MESSAGE).splitlines()
    assert refused == "refused: battery: lasts: expected float >= 0.0, got -1.0"
    assert heard == "heard: r1 1800.0 ['robot/{robot}/battery']"


# ---- a sensor

SENSOR: Final = """
from pathlib import Path
from swarm.bus.codec import decode, encode
from swarm.messages import Sense
from swarm.scenario.load import load
from world.simulate import Simulation

run = Simulation.of(load(Path("room.yaml")), 1, 1)
sense = run.step().senses["r1"]
assert decode(encode(sense), Sense, 16_384) == sense
print(round(sense.rear, 6), run.run(60.0)["digest"])
"""


@pytest.mark.long("starts another Python and compiles; tests/world/bodies/test_sensing.py has the sensors")
def test_a_sensor_of_ones_own_reads_what_is_behind_and_changes_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "room.yaml").write_text(SCENARIO.replace("bumper.yaml", "paper").replace("1.5, 2.5, 1.57", "2, 2.5, 0"))
    rear, digest = followed("A sensor", tmp_path, SENSOR).split()
    assert float(rear) == pytest.approx(2.0 - 1.0 - 0.2), "from the robot's edge to the wall"
    assert digest == Simulation.of(load(tmp_path / "room.yaml"), 1, 1).run(60.0)["digest"]


# ---- a fault


def test_a_plan_file_holds_a_robot_up_and_a_storm_judges_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "held-up.yaml").write_text(WALKS["A fault"]["yaml"])
    assert main(["storm", "held-up.yaml", "--jobs", "1"]) == 0
    assert "held up" in capsys.readouterr().out
    plan = read(tmp_path / "held-up.yaml")
    faults = Faults(spells=(Spell("r1", Health.HELD_UP, 60, 60),))
    assert plan.to_faults().spells == faults.spells, "the Python of the page says the same"
    run = Simulation.of(plan.to_scenario(), 2, seed=1, faults=faults)
    commands = [run.step().commands["r1"] for _ in range(150)]
    stood = [tick for tick, command in enumerate(commands) if command.left == command.right == 0.0]
    assert set(range(60, 120)) <= set(stood)
    assert 59 not in stood
    assert 120 not in stood


FAULT: Final = """
from pathlib import Path
from swarm.cli import main
from swarm.storm.plans.plan import read
from swarm.launch.storm import only_simulated
from world.simulate import Simulation

plan = read(Path("mute.yaml"))
run = Simulation.of(plan.to_scenario(), 2, 1, plan.to_faults())
ticks = [run.step() for _ in range(150)]
spoke = [number for number, tick in enumerate(ticks) if "r1" in tick.spoken]
heard = [number for number, tick in enumerate(ticks) if any(name == "r1" for name, _ in tick.senses["r2"].hears)]
print(len([n for n in spoke if 60 <= n < 120]), len([n for n in heard if 61 <= n < 121]), max(spoke) > 120)
print(all("r1" in tick.commands for tick in ticks), only_simulated(plan))
print(main(["storm", "mute.yaml", "--jobs", "1"]))
"""


@pytest.mark.long("starts another Python and compiles; tests/storm/test_mute_robots.py has mute robots")
def test_a_fault_of_ones_own_mutes_a_robot(tmp_path: Path) -> None:
    (tmp_path / "mute.yaml").write_text(WALKS["A fault"]["yaml"].replace("held_up", "mute"))
    first, second, *summary = followed("A fault", tmp_path, FAULT).splitlines()
    assert first == "0 0 True", "it neither speaks nor is heard from tick 60 to 119, and speaks again"
    assert second == "True only the simulation has robots that are mute"
    assert summary[-1] == "0"
    assert any("mute" in line for line in summary)
