"""`swarm plan` and `swarm explain`: their output, and one sentence per error."""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from platform import python_version

import pytest

from swarm.cli import main
from swarm.cli.argument_parser import join_points
from swarm.cli.offline import tools
from swarm.fingerprint import fingerprint
from swarm.installation import LIBRARIES
from swarm.messages import VERSION
from swarm.messages.schema import kinds
from tests.cli.saying import Capture, refused
from tests.shared import DATA, PAPER, ROOT, needs_data

MAP = """\
type octile
height 5
width 6
map
......
.@@@@.
......
.@@@@.
......
"""
SCEN = """\
version 1
0\tsmall.map\t6\t5\t0\t0\t5\t0\t5.00000000
0\tsmall.map\t6\t5\t1\t0\t1\t2\t4.00000000
"""


@pytest.fixture
def small(tmp_path: Path) -> tuple[Path, Path]:
    (tmp_path / "small.map").write_text(MAP)
    (tmp_path / "small.scen").write_text(SCEN)
    return tmp_path / "small.map", tmp_path / "small.scen"


def test_a_plan_is_drawn_on_its_map(capsys: Capture) -> None:
    assert main(["plan", str(PAPER), "--from", "2,2", "--to", "10,2"]) == 0
    drawing = capsys.readouterr().out
    assert "#" * 40 in drawing
    assert len(drawing.splitlines()) >= 28


def test_a_plan_in_json_has_its_points_and_length(capsys: Capture) -> None:
    assert main(["plan", str(PAPER), "--from", "2,2", "--to", "10,2", "--json"]) == 0
    numbers = json.loads(capsys.readouterr().out)
    assert numbers["found"] is True
    assert numbers["length"] > 8.0


def test_no_way_is_an_answer_with_status_1(capsys: Capture) -> None:
    assert main(["plan", str(PAPER), "--from", "2,2", "--to", "0.2,0.2", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["found"] is False


def test_every_row_of_a_benchmark_file_is_solved_and_checked(capsys: Capture, small: tuple[Path, Path]) -> None:
    assert main(["plan", str(small[0]), "--scen", str(small[1]), "--json"]) == 0
    numbers = json.loads(capsys.readouterr().out)
    assert numbers["rows"] == 2
    assert numbers["mismatches"] == 0
    assert numbers["median_ms"] >= 0.0


def test_a_row_with_another_length_is_a_mismatch(capsys: Capture, small: tuple[Path, Path]) -> None:
    small[1].write_text(SCEN.replace("5.00000000", "4.00000000"))
    assert main(["plan", str(small[0]), "--scen", str(small[1])]) == 1
    assert "mismatches: 1" in capsys.readouterr().out


@needs_data
def test_the_benchmarks_own_lengths_are_met(capsys: Capture) -> None:
    """One map is enough for the command; ``tests/planning/test_astar.py`` solves more."""
    file = DATA / "movingai" / "Berlin_0_256.map"
    scen = file.with_name(f"{file.name}.scen")
    assert main(["plan", str(file), "--scen", str(scen), "--json"]) == 0
    numbers = json.loads(capsys.readouterr().out)
    assert numbers["mismatches"] == 0
    assert numbers["rows"] == sum(1 for line in scen.read_text().splitlines() if "\t" in line)


def test_an_explanation_names_rules_weight_and_speeds(capsys: Capture) -> None:
    assert main(["explain", "0.3", "0.4", "1.6", "12"]) == 0
    text = capsys.readouterr().out
    assert "IF left_obs is near AND right_obs is far AND front_obs is near THEN" in text
    assert "left_v 3.0000 m/s, right_v 1.0000 m/s" in text


def test_an_explanation_in_json_has_the_designs_keys(capsys: Capture) -> None:
    assert main(["explain", "1.6", "1.6", "1.6", "-45", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert {"left_v", "right_v", "weight", "rules"} <= told.keys()
    assert told["left_v"] < told["right_v"], "negative is to the left"


def test_a_surface_is_drawn(tmp_path: Path, capsys: Capture) -> None:
    picture = tmp_path / "surface.png"
    assert main(["explain", "1", "1", "1", "0", "--surface", str(picture)]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")


# fmt: off
BENCHMARKED = {  # arguments of `swarm bench`: those of `python -m benchmarks`
    "":                            [],
    "scale storm":                 ["scale", "storm"],
    "--write scale":               ["--write", "scale"],
    "scale --write":               ["scale", "--write"],
    "scale -- --wire --only 'a b'": ["scale", "--", "--wire", "--only", "a b"],
}
# fmt: on


@pytest.mark.parametrize("given", BENCHMARKED)
def test_benchmarks_are_run_with_the_arguments_given(given: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def run(command: list[str], cwd: Path, *, check: bool) -> subprocess.CompletedProcess[str]:
        assert command == [sys.executable, "-m", "benchmarks", *BENCHMARKED[given]]
        assert (cwd, check) == (ROOT, False)
        return subprocess.CompletedProcess(command, 1)

    monkeypatch.setattr(subprocess, "run", run)
    assert main(["bench", *shlex.split(given)]) == 1, "the status of the benchmarks"


def test_an_installation_without_benchmarks_says_where_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.setattr(tools, "CHECKOUT", tmp_path)
    assert "get the project's repository" in refused(capsys, "bench", "scale")


# fmt: off
WRONG = {  # arguments, part of the sentence
    "no points":              (("plan", PAPER), "--from"),
    "one point":              (("plan", PAPER, "--from", "1,2"), "--to"),
    "a point of one number":  (("plan", PAPER, "--from", "1", "--to", "2,2"), "X,Y"),
    "a point of words":       (("plan", PAPER, "--from", "a,b", "--to", "2,2"), "'a,b'"),
    "no such map":            (("plan", "nowhere.map", "--from", "1,1", "--to", "2,2"), "nowhere.map"),
    "a folder":               (("plan", ROOT, "--from", "1,1", "--to", "2,2"), str(ROOT)),
    "no map at all":          (("plan", ROOT / "README.md", "--from", "1,1", "--to", "2,2"), "README.md"),
    "a radius below 0":       (("plan", PAPER, "--from", "1,1", "--to", "2,2", "--radius", "-1"), "--radius"),
    "no such benchmark":      (("plan", PAPER, "--scen", "nowhere.scen"), ""),
    "too few distances":      (("explain", "1", "2"), "explain"),
    "a distance of letters":  (("explain", "a", "1", "1", "0"), "'a'"),
    "a negative distance":    (("explain", "-1", "1", "1", "0"), "-1"),
    "not a number":           (("explain", "nan", "1", "1", "0"), "nan"),
    "an infinite bearing":    (("explain", "1", "1", "1", "inf"), "inf"),
    "no such profile":        (("explain", "1", "1", "1", "0", "--profile", "nobody.yaml"), "nobody"),
    "an edit of one corner":  (("edit", "wall", "1,1"), "X,Y"),
}
# fmt: on


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said_in_one_sentence(capsys: Capture, name: str) -> None:
    arguments, part = WRONG[name]
    assert part in refused(capsys, *arguments)


def test_an_edit_without_a_fleet_says_so_negative_corners_or_not(tmp_runtime: Path, capsys: Capture) -> None:
    assert "found none" in refused(capsys, "edit", "wall", "-1,-2", "-.5,3")


@pytest.mark.parametrize("point", ["-1,2", "-.5,-2", "-1.5e1,3"])
def test_a_point_below_zero_is_no_flag(point: str) -> None:
    assert join_points(["order", "r1", point])[-1] == f" {point}"
    assert join_points(["plan", "--from", point])[-1] == f"--from={point}"


# fmt: off
PIPED = {
    "an explanation": ("explain", "0.8", "0.9", "1.0", "10"),
    "the help":       ("--help",),
}
# fmt: on


@pytest.mark.parametrize("name", PIPED)
def test_nobody_complains_when_the_reader_has_gone(name: str) -> None:
    read, write = os.pipe()
    os.close(read)
    try:
        process = subprocess.run(
            [sys.executable, "-m", "swarm.cli", *PIPED[name]], stdout=write, stderr=subprocess.PIPE, check=False
        )
    finally:
        os.close(write)
    assert process.stderr == b""
    assert process.returncode in {0, 1}


def test_the_version_says_whether_the_package_is_compiled_and_what_it_is_made_of(capsys: Capture) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0
    first, made, libraries = capsys.readouterr().out.splitlines()
    assert re.fullmatch(r"zenoh-swarm [\d.]+", first)
    assert made == f"wire swarm/v{VERSION}, code {fingerprint()}, Python {python_version()}"
    assert set(LIBRARIES) <= {one.split()[0] for one in libraries.split(", ")}


def test_every_message_of_the_wire_is_listed_with_what_it_is(capsys: Capture) -> None:
    assert main(["schema"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(kinds())
    assert lines[0].split(maxsplit=1) == ["Sense", "Everything that the world tells one robot at one tick."]


@pytest.mark.parametrize("name", kinds())
def test_the_schema_of_a_message_describes_each_of_its_fields(name: str, capsys: Capture) -> None:
    assert main(["schema", name]) == 0
    schema = json.loads(capsys.readouterr().out)
    shape = schema["$defs"][name]
    assert shape["properties"].keys() == {"v", *kinds()[name].__struct_fields__}
    assert [field for field, told in shape["properties"].items() if field != "v" and "description" not in told] == []
    references = re.findall(r'"#/\$defs/(\w+)"', json.dumps(schema))
    assert set(references) == set(schema["$defs"])
