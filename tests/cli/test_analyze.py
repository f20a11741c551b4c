"""`swarm analyze`: what it makes of what a world has measured, and what it says of a file that is no tape."""

from collections.abc import Mapping
from pathlib import Path

import pytest
from msgspec.structs import replace

from swarm.bus.codec import encode
from swarm.cli import main
from swarm.cli.offline.analyze import analyse_run, format_analysis, table
from swarm.messages import STATUS, Account, Activity, Liveness, RobotStatus, State, Status
from tests.messages.examples import example_of
from world.tasks.orders import MOST_TARGETS
from world.views.status import STOPS

NOTHING = Account(
    targets=2, reached=[None, None], laps=0, path_length=0.0, shortest_length=None, waiting=0.0, waits_for={},
    replans=0, contacts=0, struck=0, stalled=0, unreachable=[],
)  # fmt: skip
DONE = replace(NOTHING, reached=[4.05, 9.0], path_length=12.0, shortest_length=10.0, waiting=1.5, waits_for={"r2": 1.5})
HALF = replace(NOTHING, reached=[3.0, None], path_length=5.0, shortest_length=9.0, contacts=2, replans=3, struck=1)
ROUND = replace(DONE, laps=2)


def status_of(robots: Mapping[str, Account], **fields: object) -> Status:
    status = example_of(Status)
    assert isinstance(status, Status)
    rows = [replace(status.robots[0], robot=name, account=one) for name, one in robots.items()]
    contacts = {"robot": 1, "wall": 0, "obstacle": 0}
    plain = replace(
        status, scenario="small", run=0, time=20.0, complete=False, reason="", contacts=contacts, clearance_min=0.25
    )
    return replace(plain, robots=rows, **fields)


def test_the_total_is_that_of_the_robots() -> None:
    total = analyse_run(status_of({"r1": DONE, "r2": HALF}), "f")["total"]
    assert total == {
        "targets": 4, "reached": 3, "path_length": 17.0, "shortest_length": 19.0, "detour": 1.2, "waiting": 1.5,
        "replans": 3, "contacts": 1,
    }  # fmt: skip


# fmt: off
DETOURS: Mapping[str, tuple[Mapping[str, Account], float | None]] = {
    "of those that were everywhere":   ({"r1": DONE, "r2": HALF}, 1.2),
    "of nobody":                       ({"r2": HALF}, None),
    "not of laps, whose way is longer": ({"r1": ROUND}, None),
    "not without a shortest way":      ({"r1": replace(DONE, shortest_length=None)}, None),
    "weighed by length":               ({"r1": DONE, "r2": replace(DONE, path_length=30.0, shortest_length=30.0)}, 42 / 40),
}
# fmt: on


@pytest.mark.parametrize("name", DETOURS)
def test_the_way_against_the_shortest(name: str) -> None:
    robots, expected = DETOURS[name]
    assert analyse_run(status_of(robots), "f")["total"]["detour"] == pytest.approx(expected)


def test_the_table_has_a_row_for_each_robot_and_the_total() -> None:
    rows = table(analyse_run(status_of({"r1": DONE, "r2": HALF}), "f"))
    assert [list(row) for row in rows] == [
        ["robot", "targets at [s]", "way [m]", "shortest [m]", "ratio", "waited [s]", "for", "contacts", "replans"],
        ["r1", "4.0, 9.0", "12.0", "10.0", "1.20", "1.5", "r2 1.5", "0", "0"],
        ["r2", "3.0, -", "5.0", "9.0", "-", "0.0", "-", "2", "3"],
        ["total", "3 of 4", "17.0", "19.0", "1.20", "1.5", "", "1", "3"],
    ]
    patrol = table(analyse_run(status_of({"r1": ROUND}), "f"))
    assert [row[-1] for row in patrol] == ["laps", "2", ""]


def test_the_lines_say_the_end_and_the_contacts() -> None:
    late = status_of({"r1": HALF}, reason="not reached: r1 target 2", time=20.0)
    assert format_analysis(analyse_run(late, "f", ["a note"])) == [
        "small, run 0: not complete after 20.0 s: the tape ends here; not reached: r1 target 2",
        "note: a note",
        "contacts: 1 robot, 0 wall, 0 obstacle; smallest gap 0.25 m",
    ]
    calm = status_of({"r1": DONE}, complete=True, clearance_min=None)
    first, rest = format_analysis(analyse_run(calm, "f"))
    assert first == "small, run 0: complete after 20.0 s"
    assert rest.endswith("smallest gap none")


@pytest.mark.parametrize("content", [None, b"", b"RRF2 of Rerun", b"name: small\nmap:\n"])
def test_what_is_no_tape_is_a_sentence_that_asks_for_one(
    content: bytes | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "run.rrd"
    if content is not None:
        file.write_bytes(content)
    assert main(["analyze", str(file)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert f"{file}: " in err
    assert err.endswith("give the tape of a run: the end of `swarm run` and `swarm status` say where it is\n")
    assert err.count("\n") == 1


def test_the_largest_status_of_a_thousand_robots_fits_its_message() -> None:
    """With every stop reached at an odd time, and a full list of robots waited for."""
    odd = 12345.600000000001
    most = replace(
        NOTHING, targets=MOST_TARGETS, reached=[odd] * MOST_TARGETS, path_length=odd, shortest_length=odd, waiting=odd,
        waits_for={f"r{n}": odd for n in range(981, 1001)},
    )  # fmt: skip
    said = State(
        robot="r1000", run=0, tick=9999999, activity=Activity.GIVE_WAY, target=0, reached=[False] * MOST_TARGETS,
        unreachable=[], distance=odd, replans=0,
    )  # fmt: skip
    row = RobotStatus(
        robot="r1000", liveness=Liveness.ALIVE, since=odd, pose=(odd, odd, 1.0), state=said, waits=["r999"],
        event=None, account=most, stops=[(odd, odd)] * STOPS, mission=f"order {'x' * 64} update 1",
    )  # fmt: skip
    status = replace(status_of({}), robots=[row] * 1000)
    assert len(encode(status, as_json=True)) < STATUS.limit
