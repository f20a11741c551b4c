"""Every way in which a scenario can be wrong: one sentence, exit status 2, no traceback, no process started."""

from collections.abc import Callable
from multiprocessing import forkserver
from pathlib import Path
from typing import Any

import pytest
import yaml

from swarm.errors import ConfigError
from swarm.launch.supervise import fleet
from swarm.scenario.load import load
from tests.cli.saying import refused
from tests.launch.actors import SMALL
from tests.shared import PAPER

Edit = Callable[[dict[str, Any]], object]


def put(*path: str | int, value: object) -> Edit:
    """Set the field at the end of a path of names."""

    def edit(raw: dict[str, Any]) -> None:
        here: Any = raw
        for step in path[:-1]:
            here = here.setdefault(step, {}) if isinstance(here, dict) else here[step]
        here[path[-1]] = value

    return edit


def drop(name: str) -> Edit:
    return lambda raw: raw.pop(name)


def together(*edits: Edit) -> Edit:
    def edit(raw: dict[str, Any]) -> None:
        for one in edits:
            one(raw)

    return edit


def room_in_two(raw: dict[str, Any]) -> None:
    raw["map"]["text"] = raw["map"]["text"].replace("#..........#\n#....##....#\n", "#..........#\n############\n", 1)
    raw["start"]["poses"] = [[2.5, 2.0, 0.0], [4.5, 2.0, 0.0]]


INSIDE_A_WALL = "expected free floor, got a wall or obstacle; move it"
OFF_THE_MAP = "expected a place on the map, which spans about (0.5, 0.5) to (11.5, 7.5); move it"

# fmt: off
FIELDS: dict[str, tuple[Edit, str]] = {
    "an unknown field":            (put("targts", value=[]), "unknown field 'targts'; did you mean 'targets'?"),
    "an unknown field inside":     (put("robot", "radus", value=1), "robot: unknown field 'radus'; did you mean 'radius'?"),
    "a field like no other":       (put("radio", "zzz", value=1), "radio: unknown field 'zzz'; known: every, line_of_sight"),
    "a missing field":             (drop("name"), "field 'name' is missing; add it"),
    "a missing map":               (drop("map"), "field 'map' is missing; add it"),
    "a unit written out":          (put("robot", "radius", value="20 cm"), "robot.radius: expected float, got '20 cm' (m; of its round footprint); write the bare number, without a unit"),
    "a text for a count":          (put("robots", value="four"), "robots: expected int, got 'four'"),
    "a fraction for a count":      (put("robots", value=2.5), "robots: expected int"),
    "a truth for a number":        (put("limit", value=True), "limit: expected float, got True"),
    "a number for a truth":        (put("return_home", value=1), "return_home: expected bool, got 1"),
    "a number for a text":         (put("name", value=3), "name: expected str, got 3"),
    "nothing for a section":       (put("robot", value=None), "robot: expected object, got None"),
    "a list for a section":        (put("robot", value=[1]), "robot: expected object, got [1]"),
    "no wheels' distance":         (put("robot", "track_width", value=0), "robot.track_width: expected float > 0.01, got 0"),
    "centimetres":                 (put("robot", "radius", value=20), "robot.radius: expected float <= 5.0, got 20 (m; of its round footprint)"),
    "a negative distance":         (put("sensors", "range", value=-1.6), "sensors.range: expected float > 0.1, got -1.6"),
    "more than all is lost":       (put("radio", "loss", value=1.5), "radio.loss: expected float <= 1.0, got 1.5"),
    "not a number":                (put("reach", value=float("nan")), "reach: expected"),
    "infinite":                    (put("limit", value=float("inf")), "limit: expected float <= 1000000.0, got inf"),
    "a number too long":           (put("limit", value=10**400), "limit: Number out of range, got 1000"),
    "a negative seed":             (put("seed", value=-1), "seed: expected int >= 0, got -1"),
    "a name with a space":         (put("name", value="my scenario"), "name: expected 1 to 64 letters, digits or _ . : -, got"),
    "a name that is a path":       (put("name", value="../x"), "name: expected 1 to 64 letters, digits or _ . : -, got"),
    "a target of three":           (put("targets", value=[[1, 2, 3]]), "targets[0]: expected array of length 2, got [1, 2, 3]"),
    "a target that is no point":   (put("targets", value=["A"]), "targets[0]: expected array, got 'A'"),
    "a target no number":          (put("targets", value=[[1, "b"]]), "targets[0][1]: expected float, got 'b'"),
    "no targets":                  (put("targets", value=[]), "expected either `targets` (for all) or `own_targets` (a list a robot); give one"),
    "both kinds of targets":       (put("own_targets", value=[[[9.5, 2.0]]]), "expected either `targets` (for all) or `own_targets`"),
    "both kinds of start":         (put("start", "area", value=[1, 1, 2, 2]), "start: expected either `area` or `poses` or `circle`; give one of them"),
    "no kind of start":            (put("start", value={}), "start: expected either `area` or `poses` or `circle`; give one of them"),
    "walls that nobody knows stop the radio": (together(put("map", "known", value=False), put("radio", "line_of_sight", value=True)), "radio.line_of_sight: expected false where `map.known` is false, got true"),
    "both text and file":          (put("map", "file", value="floor.map"), "map: expected either `text` or `file`; draw the map in the file or name one"),
    "neither text nor file":       (put("map", value={"cell": 1.0}), "map: expected either `text` or `file`"),
    "an odd character":            (put("map", "text", value="###\n#x#\n###\n"), "line 2, column 2: expected '#' (wall), 'o' (obstacle), '.' or ' ' (free), got 'x'"),
    "lines of different lengths":  (put("map", "text", value="###\n#.\n###\n"), "line 2: expected 3 characters as in line 1, got 2"),
    "an empty drawing":            (put("map", "text", value=""), "map.text: "),
    "a map file that is not":      (put("map", value={"file": "no.map"}), "expected a file, found none; check the path"),
    "a map of no known kind":      (put("map", value={"file": "floor.bmp"}), "expected a map: .yaml (ROS), .map (MovingAI) or .txt"),
    "an unknown controller":       (put("controller", value="papr"), "controller 'papr': expected a profile's name or a file ending in .yaml; did you mean 'paper'?"),
    "a controller from elsewhere": (put("controller", value="../../x.yaml"), "expected a file within"),
}
WORLDS: dict[str, tuple[Edit, str]] = {
    "a target in a wall":          (put("targets", value=[[9.5, 2.0], [5.5, 4.0]]), f"targets: target 2 at (5.5, 4): {INSIDE_A_WALL}"),
    "a target outside the map":    (put("targets", value=[[99.5, 2.0]]), f"targets: target 1 at (99.5, 2): {OFF_THE_MAP}"),
    "a target too near a wall":    (put("targets", value=[[1.1, 2.0]]), "targets: target 1 at (1.1, 2): expected at least 0.2 m from any wall, for the robot's radius; move it"),
    "an own target in a wall":     (lambda raw: raw.update(targets=[], own_targets=[[[9.5, 2.0]], [[5.5, 4.0]]]), f"own_targets: r2's target 1 at (5.5, 4): {INSIDE_A_WALL}"),
    "too few own targets":         (lambda raw: raw.update(targets=[], own_targets=[[[9.5, 2.0]]]), "own_targets: expected a list for each of 2 robots, got 1; add more or run fewer robots"),
    "a start in a wall":           (put("start", "poses", 1, value=[5.5, 4.0, 0]), f"start of r2 at (5.5, 4): {INSIDE_A_WALL}"),
    "a start outside the map":     (put("start", "poses", 0, value=[-3, 4.0, 0]), f"start of r1 at (-3, 4): {OFF_THE_MAP}"),
    "a start too near a wall":     (put("start", "poses", 0, value=[1.05, 4.0, 0]), "start of r1 at (1.05, 4): expected at least 0.2 m from any wall"),
    "starts that overlap":         (put("start", "poses", 1, value=[2.7, 2.1, 0]), "start: expected r1 and r2 at least 0.4 m apart, got 0.22 m; move one of them"),
    "starts side by side":         (put("start", "poses", 1, value=[2.92, 2.4, 0]), "start: expected r1 at (2.5, 2) and r2 at (2.92, 2.4) farther apart, got 0.58 m, and 1.41 m are always enough; move one of them"),
    "more robots than starts":     (put("start", "poses", value=[[2.5, 2.0, 0]]), "start.poses: expected at least 2 poses, got 1; list more of them or run fewer robots"),
    "a target no path reaches":    (room_in_two, "target 2 of r1 at (9.5, 6): expected a way from (9.50, 2.00) wide enough for a radius of 0.2 m, found none; open the map or move the target"),
    "an area with one cell":       (put("start", value={"area": [1.1, 1.1, 2.3, 2.3]}), "start.area: expected 1 x 1 m of floor for each of 2 robots, found room for 1; enlarge the area or run fewer robots"),
    "an area without a cell":      (put("start", value={"area": [5.1, 3.1, 6.9, 4.9]}), "start.area: expected 1 x 1 m of floor for each of 2 robots, found room for 0; enlarge the area"),
    "a robot wider than its ways": (put("robot", "radius", value=1.2), "from any wall, for the robot's radius; move it"),
}
FILES = {
    "no map at all":               ("- 1\n- 2\n", "expected `name:`, `map:`, `start:`, `targets:`, got [1, 2]"),
    "an empty file":               ("", "expected `name:`, `map:`, `start:`, `targets:`, got None"),
    "a text":                      ("hello", "got 'hello'"),
    "a bracket left open":         ("name: small\ntargets: [[1, 2]\nmap: 3\n", "line 3, column 1: expected YAML, got"),
    "a tab":                       ("name: small\n\tmap: 3\n", "line 2, column 1: expected YAML, got"),
    "a key given twice":           ("name: small\nseed: 1\nseed: 2\n", "line 3, column 1: expected YAML, got key 'seed' is given twice"),
    "a key given twice inside":    ("robot:\n  radius: 1\n  radius: 2\n", "line 3, column 3: expected YAML, got key 'radius' is given twice"),
    "a key that is a list":        ("? [1, 2]\n: 3\n", "expected YAML"),
    "a key that is a map":         ("? {a: 1}\n: 3\n", "expected YAML"),
    "a tag of Python":             ("name: !!python/object/apply:os.getcwd []\n", "expected YAML, got could not determine a constructor"),
    "a map that is a list":        ("name: !!map [1, 2]\n", "expected YAML"),
    "an unknown anchor":           ("name: *nobody\n", "line 1, column 7: expected YAML, got found undefined alias"),
    "a list within itself":        ("name: &a [*a]\n", "name: expected str"),
    "no date":                     ("name: 2024-13-45\n", "expected YAML"),
    "a control character":         ("name: \x07\n", "expected YAML"),
    "a number as a key":           ("1: 2\n", "expected names of fields, got 1; see scenarios/paper.yaml"),
}
# fmt: on


def run_of(text: str, folder: Path, capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    path = folder / "case.yaml"
    path.write_text(text)
    return refused(capsys, "run", str(path), "--dashboard", "off", *arguments)


def edited(edit: Edit) -> str:
    raw = yaml.safe_load(SMALL)
    edit(raw)
    return yaml.safe_dump(raw)


@pytest.mark.parametrize("name", FIELDS)
def test_a_bad_field_is_refused_with_its_place(
    name: str, tmp_runtime: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    edit, sentence = FIELDS[name]
    said = run_of(edited(edit), tmp_runtime, capsys)
    assert sentence in said
    assert str(tmp_runtime) in said or "controller" in said, "it says which file"


@pytest.mark.parametrize("name", WORLDS)
def test_a_mission_that_cannot_be_driven_is_refused_before_anything_starts(
    name: str, tmp_runtime: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    edit, sentence = WORLDS[name]
    assert sentence in run_of(edited(edit), tmp_runtime, capsys, "--robots", "2")


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_is_no_scenario_is_refused_with_its_line(
    name: str, tmp_runtime: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, sentence = FILES[name]
    assert sentence in run_of(text, tmp_runtime, capsys)


def test_the_scenario_that_is_edited_here_is_a_good_one(tmp_runtime: Path) -> None:
    path = tmp_runtime / "small.yaml"
    path.write_text(SMALL)
    assert load(path).settings.name == "small"


def test_aliases_that_multiply_are_refused_at_once(tmp_runtime: Path, capsys: pytest.CaptureFixture[str]) -> None:
    items = ["&a0 [x, x]"] + [f"&a{n} [*a{n - 1}, *a{n - 1}]" for n in range(1, 60)]
    said = run_of(f"name: laughs\nlimit: [{', '.join(items)}]\n", tmp_runtime, capsys)
    assert "limit: expected float" in said
    assert len(said) < 500


def test_a_missing_file_names_the_nearest_one(tmp_runtime: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_runtime / "paper.yaml").write_text("map: {}\n")
    said = refused(capsys, "run", str(tmp_runtime / "papre.yaml"))
    assert "papre.yaml: expected a scenario file, found none; did you mean 'paper.yaml'?" in said


def test_a_missing_folder_says_check_the_path(tmp_runtime: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "found none; check the path" in refused(capsys, "run", str(tmp_runtime / "none" / "x.yaml"))


def test_a_folder_is_no_scenario(tmp_runtime: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "expected a file, found none" in refused(capsys, "run", str(tmp_runtime))


def test_bytes_are_no_scenario(tmp_runtime: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_runtime / "bytes.yaml"
    path.write_bytes(b"\xff\xfe\x00")
    assert "bytes.yaml: expected text (UTF-8)" in refused(capsys, "run", str(path))


# fmt: off
FLAGS = {
    "no robot a process":  (["--robots-per-process", "0"], "--robots-per-process: expected at least 1 robot, got 0"),
    "too many robots":     (["--robots", "1001"], "--robots: expected 1 to 1000, or how many of each kind, such as scout=6,cart=2, got '1001'"),
    "a negative seed":     (["--seed", "-1"], "--seed: expected 0 to 2**53, got -1"),
    "no robots":           (["--robots", "0"], "--robots: expected 1 to 1000, or how many of each kind, such as scout=6,cart=2, got '0'"),
    "robots in words":     (["--robots", "two"], "--robots: expected 1 to 1000, or how many of each kind, such as scout=6,cart=2, got 'two'"),
    "no time":             (["--limit", "0"], "--limit: expected seconds above 0"),
    "not a time":          (["--limit", "nan"], "--limit: expected seconds above 0"),
    "no pace":             (["--pace", "fast"], "--pace: expected realtime, max or a factor from 0.001 to 1000, got 'fast'"),
    "a pace of nothing":   (["--pace", "0"], "--pace: expected realtime, max or a factor"),
    "a pace not a number": (["--pace", "nan"], "--pace: expected realtime, max or a factor"),
    "a negative port":     (["--port", "-5"], "--port: expected 0 (a free one) to 65535, got -5"),
    "a fleet elsewhere":   (["--fleet", "../../x"], "--fleet: expected letters, digits and _ . : -"),
    "a fleet at the root": (["--fleet", "/tmp"], "--fleet: expected letters, digits and _ . : -"),
    "the folder above":    (["--fleet", ".."], "--fleet: expected letters, digits and _ . : -"),
    "an odd dashboard":    (["--dashboard", "paper"], "dashboard: expected one of auto, viewer, web, box, off, got 'paper'"),
    "a report nowhere":    (["--report", "/nowhere/at/all.json"], "--report /nowhere/at/all.json: expected a folder that can be written"),
    "a report in a folder": (["--report", "/"], "--report /: expected a file's name, got a folder"),
    "an unknown flag":     (["--serve", "--colour", "red"], "unrecognized arguments: --colour red"),
}
# fmt: on


EARLY = ("--robots", "--robots-per-process", "--seed", "--limit", "--pace", "--port")  # refused before anything is read


def unwanted(*_: object, **__: object) -> None:
    raise AssertionError("a process was started")


@pytest.mark.parametrize("name", FLAGS)
def test_a_bad_flag_is_refused(
    name: str, tmp_runtime: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments, sentence = FLAGS[name]
    path = tmp_runtime / "small.yaml"
    path.write_text(SMALL)
    if arguments[0] in EARLY:
        monkeypatch.setattr(fleet, "warm_up", unwanted)
    defaults = [] if "--dashboard" in arguments else ["--dashboard", "off"]
    assert sentence in refused(capsys, "run", str(path), *defaults, *arguments)


def test_the_fork_server_is_ended_if_the_scenario_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    """It would import for seconds more on a busy machine, and keep whoever reads the output waiting."""
    assert "found room for 25" in refused(capsys, "run", "paper", "--robots", "99", "--dashboard", "off")
    assert forkserver._forkserver._forkserver_pid is None  # type: ignore[attr-defined]


def test_a_fleet_name_cannot_empty_a_folder_that_is_not_ours(tmp_runtime: Path) -> None:
    """A fleet's folder is emptied before use: no name may lead elsewhere."""
    from swarm.bus import Endpoint
    from swarm.launch.fleet_registry import register_fleet

    treasure = tmp_runtime / "treasure"
    treasure.mkdir()
    (treasure / "coin").write_text("gold")
    for name in ("../treasure", str(treasure), "..", ".", ""):
        with pytest.raises(ConfigError), register_fleet(name, Endpoint("127.0.0.1", 1)):
            pass
    assert (treasure / "coin").read_text() == "gold"


@pytest.mark.parametrize(
    "endpoint", ["127.0.0.1:7447", "udp/127.0.0.1:7447", "tcp/127.0.0.1:0", "tcp/:1", "tcp/a:70000"]
)
def test_a_bad_endpoint_is_refused(endpoint: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert "endpoint: expected tcp/HOST:PORT" in refused(capsys, "status", "--connect", endpoint)


def test_world_refuses_what_run_refuses(tmp_runtime: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "--robots: expected 1 to 1000, or how many of each kind, such as scout=6,cart=2, got '0'" in refused(
        capsys, "world", str(PAPER), "--robots", "0"
    )
    assert "--seed: expected 0" in refused(capsys, "world", str(PAPER), "--seed", "-2")
