"""The commands of README.md and docs/*.md do what the pages say: each line of an ``sh`` block is run in a folder of its own.

Only what ``PARSED`` lists is not run: its flags are checked, and the table says why that is all.
"""

import argparse
import importlib
import importlib.util
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from shutil import copytree
from typing import Final

import pytest
import yaml

from swarm.cli import main
from swarm.cli.argument_parser import point
from swarm.messages import Edit, Kind
from swarm.scenario.load import load
from swarm.scenario.shipped_scenarios import file_of
from swarm.settings import TAPE
from tests.launch.actors import Fleet
from tests.shared import PAPER, ROOT
from world.simulate import Simulation
from world.tasks.edit_cuts import find_cut_targets

PAGES: Final = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
BLOCK: Final = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SPAN: Final = re.compile(r"`((?:swarm|python -m|make) [a-z][^`]*)`")
STARTS: Final = ("swarm ", "python ", "make ", "docker ", "$ ")

STORY: Final = (  # of docs/black-box.md
    "swarm run paper --robots 8 --pace max --dashboard off --record run.swarm",
    "swarm run changed.yaml --robots 8 --pace max --dashboard off --record changed.swarm",
)

# fmt: off
PARSED: Final = {  # command: why it is not run
    "make run":    "opens a viewer and drives for two minutes; a quicker `swarm run paper` is run",
    "make test":   "would run this test",
    "swarm run MAP.map --scen FILE.scen --robots 16":
                   "stands for files of the MAPF benchmarks, which are not here",
    "swarm plan maze512-4-0.map --scen maze512-4-0.map.scen --json":
                   "the file is one of MovingAI's, which are not here",
    **{f"swarm bench scale{more}": "runs fleets for minutes; tests/cli runs the command, tests/test_scale_benchmark.py the tables"
       for more in ("", " -- --realtime", " -- --lockstep --only paper", " -- --wire")},
    "swarm router": "would take the port 7447 of this machine; tests/deploy/test_compose.py runs these processes",
    "swarm router --listen tcp/0.0.0.0:7447 --insecure": "the same",
    "swarm router --listen tcp/127.0.0.1:7447": "the same",
    "swarm world paper --robots 4 --seed 1 --pace max --fleet mine --report run.json":
                   "waits for a robot of another make; tests/launch/test_foreign_robot.py runs these processes with one",
    "swarm robot --id r1 --fleet mine": "the same",
    "swarm run paper --robots 4 --secure keys":
                   "needs keys from the command before; tests/secure/test_processes.py runs a fleet with keys",
    **{command + " --secure hosts": "the same" for command in (
        "swarm router --listen tls/0.0.0.0:7447",
        "swarm world paper --robots 4 --connect tls/ROUTER:7447 --fleet NAME",
        "swarm robot --id r1 --connect tls/ROUTER:7447 --fleet NAME",
    )},
    "swarm world paper --robots 4 --connect tcp/ROUTER:7447 --fleet NAME": "the same",
    "swarm robot --connect tcp/ROUTER:7447 --fleet NAME": "the same",
    "swarm robot --count 3 --connect tcp/ROUTER:7447 --fleet NAME": "the same; tests/launch/test_hosted.py runs it",
    "python -m dashboard --connect tcp/ROUTER:7447 --fleet NAME --web": "the same",
    "python -m dashboard --connect tcp/HOST:PORT --fleet NAME --web --record FILE.rrd":
                   "the same; tests/dashboard/test_process.py runs the dashboard",
    **dict.fromkeys((
        "ROBOTS=4 docker compose up --build --detach",
        "docker compose logs --follow world",
        "ROBOTS=4 docker compose up --build --exit-code-from world",
    ), "needs a container engine; tests/deploy runs it where there is one"),
    "kubectl apply --kustomize deploy/kubernetes": "needs a cluster; tests/deploy/test_kubernetes.py judges the manifests",
    "swarm router --listen tcp/0.0.0.0:7447 --insecure --join tcp/HOST-A:7447":
                   "stands for another host; tests/deploy/test_routers.py runs it with two and three",
    "swarm replay run.swarm --rrd run.rrd": "reads the tape of another command; tests/dashboard/test_taped.py runs it",
    "swarm replay run.swarm --mcap run.mcap": "the same; tests/dashboard/test_mcap.py runs it",
    **{f"swarm replay run.swarm{more}": "the same; tests/blackbox/replay/test_processes.py runs it" for more in ("", " --laws")},
    "swarm run office": "drives for two minutes; the same",
    "swarm bridge foxglove": "goes on until the run is over; tests/bridge/foxglove/test_process.py runs it",
    "swarm run office --serve --port 7447 --bridge ros2": "goes on until it is stopped; the next one's test runs it",
    "swarm run office --serve": "goes on until it is stopped; the same",
    "swarm bridge ros2 --dialect ros2dds --clock wall": "goes on until the run is over; tests/bridge/ros2/test_actions_live.py runs it",
    "swarm run paper --pace 4 --dashboard off --record run.mcap": "drives for half a minute; tests/bridge/foxglove/test_recorded.py runs it",
    "swarm bridge vda5050": "goes on until the run is over; tests/bridge/vda5050/test_process.py runs it",
    "swarm bridge ros2": "goes on until the run is over; tests/bridge/ros2/test_process.py runs it",
    **dict.fromkeys((
        "swarm run paper --robots 4 --body r2 --pace realtime",
        "swarm bridge ros2 --body r2 --pose /r2/amcl_pose --scan /r2/scan",
        "swarm bridge ros2 --body r2 --square 1 --speed 0.2 --track-width 0.16 --pose /r2/amcl_pose",
    ), "needs a robot of ROS; tests/bridge/body/test_process.py runs it with one"),
    "swarm why r5 run.swarm --at 7.5 --prove": "the same; tests/blackbox/explain asks tapes, and a transcript is run",
    "swarm why r3 run.swarm --at 12": "the same",
    "swarm why r3": "asks a fleet that runs; tests/blackbox/explain/test_processes.py does",
    "swarm diff run.swarm other.swarm": "the same; tests/blackbox/explain/test_parting.py compares tapes",
    "swarm diff before.swarm after.swarm": "the same",
    "swarm analyze run.swarm": "the same; tests/launch/test_analyze.py runs it",
    "swarm run paper --robots 4 --pace max --record run.swarm": "drives for two minutes; the same",
    **dict.fromkeys(STORY, "the transcripts of docs/black-box.md are of what it records"),
    "swarm ls --connect tcp/ROUTER:7447": "stands for a router elsewhere; tests/cli/test_watching.py runs it",
    "swarm watch": "goes on until the run is over; tests/cli/test_watching.py runs it",
    "swarm logs r1 --follow": "goes on until the run is over; tests/cli/test_looking.py runs it",
    "swarm order r1 4,3 6,3 --wait": "stays until the robot is there; the same",
    "swarm box":   "stays until it is stopped; tests/dashboard/box/test_page.py runs its fleet",
    "swarm run paper --dashboard box": "drives for two minutes; the same",
    "docker compose run --build --rm keys": "the same",
    "docker compose up --build --exit-code-from secure-world secure-world": "the same",
}
FLEET: Final = "swarm run office --wait"  # runs meanwhile; these talk to it:
TALK: Final = (
    "swarm go", "swarm status", "swarm edit ", "swarm stop", "swarm ls", "swarm topics", "swarm hz ", "swarm echo ",
    "swarm logs",
)
SHORTER: Final = {  # command: what makes it short enough to be run
    "swarm run paper --robots 8 --pace max --dashboard off --report run.json": "--robots 2",
    "swarm run paper --robots 8 --pace max --dashboard off --robots-per-process 4": "--robots 3 --robots-per-process 2",
    "swarm run doorway --robots 8 --pace max --dashboard off": "--robots 2",
    "swarm run mixed --robots cart=2,scout=6":         "--robots cart=1,scout=1 --pace max --dashboard off",
    "swarm storm":                                     "--seeds 2 --jobs 1",
    "swarm storm --seeds 100":                         "--seeds 1 --jobs 1",
    "swarm storm --seeds 500:600 --profile dead,late": "--seeds 500:501 --jobs 1",
    "swarm storm --seeds 2000 --start 7000 --results found.jsonl --plans found/ --json": "--seeds 1 --jobs 1",
    "swarm storm --twice":                             "--seeds 1 --jobs 1",
    "swarm storm --over processes --profile calm":     "--seeds 1 --jobs 1",
    "swarm drill":                                     "--row report-full-disk",
    "swarm drill --json":                              "--row hang-up",
    "swarm drill --keep failed":                       "--row report-full-disk",
    "swarm drill --row robot-killed --repeat 20":      "--repeat 1",
}
SLOW: Final = ("swarm run paper", "swarm run doorway", "swarm run mixed", "swarm storm", "swarm drill")  # but for what only prints or reads one plan
# fmt: on


def commands_of(*pages: Path) -> list[str]:
    """Collect every line of every sh block of pages, without its comment; each command once."""
    found: dict[str, None] = {}
    for page in pages:
        for language, text in BLOCK.findall(page.read_text(encoding="utf-8")):
            if language == "sh":
                found |= {line.split(" #")[0].strip(): None for line in text.splitlines() if line.strip()}
    return list(found)


COMMANDS: Final = commands_of(*PAGES)
RUN: Final = [one for one in COMMANDS if one not in PARSED and one != FLEET and not one.startswith(TALK)]


def marked(command: str) -> object:
    slow = command.startswith(SLOW) and not {"--show", "--list"} & set(command.split())
    return pytest.param(command, marks=[pytest.mark.long("drives a whole run"), pytest.mark.processes] if slow else [])


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with the files that commands name. No other fleet of this machine is seen in it."""
    copytree(ROOT / "tests" / "storm", tmp_path / "tests" / "storm")
    (tmp_path / "fleets").mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "fleets"))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def started(command: str, more: str = "") -> list[str]:
    """Return the words of a command as this Python runs them."""
    first, *rest = shlex.split(f"{command} {more}")
    return [sys.executable, *(["-m", "swarm.cli"] if first == "swarm" else []), *rest]


@pytest.mark.parametrize("command", [marked(command) for command in RUN])
def test_a_command_of_the_pages_does_what_it_says(command: str, folder: Path) -> None:
    words = started(command, SHORTER.get(command, ""))
    done = subprocess.run(words, capture_output=True, text=True, timeout=250, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout or done.stderr
    for option, file in re.findall(r"(--report|--results) (\S+)", command):
        assert (folder / file).stat().st_size, f"{option} wrote nothing"


@pytest.mark.processes
@pytest.mark.costs("each command is a process of its own, beside a fleet")
def test_the_commands_that_talk_to_a_fleet_are_answered(folder: Path) -> None:
    talk = [command for command in COMMANDS if command.startswith(TALK) and command not in PARSED]
    assert {command.split()[1] for command in talk} == {
        "go", "status", "edit", "stop", "ls", "topics", "hz", "echo", "logs",
    }  # fmt: skip
    talk.sort(key=lambda command: command == "swarm stop")  # ground.md edits a fleet too
    scenario, *arguments = FLEET.removeprefix("swarm run ").split()
    with Fleet(Path(scenario), *arguments, "--pace", "0.2", runtime=folder / "fleets") as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        for command in ["swarm status", *talk]:
            done = subprocess.run(started(command), capture_output=True, text=True, timeout=60, check=False)
            assert done.returncode == 0, f"{command}: {done.stderr}"
        assert fleet.end() == 1, "README: 1, the mission is not complete"
        assert "not complete: stopped by command" in fleet.text


@pytest.mark.parametrize("scenario", ["paper", FLEET.split()[2]])
def test_the_edit_of_the_readme_leaves_nobody_without_a_way(scenario: str) -> None:
    (line,) = [command for command in commands_of(ROOT / "README.md") if command.startswith("swarm edit")]
    kind, *corners = line.split()[2:]
    low, high = map(point, corners)
    world = Simulation.of(load(file_of(scenario)), 4, 1).world
    assert find_cut_targets(world.tasks, world.bodies, Edit(kind=Kind(kind), low=low, high=high), sensed=False) == (
        True,
        [],
    )


class Parsed(Exception):  # noqa: N818, no error
    """The command line is right."""


@pytest.mark.parametrize("command", PARSED)
def test_a_command_that_is_not_run_is_right_as_far_as_it_can_be_told(
    command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    parse = argparse.ArgumentParser.parse_args

    def only_parse(*given: object, **named: object) -> None:
        parse(*given, **named)  # type: ignore[call-overload]
        raise Parsed

    words = shlex.split(command)
    if words[0] == "make":
        dry = subprocess.run([*words, "--dry-run"], cwd=ROOT, capture_output=True, text=True, check=False)
        assert dry.returncode == 0, dry.stderr
        return
    monkeypatch.setattr(argparse.ArgumentParser, "parse_args", only_parse)
    if words[0] == "swarm":
        with pytest.raises(Parsed):
            main(words[1:])
    elif words[0] == "python":
        monkeypatch.setattr(sys, "argv", words[2:])
        with pytest.raises(Parsed):
            importlib.import_module(f"{words[2]}.__main__").main()
    elif words[0] == "kubectl":
        assert (ROOT / words[-1] / "kustomization.yaml").is_file()
    else:
        compose = (ROOT / "compose.yaml").read_text(encoding="utf-8")
        services = re.findall(r"(?:--follow|--exit-code-from|--rm) (\w[\w-]*)", command)
        assert services or words[-1] == "--detach"
        assert set(services) <= set(yaml.safe_load(compose)["services"])
        assert "${ROBOTS:-" in compose


def test_the_tables_name_only_commands_that_the_pages_have() -> None:
    assert {*PARSED, *SHORTER, FLEET} - set(COMMANDS) == set()


def others() -> Iterator[tuple[str, str]]:
    """Return the blocks that are not `sh`, each with the name of its page."""
    for page in PAGES:
        for language, text in BLOCK.findall(page.read_text(encoding="utf-8")):
            if language not in {"sh", "console"}:
                yield page.name, text


def test_no_command_hides_in_another_kind_of_block() -> None:
    hidden = [(page, line) for page, text in others() for line in text.splitlines() if line.startswith(STARTS)]
    assert hidden == []


TRANSCRIPTS: Final = [
    text
    for page in PAGES
    for language, text in BLOCK.findall(page.read_text(encoding="utf-8"))
    if language == "console"
]


@pytest.fixture
def tapes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with the two tapes of docs/black-box.md, recorded as that page says."""
    folder = tmp_path_factory.mktemp("tapes")
    scenario, rules = (
        file.read_text(encoding="utf-8") for file in (PAPER, ROOT / "swarm" / "fuzzy" / "profiles" / "paper.yaml")
    )
    changed = re.sub(r"(24 +far +medium +far +any +)medium( +)fast", r"\1slow\2medium", rules)
    assert changed != rules
    (folder / "mine.yaml").write_text(changed, encoding="utf-8")
    (folder / "changed.yaml").write_text(scenario.replace("controller: paper", "controller: mine.yaml"))
    for command in STORY:
        subprocess.run(
            [sys.executable, "-m", "swarm.cli", *command.split()[1:]], cwd=folder, check=True, stdout=subprocess.DEVNULL,
            env=os.environ | {"XDG_RUNTIME_DIR": str(folder), "PYTHONPATH": str(ROOT)},
        )  # fmt: skip
    return folder


def assert_it_prints(transcript: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Run the command of a transcript. What comes after a last line of three dots is left out on the page."""
    command, _, output = transcript.partition("\n")
    assert main(shlex.split(command.removeprefix("$ swarm "))) == command.startswith("$ swarm diff "), command
    said, shown = capsys.readouterr().out, output.removesuffix("...\n")
    assert said[: len(shown)] == shown
    assert len(said) == len(shown) or shown != output


@pytest.mark.parametrize(
    "transcript", [pytest.param(text, id=text.splitlines()[0]) for text in TRANSCRIPTS if TAPE not in text]
)
def test_a_transcript_is_what_the_command_prints(transcript: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert_it_prints(transcript, capsys)


@pytest.mark.long("two missions are recorded")
@pytest.mark.processes
def test_transcripts_of_tapes_are_what_the_commands_print(
    tapes: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tapes)
    of_tapes = [text for text in TRANSCRIPTS if TAPE in text]
    assert of_tapes
    for transcript in of_tapes:
        assert_it_prints(transcript, capsys)


NAMED: Final = sorted(
    {
        tuple(span.replace("python -m ", "python ").split()[:2])
        for page in PAGES
        for span in SPAN.findall(page.read_text(encoding="utf-8"))
    }
)


@pytest.mark.parametrize(("first", "name"), NAMED)
def test_a_command_named_in_a_sentence_exists(first: str, name: str) -> None:
    if first == "make":
        assert re.search(rf"^{name}:", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    elif first == "python":
        assert importlib.util.find_spec(name) is not None
    else:
        with pytest.raises(SystemExit) as ended:
            main([name, "--help"])
        assert ended.value.code == 0
