"""What a hostile or huge file says costs nothing before it is refused: sizes are checked before anything is computed."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest

from swarm.errors import ConfigError
from swarm.maps.load import load_map
from swarm.scenario import check, load
from swarm.scenario.source import Source
from tests.launch.actors import SMALL

HEAD = "name: hostile\nstart: {poses: [[2.5, 2.5, 0]]}\n"
ROOM = HEAD + 'map: {text: "##########\\n' + "#........#\\n" * 8 + '##########", cell: 1.0}\n'
ALIASES = "[&a [" + "&t [5.5, 5.5]," + "*t," * 999 + "], " + "*a," * 999 + "]"
FAR = "targets: [[5.5, 5.5]]\n"
EMPTY = HEAD + FAR + "map: {file: empty.map, cell: {0}}\n"


def empty(side: int, cell: float) -> str:
    return EMPTY.replace("{0}", str(cell)) + f"# {side}\n"


# fmt: off
FILES: dict[str, tuple[str, str]] = {
    "10^6 aliased targets":         (ROOM + f"own_targets: {ALIASES}\n", "own_targets: expected at most 5000 targets of all robots together, got 1000000; list fewer"),
    "20,000 targets":               (ROOM + "own_targets: [" + "[[5.5, 5.5]]," * 20_000 + "]\n", "expected at most 60000 values"),
    "a deep list":                  ("[" * 100_000, "expected at most 60000 values, 50 deep, got more"),
    "a deep mapping":               ("{a: " * 900 + "}" * 900, "50 deep, got more"),
    "more than 4 MB":               ("#" * 4_000_001, "expected at most 4000000 bytes, got more"),
    "one long line of a map":       (HEAD + FAR + 'map: {text: "' + "." * 100_000 + '"}', "got 1 rows of 100000"),
    "an empty floor of 1 km":       (empty(2048, 0.5), "planning grid of cells of 0.1 m: expected 1 to 16384 rows and columns and at most 8388608 cells, got 10240 rows of 10240"),
    "an empty floor of 205 m":      (empty(2048, 0.1), "expected a floor and targets for which the lattice of cells can be placed, got 204.8 x 204.8 m with 2 targets and starts"),
    "cells smaller than a robot":   (empty(1024, 0.1) + "traffic: {cell: 0.05, offset: [0, 0]}\n", "times too many; set `traffic.cell` and `traffic.offset`, cut the map, or list fewer targets"),
    "a map of too many cells":      (empty(2900, 0.1), "expected 1 to 16384 rows and columns and at most 8388608 cells, got 2900 rows of 2900"),
}
# fmt: on


def not_reached(*_: object, **__: object) -> NoReturn:
    raise AssertionError("this file must be refused before anything is computed from it")


@pytest.mark.parametrize("name", FILES)
def test_a_costly_file_is_refused_before_anything_is_computed(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text, sentence = FILES[name]
    for costly in ("settle_lattice", "planning_grid", "starts", "cells_of"):
        monkeypatch.setattr(check, costly, not_reached)
    (tmp_path / "case.yaml").write_text(text)
    if "empty.map" in text:
        side = int(text.split("# ")[1].split()[0])
        rows = ("." * side + "\n") * side
        (tmp_path / "empty.map").write_text(f"type octile\nheight {side}\nwidth {side}\nmap\n{rows}")
    with pytest.raises(ConfigError) as refused:
        check.check(Source(tmp_path / "case.yaml").read(), 1, 1)
    assert sentence in str(refused.value)


def test_too_many_stops_of_all_robots_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "case.yaml").write_text(ROOM + "targets: [" + "[5.5, 5.5]," * 100 + "]\n")
    scenario = load.load(tmp_path / "case.yaml")
    monkeypatch.setattr(check, "settle_lattice", not_reached)
    with pytest.raises(
        ConfigError, match="at most 20000 targets of all robots together, got 101000 of 1000; run fewer"
    ):
        check.check(scenario, 1000, 1)
    with pytest.raises(AssertionError, match="before anything is computed"):
        check.check(scenario, 100, 1)


PIPES: dict[str, tuple[str, Callable[[Path], object]]] = {
    "a scenario": ("pipe", load.load),
    "a map": ("pipe.map", load_map),
    "a map of ROS": ("pipe.yaml", load_map),
    "a scenario's map": ("pipe.map", lambda pipe: load.load(pipe.parent / "case.yaml")),
    "a profile": ("pipe.yaml", lambda pipe: load.load(pipe.parent / "profiled.yaml")),
    "a benchmark": ("pipe.scen", lambda pipe: Source(pipe.parent / "floor.map", pipe).read()),
}


@pytest.mark.parametrize("name", PIPES)
def test_a_pipe_is_refused_at_once_as_any_kind_of_file(name: str, tmp_path: Path) -> None:
    file, read = PIPES[name]
    os.mkfifo(tmp_path / file)
    (tmp_path / "floor.map").write_text("type octile\nheight 1\nwidth 1\nmap\n.\n")
    (tmp_path / "case.yaml").write_text(HEAD + FAR + "map: {file: pipe.map}\n")
    (tmp_path / "profiled.yaml").write_text(ROOM + FAR + "controller: pipe.yaml\n")
    with pytest.raises(ConfigError, match=r"expected a file, found none|no such file"):
        read(tmp_path / file)


@pytest.mark.parametrize("device", ["/dev/zero", "/dev/stdin", "/dev/tty"])
def test_a_device_is_no_scenario(device: str) -> None:
    with pytest.raises(ConfigError, match="expected a file, found none"):
        load.load(Path(device))


MAP = "type octile\nheight 8\nwidth 12\nmap\n" + "............\n" * 8


@pytest.mark.parametrize(
    "name",
    [
        "../floor.map",
        "{0}/floor.map",
        "{0}/here/floor.map",
        "link.map",
        "below/../../floor.map",
        '"a\\0.map"',
        "~/x.map",
    ],
)
def test_a_map_from_elsewhere_is_refused(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "here"
    (folder / "below").mkdir(parents=True)
    for place in (tmp_path, folder, folder / "below"):
        (place / "floor.map").write_text(MAP)
    (folder / "link.map").symlink_to(tmp_path / "floor.map")
    (folder / "inner.map").symlink_to(folder / "below" / "floor.map")
    text = SMALL[: SMALL.index("  cell")] + "  cell: 1.0\n  file: {0}\n" + SMALL[SMALL.index("start:") :]
    for good in ("floor.map", "below/floor.map", "inner.map", "./below/../floor.map"):
        (folder / "case.yaml").write_text(text.replace("{0}", good))
        assert load.load(folder / "case.yaml").map.shape == (8, 12)
    (folder / "case.yaml").write_text(text.replace("{0}", name.replace("{0}", str(tmp_path))))
    with pytest.raises(ConfigError, match=r"map.file: expected the name of a file in the folder|found none"):
        load.load(folder / "case.yaml")
