"""`swarm run --record FILE.mcap`: a bag of a whole run, whatever becomes of its processes."""

import signal
from pathlib import Path

import pytest

from swarm.cli import main
from tests.bridge.foxglove.read import is_closed, lines_of_both
from tests.launch.actors import Fleet, await_tick

pytestmark = pytest.mark.processes


@pytest.mark.long("a whole mission")
def test_a_mission_is_in_a_bag_from_its_first_second_to_its_last(small: Path, tmp_runtime: Path) -> None:
    record = tmp_runtime / "run.mcap"
    with Fleet(small, "--pace", "8", "--record", str(record), runtime=tmp_runtime) as fleet:
        assert fleet.end() == 0
        assert f"recorded: {record}  (open it in Foxglove, or: ros2 bag play {record})" in fleet.text
        assert "has left" not in fleet.text
        time = fleet.report()["sim_time"]
    times = [line.at / 1e9 for line in lines_of_both(record) if line.topic == "/r1/odom"]
    assert is_closed(record)
    assert times[0] < 0.5, "the world has waited for who records"
    assert times[-1] > time - 1.0
    assert len(times) > 10 * time, "twenty a second are sent"


@pytest.mark.costs("a fleet in real time")
def test_a_killed_recorder_leaves_a_bag_and_the_next_one_goes_on_in_another(small: Path, tmp_runtime: Path) -> None:
    record, second = tmp_runtime / "run.mcap", tmp_runtime / "run.2.mcap"
    with Fleet(small, "--serve", "--record", str(record), runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        await_tick(bus, 60)
        fleet.member("recorder").send_signal(signal.SIGKILL)
        fleet.await_line("recorder was ended by signal 9; started again")
        fleet.await_member("recorder")
        await_tick(bus, 160)
        assert main(["stop"]) == 0
        fleet.end()
        assert f"recorded without index: {record}  (its process was killed; its last seconds are missing)" in fleet.text
        assert f"recorded: {second}  (open it in Foxglove" in fleet.text
    assert not is_closed(record)
    assert is_closed(second)
    for file in (record, second):
        assert {"/map", "/tf", "/r1/scan", "/r2/odom"} <= {line.topic for line in lines_of_both(file)}


@pytest.mark.long("two runs")
def test_ctrl_c_and_another_run_end_a_bag_well(small: Path, tmp_runtime: Path) -> None:
    record, second = tmp_runtime / "run.mcap", tmp_runtime / "run-run2.mcap"
    with Fleet(small, "--serve", "--record", str(record), runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        await_tick(bus, 20)
        assert main(["restart"]) == 0
        await_tick(bus, 10)
        fleet.process.send_signal(signal.SIGINT)
        fleet.end()
        assert f"recorded: {second}  (open it in Foxglove" in fleet.text
    assert is_closed(record)
    assert is_closed(second)
    assert lines_of_both(record)
    assert {"/map", "/tf_static"} <= {line.topic for line in lines_of_both(second)}
