"""Processes that are killed: the run goes on with nothing lost, in lockstep bit for bit; strangers change nothing."""

import json
from pathlib import Path

import pytest

from swarm.bus import Arrival, Bus, Endpoint
from swarm.cli import main
from swarm.launch.supervise.fleet import Ended
from swarm.launch.supervise.fleet import Fleet as Launched
from swarm.launch.supervise.table import CRASHED, WORLD, EarlyEnd
from swarm.messages import EVENT
from swarm.scenario.load import load
from tests.conftest import MakeBus
from tests.launch.actors import (
    PATIENCE,
    SMALL,
    Command,
    Fleet,
    assert_the_same_run,
    await_event,
    await_tick,
    in_process,
)

pytestmark = pytest.mark.processes
HARD = "limit: 1500\nsensors: {noise: 0.02}\nradio: {loss: 0.3}"  # all that is drawn at random
ROBOTS = 3


@pytest.fixture
def noisy(tmp_runtime: Path) -> Path:
    path = tmp_runtime / "noisy.yaml"
    path.write_text(SMALL.replace("limit: 1500", HARD))
    return path


def events_of(bus: Bus) -> list[str]:
    kinds = []
    while (arrived := bus.receive(0.0)) is not None:
        kinds += [arrived.message.kind] if isinstance(arrived, Arrival) and arrived.topic is EVENT else []
    return kinds


KILLS = [("world", (1, 130, 137)), ("router", (2, 131, 400))]


@pytest.mark.long("whole missions; `swarm drill` has one in `make test`")
@pytest.mark.parametrize(("who", "ticks"), KILLS)
def test_in_lockstep_a_run_is_the_undisturbed_one_whenever_the_world_or_the_router_is_killed(
    who: str, ticks: tuple[int, ...], noisy: Path, tmp_runtime: Path
) -> None:
    expected = in_process(load(noisy), ROBOTS, 1)
    with Fleet(noisy, "--pace", "max", robots=ROBOTS, runtime=tmp_runtime) as fleet:
        for tick in ticks:
            with fleet.bus() as bus:
                if tick == ticks[0]:
                    fleet.await_all(bus)
                await_tick(bus, tick)
                fleet.member(who).kill()
                fleet.await_line(f"{who} was ended by signal 9; started again")
                fleet.lines.clear()
        assert fleet.end() == 0, fleet.text
        assert_the_same_run(fleet.report(), expected)
        fleet.assert_nobody_is_left()


@pytest.mark.long("a whole mission; other kills of a robot are in make test")
def test_a_killed_robot_stalls_nobody_in_lockstep_and_the_report_says_that_the_run_cannot_be_repeated(
    noisy: Path, tmp_runtime: Path
) -> None:
    with Fleet(noisy, "--pace", "max", robots=ROBOTS, runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        bus.listen(EVENT)
        fleet.await_all(bus)
        await_tick(bus, 60)
        fleet.member("r2").kill()
        await_event(bus, lambda event: event.kind == "gone")
        assert fleet.end() == 0, fleet.text
        assert "silent" not in events_of(bus)
        report = fleet.report()
    assert report["complete"]
    assert not report["reproducible"]
    reasons = sorted(reason.partition(" at ")[0] for reason in report["not_reproducible"])
    assert reasons == ["r2 has lost its process", "r2 has started again without its memory"], "no deadline has passed"


def crash_once(file: Path) -> int:
    """Crash at the first start."""
    if not file.exists():
        file.touch()
        raise ValueError("planted")
    return 0


def test_a_process_that_crashes_is_treated_like_a_killed_one(tmp_path: Path) -> None:
    role = WORLD._replace(run=f"{__name__}:crash_once")
    ended: list[Ended] = []
    with Launched(tmp_path, print) as fleet:
        fleet.start(role, "world", {"file": tmp_path / "crashed"})
        while len(ended) < 2:
            ended += fleet.watch(PATIENCE)
    assert [(one.status, one.then) for one in ended] == [(CRASHED, EarlyEnd.RESTART), (0, EarlyEnd.FINISH)]
    assert "ValueError: planted" in ended[0].last_lines


@pytest.mark.long("a whole mission, each process started by hand")
def test_on_many_hosts_a_world_goes_on_from_the_file_that_it_is_given(
    noisy: Path, tmp_runtime: Path, endpoint: Endpoint, make_bus: MakeBus, capsys: pytest.CaptureFixture[str]
) -> None:
    wire = ("--connect", str(endpoint), "--fleet", "many")
    arguments = (str(noisy), "--robots", "2", "--pace", "max", "--seed", "1", *wire)
    file, report = tmp_runtime / "world.snapshot", tmp_runtime / "report.json"
    assert main(["world", *arguments, "--resume", str(file)]) == 2
    assert f"--resume {file}: expected a snapshot, found none" in capsys.readouterr().err
    bus = make_bus(fleet="many")
    with Command("robot", "--count", "2", *wire, runtime=tmp_runtime):
        with Command("world", *arguments, "--snapshot", str(file), runtime=tmp_runtime) as world:
            await_tick(bus, 100)
            world.process.kill()
            world.process.wait()
        with Command("world", *arguments, "--resume", str(file), "--report", str(report), runtime=tmp_runtime) as world:
            assert world.end() == 0, world.text
            world.await_line("the run goes on at ")
    assert_the_same_run(json.loads(report.read_text()), in_process(load(noisy), 2, 1))


# --- strangers ---


@pytest.mark.long("a whole mission and a second world")
def test_a_second_world_is_refused_and_the_first_one_goes_on(noisy: Path, tmp_runtime: Path) -> None:
    with Fleet(noisy, "--pace", "max", "--wait", robots=ROBOTS, runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        wire = ("--connect", str(fleet.endpoint), "--fleet", fleet.name)
        with Command("world", str(noisy), *wire, runtime=tmp_runtime) as second:
            assert second.end() == 2
            second.await_line("expected no world, got one that runs already")
        assert main(["go"]) == 0
        assert fleet.end() == 0, fleet.text
        assert_the_same_run(fleet.report(), in_process(load(noisy), ROBOTS, 1))
