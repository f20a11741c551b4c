"""The short examples, each with zenoh and msgpack only, against a live fleet."""

import ast
import json
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Final

import pytest

from swarm.bus import Bus, Endpoint
from swarm.cli import main
from swarm.messages import ACTION, EVENT, ROBOT_ACTION, SENSE, Action, Do, RobotAction, RobotDo, Sense
from tests.launch.actors import FAREWELL, LONGEST, SMALL, Command, Fleet, await_event, await_message, await_presence
from tests.shared import ROOT

EXAMPLES: Final = sorted((ROOT / "examples").glob("*.py"))
HOLDS_NOTHING = ("no hold without a claim", "no body outside")  # laws that a robot breaks which is driven by keys


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda path: path.name)
def test_an_example_imports_nothing_of_this_project_and_is_named_on_the_page(file: Path) -> None:
    tree = ast.parse(file.read_text(encoding="utf-8"))
    names = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    names |= {str(node.module) for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert {name.split(".")[0] for name in names} - set(sys.stdlib_module_names) == {"msgpack", "zenoh"}
    assert f"(../examples/{file.name})" in (ROOT / "docs" / "integration.md").read_text(encoding="utf-8")


@contextmanager
def started_at(endpoint: Endpoint, fleet: str, name: str, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """Start an example at a fleet; end it if it is still there."""
    command = [sys.executable, str(ROOT / "examples" / name), str(endpoint), fleet, *arguments]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as started:
        try:
            yield started
        finally:
            if started.poll() is None:
                started.kill()


def example(fleet: Fleet, name: str, *arguments: str) -> AbstractContextManager[subprocess.Popen[str]]:
    """Start an example at the fleet of `swarm run`."""
    return started_at(fleet.endpoint, fleet.name, name, *arguments)


def read_to(started: subprocess.Popen[str], part: str) -> str:
    """Return what an example prints up to a line that holds ``part``."""
    assert started.stdout is not None
    lines = []
    for line in started.stdout:
        lines.append(line)
        if part in line:
            return "".join(lines)
    raise AssertionError(f"it ended without saying {part!r}:\n" + "".join(lines))


@pytest.mark.processes
def test_send_waits_until_the_robot_is_there_and_may_be_run_again(small: Path, tmp_runtime: Path) -> None:
    with Fleet(small, "--pace", "max", "--wait", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        with (
            example(fleet, "send.py", "r1", "tea", "9.5,4.0", "2.5,6.0") as one,
            example(fleet, "send.py", "r2", "old", "9.5,2.0") as old,
            example(fleet, "send.py", "r2", "wall", "5.5,3.5") as wall,
        ):
            accepted = read_to(one, "number")
            assert "r1: order tea update 0 is number " in accepted
            assert "r2: order old" in read_to(old, "number")
            text, _ = wall.communicate(timeout=FAREWELL)
            assert wall.returncode == 2
            assert text.startswith("refused: ")
            with (
                example(fleet, "send.py", "r1", "tea", "9.5,4.0", "2.5,6.0") as again,
                example(fleet, "send.py", "r2", "new", "9.5,6.0") as new,
            ):
                assert read_to(again, "number") == accepted, "said again, it is the same order"
                read_to(new, "number")
                assert main(["go"]) == 0
                said = [each.communicate(timeout=LONGEST)[0] for each in (one, again, old, new)]
                assert said == ["r1 is there\n"] * 2 + ["r2 other targets have replaced these\n", "r2 is there\n"]
                assert [each.returncode for each in (one, again, old, new)] == [0, 0, 1, 0]
        assert fleet.end() == 0, fleet.text
        history = fleet.report()["per_robot"]["r1"]["history"]
    assert [one["fate"] for one in history] == ["superseded", "done"], "it had the order once"


@pytest.mark.long("a whole mission")
@pytest.mark.processes
def test_clerk_keeps_all_robots_busy_until_its_list_is_done(tmp_runtime: Path) -> None:
    (file := tmp_runtime / "long.yaml").write_text(SMALL.replace("limit: 1500", "limit: 3000"))
    places = ("9.5,4.0", "9.5,6.0", "2.5,2.0", "5.5,3.5", "9.5,4.0", "9.5,2.0", "2.5,4.0")
    with Fleet(file, "--pace", "10", "--wait", runtime=tmp_runtime, robots=3) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        assert main(["stop", "r3"]) == 0, "a run ends when all robots are done: this one keeps it open"
        with example(fleet, "clerk.py", "night", *places) as clerk:
            read_to(clerk, "on duty")
            assert main(["go"]) == 0
            text, _ = clerk.communicate(timeout=LONGEST)
        assert text.count("refused: ") == 1, text
        assert "night-4 refused: " in text, "that place is in a wall"
        assert text.endswith(f"{len(places) - 1} of {len(places)} places visited\n")
        assert main(["go-on", "r3"]) == 0
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    given = {name: [one["what"] for one in report["per_robot"][name]["history"][1:]] for name in ("r1", "r2")}
    assert all(given.values()), "both have worked"
    assert sorted(given["r1"] + given["r2"]) == [f"order night-{n} update 0" for n in (1, 2, 3, 5, 6, 7)]
    history = [one for name in given for one in report["per_robot"][name]["history"]]
    assert [one for one in history if one["fate"] != "done"] == []


@pytest.mark.long("a whole mission")
@pytest.mark.processes
def test_watch_tells_one_who_comes_late_what_was_before_and_all_that_comes(small: Path, tmp_runtime: Path) -> None:
    with Fleet(small, "--pace", "5", "--wait", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        bus.listen(EVENT)
        assert main(["go"]) == 0
        await_event(bus, lambda event: event.kind == "reached" and event.robot == "r1")
        bus.ask(ACTION, Action(do=Do.PAUSE))  # or the run would be over before a slow machine has started it
        with example(fleet, "watch.py") as watch:
            before = read_to(watch, "watching")
            bus.ask(ACTION, Action(do=Do.RESUME))
            after, _ = watch.communicate(timeout=LONGEST)
            assert watch.returncode == 0
        assert fleet.end() == 0, fleet.text
    assert "fleet: the run is running" in before
    assert "r1: is at target 1" in before
    assert "s  small is paused" in before
    assert "s  small is running" in after
    for name in ("r1", "r2"):
        assert f"s  {name} at " in before
        assert f"s  {name} at " in after
        assert f" {name} done, 3 of 3 targets" in after
    assert (before + after).count("r1: is at target 1") == 1, "told once"
    assert "small is over" in after.splitlines()[-3]


def await_sense(bus: Bus, fits: Callable[[Sense], bool]) -> Sense:
    """Wait until a robot senses something that fits; listen to it before."""
    return await_message(bus, Sense, fits, "no sense fits")


@pytest.mark.long("a whole mission, each process started by hand")
@pytest.mark.processes
def test_drive_takes_a_robots_place_and_goes_where_the_keys_say(
    small: Path, endpoint: Endpoint, tmp_runtime: Path
) -> None:
    report = tmp_runtime / "report.json"
    wire = ("--connect", str(endpoint), "--fleet", "driven")
    with (
        Command(
            "world",
            str(small),
            "--robots",
            "3",
            "--pace",
            "2",
            "--report",
            str(report),
            *wire,
            runtime=tmp_runtime,
            breaks=HOLDS_NOTHING,
        ) as world,
        Bus(endpoint, "driven") as bus,
    ):
        bus.listen(EVENT)
        bus.listen(SENSE, robot="r3")
        bus.watch_presence()
        await_presence(bus, "world", True)
        with started_at(endpoint, "driven", "drive.py", "r3") as driver:
            assert driver.stdin is not None
            read_to(driver, "you drive r3")
            with Command("robot", "--count", "2", *wire, runtime=tmp_runtime, breaks=HOLDS_NOTHING):
                start = await_sense(bus, lambda sense: sense.tick > 0)
                bus.ask(ROBOT_ACTION, RobotAction(do=RobotDo.STOP), robot="r1")  # the run is not over before it goes on
                for keys in ("w", "\x1b[A"):
                    driver.stdin.write(keys)
                    driver.stdin.flush()
                    await_sense(bus, lambda sense: sense.linear > 0.3)
                    await_sense(bus, lambda sense: sense.linear == 0.0)  # the key is not held
                for keys, left in (("a", True), ("d", False)):
                    driver.stdin.write(keys)
                    driver.stdin.flush()
                    await_sense(bus, lambda sense, left=left: sense.angular * (1 if left else -1) > 0.5)  # type: ignore[misc]
                    stands = await_sense(bus, lambda sense: sense.angular == 0.0)
                assert stands.x - start.x > 0.4
                assert abs(stands.y - start.y) < 0.1
                driver.stdin.write("wq")
                driver.stdin.flush()
                assert driver.wait(FAREWELL) == 0
                await_event(bus, lambda event: event.kind == "gone" and event.robot == "r3")
                bus.ask(ROBOT_ACTION, RobotAction(do=RobotDo.GO_ON), robot="r1")
                await_event(bus, lambda event: event.kind == "reached" and event.robot == "r1")
                with started_at(endpoint, "driven", "drive.py", "r3") as second:
                    read_to(second, "you drive r3")
                    assert world.end() == 1, world.text
                    assert second.wait(FAREWELL) == 0
    summary = json.loads(report.read_text())
    assert summary["reason"] == "r3's mission was cancelled", "the person at the keys drives instead"
    assert summary["contacts"]["wall"] == summary["contacts"]["robot"] == 0
    assert summary["per_robot"]["r3"]["path_length"] > 0.4


@pytest.mark.long("a whole mission in another world")
@pytest.mark.processes
def test_our_robots_complete_a_mission_in_a_world_of_another_make(endpoint: Endpoint, tmp_runtime: Path) -> None:
    wire = ("--connect", str(endpoint), "--fleet", "elsewhere")
    with started_at(endpoint, "elsewhere", "foreign_world.py") as world:
        read_to(world, "waits for r1 and r2")
        with Command("robot", "--count", "2", *wire, runtime=tmp_runtime):
            text, _ = world.communicate(timeout=LONGEST)
    assert world.returncode == 0, text
    assert text.count(" is at ") == 4, text
    apart, off = map(float, re.findall(r"(-?[\d.]+) m", text.splitlines()[-1]))
    assert apart > 0.0, text
    assert off > 0.0, text


@pytest.mark.long("a whole mission; make test has one of a foreign robot")
@pytest.mark.processes
def test_one_robot_of_a_launched_fleet_has_its_body_outside(small: Path, tmp_runtime: Path) -> None:
    with Fleet(small, "--pace", "max", "--body", "r2", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        with started_at(fleet.endpoint, fleet.name, "foreign_body.py", "r2") as body:
            read_to(body, "stands at")
            assert fleet.end() == 0, fleet.text
            text, _ = body.communicate(timeout=FAREWELL)
            assert body.returncode == 0, text
        summary = fleet.report()
    assert summary["complete"]
    assert sum(summary["contacts"].values()) == 0
    assert summary["not_reproducible"] == ["the body of r2 is outside, and nobody knows what it does"]
    assert summary["per_robot"]["r2"]["path_length"] > 5.0


def test_a_body_of_no_robot_is_refused_before_anything_is_started(
    small: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", str(small), "--robots", "2", "--dashboard", "off", "--body", "r7"]) == 2
    assert "--body r7: expected one of r1, r2, got 'r7'" in capsys.readouterr().err


@pytest.mark.long("a whole mission, each process started by hand")
@pytest.mark.processes
def test_a_body_that_dies_stands_and_the_run_goes_on_when_it_is_back(
    small: Path, endpoint: Endpoint, tmp_runtime: Path
) -> None:
    wire = ("--connect", str(endpoint), "--fleet", "dies")
    report = tmp_runtime / "report.json"
    arguments = (str(small), "--robots", "2", "--pace", "5", "--report", str(report), "--body", "r2")
    with (
        Command("world", *arguments, *wire, runtime=tmp_runtime) as world,
        Bus(endpoint, "dies") as bus,
    ):
        bus.watch_presence()
        bus.listen(EVENT)
        bus.listen(SENSE, robot="r2")
        await_presence(bus, "world", True)
        with started_at(endpoint, "dies", "foreign_body.py", "r2") as first:
            read_to(first, "stands at")
            with Command("robot", "--count", "2", *wire, runtime=tmp_runtime):
                await_sense(bus, lambda sense: sense.linear > 0.2)
                first.kill()
                await_event(bus, lambda event: event.kind == "body_silent" and event.robot == "r2")
                stood = await_sense(bus, lambda sense: sense.linear == 0.0)
                later = await_sense(bus, lambda sense: sense.tick > stood.tick + 20)
                assert (later.x, later.y, later.yaw) == (stood.x, stood.y, stood.yaw)
                with started_at(
                    endpoint, "dies", "foreign_body.py", "r2"
                ):  # it knows its start only: it is carried there
                    await_event(bus, lambda event: event.kind == "body_back" and event.robot == "r2")
                    assert world.end() == 0, world.text
    summary = json.loads(report.read_text())
    assert summary["complete"]
    assert summary["contacts"]["wall"] == 0
