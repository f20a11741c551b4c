"""`swarm status ROBOT`, `echo` of last values, `topics`, `logs` and `order --wait`, on a fleet that runs."""

import json
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from swarm.cli import main
from tests.cli.saying import Capture, said
from tests.launch.actors import SMALL, Command, Fleet

pytestmark = pytest.mark.processes


@pytest.fixture(scope="module")
def runtime(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Return the folder of the fleets of this module."""
    path = tmp_path_factory.mktemp("fleets")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(path))
        yield path


@pytest.fixture(scope="module")
def waiting(runtime: Path) -> Iterator[Fleet]:
    """Run a fleet that waits for `swarm go`, for all tests that only ask it things; r1 has an order."""
    file = runtime / "small.yaml"
    file.write_text(SMALL)
    with Fleet(file, "--wait", "--serve", "--pace", "5", "--dashboard", "box", runtime=runtime) as fleet:
        with fleet.bus() as bus:
            fleet.await_all(bus)
        assert main(["order", "r1", "9.5,4", "2.5,6", "--id", "morning", "--home"]) == 0
        yield fleet


# fmt: off
KEPT = {  # key: a field of its last message
    "world/map":      "packed",
    "world/event":    "text",
    "world/events":   "events",
    "world/truth":    "bodies",
    "world/status":   "scenario",
    "robot/r1/state": "activity",
    "robot/*/state":  "activity",
    "fleet/setup":    "scenario",
    "swarm/v1/{fleet}/robot/r2/state": "activity",
    "swarm/v1/*/world/map": "packed",
}
# fmt: on


@pytest.mark.parametrize("key", KEPT)
def test_the_last_message_that_is_kept_on_a_key_is_printed_at_once(key: str, waiting: Fleet, capsys: Capture) -> None:
    full = key.replace("{fleet}", waiting.name)
    told = json.loads(said(capsys, "echo", full, "--once", "--json"))
    assert KEPT[key] in told["message"]
    assert (
        told["key"].split("/")[0]
        == full.removeprefix(f"swarm/v1/{waiting.name}/").removeprefix("swarm/v1/*/").split("/")[0]
    )


def test_a_key_of_another_fleet_is_refused(waiting: Fleet, capsys: Capture) -> None:
    key = "swarm/v1/elsewhere/world/map"
    assert main(["echo", key]) == 2
    assert (
        f"expected a running fleet, got 'elsewhere'; running on this machine: {waiting.name}" in capsys.readouterr().err
    )
    assert main(["hz", key, "--fleet", waiting.name]) == 2
    assert f"expected a key of fleet '{waiting.name}', got '{key}'" in capsys.readouterr().err


def test_on_a_key_on_which_nothing_comes_it_is_said_why_and_waited(waiting: Fleet, runtime: Path) -> None:
    with Command("echo", "robot/r9/state", "--once", runtime=runtime) as echo, waiting.bus() as bus:
        line = echo.await_line("no message so far")
        assert "the fleet has no robot 'r9'; known: r1, r2" in line
        assert echo.process.poll() is None
        echo.process.send_signal(signal.SIGINT)
        assert echo.end() == 1
        assert bus.refused_counts == {}


def test_a_fleet_that_waits_has_its_keys_listed(waiting: Fleet, capsys: Capture) -> None:
    rows = {row["key"]: row for row in json.loads(said(capsys, "topics", "--seconds", "0.3", "--json"))}
    assert {
        "world/map",
        "world/status",
        "world/event",
        "robot/r1/state",
        "robot/r2/state",
        "fleet/setup",
    } <= rows.keys()
    assert (rows["world/map"]["rate"], rows["world/map"]["age"], rows["world/map"]["who"]) == (0.0, None, "world")


def test_the_address_of_the_box_is_in_the_list_of_fleets(waiting: Fleet, capsys: Capture) -> None:
    address = waiting.await_line("box: http").split()[-1]
    (row,) = json.loads(said(capsys, "ls", "--json"))
    assert (row["fleet"], row["phase"], row["box"]) == (waiting.name, "waiting", address)
    (row,) = json.loads(said(capsys, "ls", "--json", "--connect", str(waiting.endpoint)))
    assert (row["fleet"], row["box"]) == (waiting.name, None)
    assert "token" not in said(capsys, "ls")


def test_the_status_says_where_the_tape_is(waiting: Fleet, capsys: Capture, runtime: Path) -> None:
    (row,) = json.loads(said(capsys, "ls", "--json"))
    assert Path(row["tape"]).is_relative_to(runtime)
    assert (
        said(capsys, "status").splitlines()[-1]
        == f"tape: {row['tape']}  (run it again with: swarm replay {row['tape']})"
    )
    assert "tape" not in said(capsys, "status", "--connect", str(waiting.endpoint)), "it may be on another machine"


def test_one_robot_is_told_of_whole(waiting: Fleet, capsys: Capture) -> None:
    lines = said(capsys, "status", "r1").splitlines()
    assert "has        order morning update 0, number 1" in lines
    assert "target 1   9.50, 4.00 m  next" in lines
    assert lines[-1].endswith("order morning update 0 is number 1: 2 targets, then home")
    told = json.loads(said(capsys, "status", "r1", "--json"))
    assert (told["robot"], told["stops"][1], told["home"]) == ("r1", [2.5, 6.0], True)
    assert main(["status", "r11"]) == 2
    assert "did you mean 'r1'?" in capsys.readouterr().err


def test_the_log_of_a_fleet_is_printed_or_that_of_a_robot(waiting: Fleet, capsys: Capture) -> None:
    order = "run 0      0.00 s  r1   order morning update 0 is number 1: 2 targets, then home"
    assert said(capsys, "logs").splitlines()[-1] == order
    assert order in said(capsys, "logs", "r1").splitlines()
    last = json.loads(said(capsys, "logs", "--json").splitlines()[-1])
    assert (last["robot"], last["kind"]) == ("r1", "order")
    assert main(["logs", "r2"]) == 1, "nothing is said of it"
    assert main(["logs", "r3"]) == 2
    assert "logs: expected a robot of the fleet, got 'r3'; known: r1, r2" in capsys.readouterr().err


# --- the last test lets the fleet drive, and ends it ---


def test_who_waits_for_an_order_is_told_how_far_it_is_and_how_it_ends(
    waiting: Fleet, runtime: Path, capsys: Capture
) -> None:
    assert main(["go"]) == 0
    lines = said(capsys, "order", "r1", "4.5,2", "--home", "--id", "a", "--wait").splitlines()
    assert lines[0] == "r1: order a update 0 is number 2: 1 target, then home"
    assert any(line.startswith("r1: drive, ") and line.endswith(" m left") for line in lines[1:-1])
    assert lines[-1].startswith("r1: order a is done: 2 targets reached, the last at ")
    again = said(capsys, "order", "r1", "4.5,2", "--home", "--id", "a", "--wait").splitlines()
    assert again == [lines[0], lines[-1]], "an order that is given again when it is done"

    assert main(["stop", "r1"]) == 0
    with (
        Command("logs", "r1", "--follow", runtime=runtime) as log,
        Command("order", "r1", "9.5,6", "--id", "b", "--wait", runtime=runtime) as order,
        Command("order", "r1", "9.5,6", "--id", "b", "--wait", runtime=runtime) as other,
    ):
        for one in (order, other):
            one.await_line("`swarm go-on r1` ends that")
        order.process.send_signal(signal.SIGINT)
        assert order.end() == 1
        assert order.text.splitlines()[-1] == (
            "r1: order b stands; `swarm status r1` shows it, `swarm cancel r1` drops it"
        )
        log.await_line("order b update 0 is number 3: 1 target")
        assert main(["cancel", "r1"]) == 0
        assert other.end() == 1
        assert other.text.splitlines()[-1] == ("r1: order b is not done: 1 left; cancelled by no targets (number 4)")
        log.await_line("cancelled by no targets (number 4)")
        assert main(["stop"]) == 0
        assert log.end() == 0, log.text
    assert waiting.end() == 1
    assert log.text.count("order b update 0 is number 3") == 1, "an event is printed once"
