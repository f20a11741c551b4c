"""The layout: which room may import which, and the largest size of a file."""

import ast
import re
import subprocess
import sys
import tomllib
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Final

import pytest

from swarm.kernels import KERNELS

ROOT: Final = Path(__file__).parents[1]
TOPS: Final = ("swarm", "world", "dashboard")
LONGEST: Final = 300  # lines of a file, without docstrings
DOCUMENTED: Final = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
# a room imports only rooms that stand before it
ORDER: Final = (
    "swarm.errors",
    "swarm.installation",
    "swarm.stop_signal",
    "swarm.suspend_clock",
    "swarm.heartbeat",
    "swarm.geometry",
    "swarm.kernels",
    "swarm.built_kernels",
    "swarm.fingerprint",
    "swarm.garbage",
    "swarm.settings",
    "swarm.kinds",
    "swarm.messages",
    "swarm.secure",
    "swarm.bus",
    "swarm.maps",
    "swarm.fuzzy",
    "swarm.motion",
    "swarm.planning",
    "swarm.traffic",
    "swarm.scenario",
    "swarm.robot",
    "swarm.tape",
    "world",
    "swarm.storm",
    "swarm.blackbox",
    "dashboard",
    "swarm.bridge",
    "swarm.launch",
    "swarm.launch.drill",
    "swarm.cli",
)
# sub-rooms, and which other sub-rooms of their room each imports
SUBROOMS: Final = {
    "swarm.traffic.mapf": "lattice",
    "swarm.traffic.lattice": "",
    "swarm.traffic.peers": "lattice",
    "swarm.traffic.reservations": "lattice peers",
    "swarm.traffic.obstacles": "lattice peers reservations",
    "swarm.traffic.joint": "lattice mapf peers reservations",
    "world.bodies": "",
    "world.measure": "bodies",
    "world.tasks": "bodies measure",
    "world.fleet": "tasks",
    "world.views": "fleet tasks",
    "world.saving": "fleet tasks",
    "world.host": "bodies fleet saving tasks views",
    "swarm.blackbox.replay": "",
    "swarm.blackbox.explain": "replay",
    "swarm.storm.plans": "",
    "swarm.storm.history": "plans",
    "swarm.storm.laws": "history",
    "swarm.robot.driving": "",
    "swarm.robot.host": "",
    "swarm.bridge.cdr": "",
    "swarm.bridge.ros2": "cdr",
    "swarm.bridge.foxglove": "cdr ros2",
    "swarm.bridge.body": "ros2",
    "swarm.bridge.vda5050": "",
    "swarm.cli.bridge": "",
    "swarm.cli.start": "",
    "swarm.cli.steer": "look",
    "swarm.cli.look": "",
    "swarm.cli.offline": "",
    "swarm.launch.supervise": "",
    "swarm.launch.drill": "",
    "dashboard.fold": "",
    "dashboard.rerun": "fold",
    "dashboard.box": "fold",
}
MOST: Final = 12  # modules in a folder of these rooms
LIBRARIES: Final = {
    "zenoh": "swarm/bus",
    "pymunk": "world/bodies/physics.py",
    "rerun": "dashboard/rerun",
    "mcap": "dashboard/mcap_file.py",
    "aiohttp": "dashboard/box/server.py",
    "cryptography": "swarm/secure",
    "rosbags": "swarm/bridge/ros2/types.py",
    "paho": "swarm/bridge/vda5050/line.py",
    "xxhash": "swarm/bridge/ros2/wire.py",
    "foxglove": "swarm/bridge/foxglove",
}
# attributes with an underscore that tests may read
PRIVATE: Final = {
    "_fields", "_replace", "_asdict", "_make",  # of named tuples: public, in spite of their names
    "_exit", "_current_frames", "_forkserver", "_forkserver_pid",  # of Python's library: there is no other way
    "_session", "_prefix",  # a stranger sends what no bus would, in the fleet of one (tests/world/host/test_wire_fuzz.py)
    "_streams",  # Rerun sends what it has every now and then: a test makes it (tests/dashboard)
}  # fmt: skip
FILES: Final = sorted(file for top in TOPS for file in (ROOT / top).rglob("*.py"))


def named(file: Path) -> str:
    return file.relative_to(ROOT).as_posix()


@cache
def nodes_of(file: Path) -> list[ast.AST]:
    """List all parts of a file's program, the file itself first."""
    return list(ast.walk(ast.parse(file.read_text(encoding="utf-8"))))


@cache
def imported(file: Path) -> list[str]:
    """List every module that a file imports, at the top or later."""
    found = []
    for node in nodes_of(file):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{named(file)}: imports are absolute"
            assert node.module is not None
            found += [f"swarm.{alias.name}" for alias in node.names] if node.module == "swarm" else [node.module]
        elif isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
    return found


def room_of(module: str) -> str | None:
    parts = module.split(".")
    if parts[0] not in TOPS:
        return None
    return ".".join(parts[:2]) if parts[0] == "swarm" else parts[0]


def test_a_room_imports_only_rooms_below_it() -> None:
    for file in FILES:
        own = room_of(".".join(file.relative_to(ROOT).with_suffix("").parts))
        if own == "swarm.__init__":
            continue
        assert own in ORDER, f"{named(file)}: give the new room its place in the order"
        rooms = {room for module in imported(file) if (room := room_of(module)) not in {None, own}}
        assert [room for room in rooms if room not in ORDER[: ORDER.index(own)]] == [], named(file)


@pytest.mark.parametrize("name", SUBROOMS)
def test_a_sub_room_imports_only_those_that_it_may(name: str) -> None:
    room, own = name.rsplit(".", 1)
    siblings = {other.rsplit(".", 1)[1] for other in SUBROOMS if other.rsplit(".", 1)[0] == room} - {own}
    files = list((ROOT / name.replace(".", "/")).glob("*.py"))
    found = {
        module.removeprefix(f"{room}.").split(".")[0]
        for file in files
        for module in imported(file)
        if module.startswith(f"{room}.")
    }
    assert found & siblings == set(SUBROOMS[name].split())
    assert len(files) - 1 <= MOST


def test_no_files_import_each_other() -> None:
    """In a circle, no file can be read before the others; what is imported for types only counts too."""
    modules = {".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): file for file in FILES}
    graph = {}
    for module, file in modules.items():
        nodes = nodes_of(file)
        names = {
            f"{node.module}.{alias.name}" if f"{node.module}.{alias.name}" in modules else node.module
            for node in nodes if isinstance(node, ast.ImportFrom) for alias in node.names
        }  # fmt: skip
        names |= {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
        graph[module] = names & modules.keys()
    assert list(TopologicalSorter(graph).static_order()), "a circle is named in the error"


def test_every_folder_of_a_room_with_sub_rooms_is_one() -> None:
    rooms = {name.rsplit(".", 1)[0].replace(".", "/") for name in SUBROOMS}
    folders = {init.parent for room in rooms for init in (ROOT / room).glob("*/__init__.py")}
    named_here = {ROOT / name.replace(".", "/") for name in SUBROOMS} | {ROOT / room for room in rooms}
    assert folders <= named_here
    assert [room for room in rooms if len(list((ROOT / room).glob("*.py"))) - 1 > MOST] == []


@pytest.mark.parametrize("library", LIBRARIES)
def test_one_room_touches_each_library(library: str) -> None:
    files = [named(file) for file in FILES if library in {module.split(".")[0] for module in imported(file)}]
    assert files
    assert [file for file in files if not file.startswith(LIBRARIES[library])] == []


def test_loading_a_scenario_does_not_go_down_into_traffic() -> None:
    code = "import sys, swarm.scenario.load; print([name for name in sys.modules if name.startswith('swarm.traffic')])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def kernels_of(file: Path) -> list[ast.FunctionDef]:
    """List a file's functions that numba compiles."""
    functions = [node for node in nodes_of(file) if isinstance(node, ast.FunctionDef)]
    return [node for node in functions if any(ast.unparse(one).startswith("njit") for one in node.decorator_list)]


def test_every_kernel_is_compiled_before_robots_start() -> None:
    """A kernel with a signature is compiled when its module is imported; without one, in the middle of a run."""
    found = set()
    for file in FILES:
        for kernel in kernels_of(file):
            (njit,) = [one for one in kernel.decorator_list if ast.unparse(one).startswith("njit")]
            assert isinstance(njit, ast.Call), f"{named(file)}: {kernel.name}"
            assert njit.args, f"{named(file)}: {kernel.name} has no signature"
            found.add(".".join(file.relative_to(ROOT).with_suffix("").parts))
    assert set(KERNELS) == found


def test_a_robots_kernel_takes_no_constant_from_another_file() -> None:
    """numba's cache does not notice that a global of another file has been tuned; it notices a maker's argument."""
    for file in [file for file in FILES if named(file).startswith("swarm/robot/")]:
        imports = [node for node in nodes_of(file) if isinstance(node, ast.ImportFrom)]
        constants = {alias.name for node in imports for alias in node.names if alias.name.isupper()}
        for kernel in kernels_of(file):
            used = {node.id for line in kernel.body for node in ast.walk(line) if isinstance(node, ast.Name)}
            where = f"{named(file)}: {kernel.name}"
            assert used & constants == set(), f"{where}: give it as an argument of the kernel or its maker"


def lines_of_code(file: Path) -> int:
    """Return how many lines a file has without its docstrings."""
    nodes = [node for node in nodes_of(file) if isinstance(node, DOCUMENTED) and ast.get_docstring(node)]
    told = [node.body[0] for node in nodes]
    return len(file.read_text(encoding="utf-8").splitlines()) - sum(
        (one.end_lineno or one.lineno) - one.lineno + 1 for one in told
    )


def test_no_file_is_long() -> None:
    assert [named(file) for file in FILES if lines_of_code(file) > LONGEST] == []


def test_a_test_comes_in_by_the_public_door() -> None:
    """A test that reads a private name holds how something is made, not what it does, and breaks when it is tidied."""
    found = {
        f"{named(file)}: {name} in {ast.unparse(node)}"
        for file in (ROOT / "tests").rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        for name in reached_for(node)
        if is_private(name)
    }
    assert found == set()


def reached_for(node: ast.AST) -> list[str]:
    """List the names that a part of a program reads of something else than itself."""
    match node:
        case ast.Attribute(value=ast.Name(id="self" | "cls")):
            return []
        case ast.Attribute(attr=name):
            return [name]
        case ast.ImportFrom(names=names):
            return [alias.name for alias in names]
        case ast.Call(func=ast.Attribute(attr="setattr" | "delattr"), args=[ast.Constant(value=str(path)), *_]):
            return path.split(".")
        case ast.Call(
            func=ast.Attribute(attr="setattr" | "delattr") | ast.Name(id="setattr" | "getattr" | "hasattr"),
            args=[_, ast.Constant(value=str(name)), *_],
        ):
            return [name]
    return []


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__") and name not in PRIVATE


def test_every_room_is_installed() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
    moved: dict[str, str] = project["package-dir"]
    folders = {
        ".".join(init.parent.relative_to(ROOT).parts) for top in TOPS for init in (ROOT / top).rglob("__init__.py")
    }
    assert set(project["packages"]) == folders | set(moved)
    assert all((ROOT / folder).is_dir() for folder in moved.values())


# ---- names: a function that acts is a verb and its object, a module is the noun of what is in it, a class is one thing

IRREGULAR: Final = re.compile(
    "said|told|kept|made|found|given|gone|heard|seen|left|held|chosen|known|meant|sent|asked|taken|shown|drawn|driven|"
    "spoken|cut|shut|lost|begun|worn|stood|came|woke"
)
TERMS: Final = {  # words of the field that end as a gerund or a participle does
    "dashboard/tape_recording.py", "swarm/robot/tuning.py", "swarm/storm/laws/driving.py", "world/measure/steering.py", "world/host/tape_feed.py",
}  # fmt: skip
PARTICIPLES: Final = 40  # functions whose first word is one, at most: as an adjective it may be the right word
SHARED: Final = 8  # class names that stand twice, at most: a protocol's own words, in the bridge to it


def is_participle(word: str) -> bool:
    return (word.endswith("ed") and len(word) > 4) or IRREGULAR.fullmatch(word) is not None


def test_names_say_what_a_function_does_and_a_class_is_one_thing() -> None:
    functions, classes = list[str](), dict[str, list[str]]()
    for file in FILES:
        for node in nodes_of(file):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not node.name.startswith("__"):
                words = node.name.strip("_").split("_")
                assert len(words) > 1 or not is_participle(words[0]), (
                    f"{named(file)}: {node.name}: a verb and its object"
                )
                functions += [f"{named(file)} {node.name}"] * is_participle(words[0])
            elif isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                classes.setdefault(node.name, []).append(named(file))
    assert len(functions) <= PARTICIPLES, functions
    shared = {name: places for name, places in classes.items() if len(places) > 1}
    assert len(shared) <= SHARED, shared
    assert [name for name, places in shared.items() if all("/bridge/" not in place for place in places)] == []


def test_a_module_is_named_by_a_noun() -> None:
    last = {named(file): file.stem.split("_")[-1] for file in FILES}
    wrong = [name for name, word in last.items() if word.endswith("ing") or is_participle(word)]
    assert set(wrong) <= TERMS
