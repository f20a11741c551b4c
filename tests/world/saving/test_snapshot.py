"""A run that goes on from a snapshot is the run that nothing disturbed; a file that is no snapshot is refused."""

import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from swarm.errors import ConfigError
from swarm.geometry import Pose
from swarm.messages import Edit, Kind, Order
from swarm.scenario.load import Scenario
from tests.shared import scenario_of, with_settings
from tests.world.shared import NOISE, command, reborn, snapshot_of, through_file
from world.bodies.physics import Physics
from world.faults import Faults
from world.saving import snapshot_file
from world.simulate import Simulation
from world.world import World

MOVERS: list[dict[str, Any]] = [
    {"radius": 0.3, "waypoints": [[6.0, 1.6], [6.0, 4.4]], "speed": 0.5},
    {"size": [0.4, 0.3], "waypoints": [[3.5, 1.6], [3.5, 4.4]], "speed": 0.3},
]
FAST = [mover | {"speed": mover["speed"] + 0.5} for mover in MOVERS]
EDITS = [
    {"at": 3.0, "kind": "wall", "low": [6.2, 1.2], "high": [6.8, 1.8]},
    {"at": 9.0, "kind": "free", "low": [6.2, 1.2], "high": [6.8, 1.8]},
]
ORDERS = [
    {"at": 2.0, "robot": "r1", "targets": [[7.5, 2.5], [4.5, 4.5]]},
    {"at": 3.0, "robot": "r2", "do": "stop"},
    {"at": 4.0, "robot": "r3", "do": "home"},
    {"at": 5.0, "robot": "r1", "update": 1, "targets": [[4.5, 2.5]], "home": True},
    {"at": 7.0, "robot": "r2", "do": "go_on"},
    {"at": 8.0, "robot": "r3", "do": "cancel"},
]
POOL = [[7.5, 2.5], [4.5, 4.5], [2.5, 2.5]]
LENGTH = 12.0  # s

# fmt: off
RUNS: dict[str, tuple[dict[str, Any], int, Faults]] = {  # fields of the scenario, robots, faults
    "plain":                   ({}, 4, Faults()),
    "noise and loss":          (NOISE, 3, Faults()),
    "edits":                   ({"edits": EDITS}, 4, Faults()),
    "movers that run into robots": ({"movers": FAST}, 4, Faults(held_up=3.0)),
    "suspended, dead, late":   (NOISE, 4, Faults(suspended=8.0, killed={"r2": 6.0}, late=0.1)),
    "patrol":                  (NOISE | {"patrol": True, "targets": [[7.5, 2.5], [4.5, 4.5]]}, 3, Faults()),
    "orders":                  ({"orders": ORDERS}, 4, Faults()),
    "a pool":                  ({"pool": POOL, "targets": []}, 4, Faults()),
    "all":                     (NOISE | {"movers": MOVERS, "edits": EDITS}, 4, Faults(held_up=6.0, suspended=9.0)),
}
# fmt: on


def run(scenario: Scenario, robots: int, seed: int, faults: Faults, file: Path | None = None) -> Mapping[str, Any]:
    """Return the report of a run; with a file, the world is replaced from it whenever its state is to be saved."""
    simulation = Simulation.of(scenario, robots, seed, faults)
    while simulation.world.time < LENGTH:
        simulation.step()
        if file is not None and simulation.world.due:
            simulation.world = reborn(simulation, file)
    return simulation.report(1.0, LENGTH)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", RUNS)
def test_a_world_that_goes_on_from_its_snapshots_is_the_undisturbed_one(name: str, seed: int, tmp_path: Path) -> None:
    fields, robots, faults = RUNS[name]
    scenario = scenario_of(**fields)
    expected = run(scenario, robots, seed, faults)
    got = run(scenario, robots, seed, faults, tmp_path / "world.snapshot")
    for field, value in expected.items():
        assert got[field] == value, field
    if "movers" in name:
        assert sum(expected["contacts"].values()) > 0, "contacts are the hard part"


def test_the_file_keeps_all_of_it(tmp_path: Path) -> None:
    scenario = scenario_of(**NOISE, edits=EDITS, movers=MOVERS)
    simulation = Simulation.of(scenario, 3, 5)
    for _ in range(90):
        simulation.step()
    simulation.world.edit(Edit(kind=Kind.WALL, low=(8.2, 1.2), high=(8.8, 1.8)))
    before = snapshot_of(simulation.world, simulation.scenario, simulation.seed)
    file = tmp_path / "s"
    snapshot_file.write(before, file)
    packed = snapshot_file.ENCODER.encode
    assert packed(snapshot_file.read(file, scenario, 3, 5)) == packed(before)
    assert [path.name for path in tmp_path.iterdir()] == ["s"], "nothing is left beside it"
    for _ in range(2):
        snapshot_file.write(before, file)
        assert {path.name for path in tmp_path.iterdir()} == {"s", snapshot_file.earlier_file(file).name}
    snapshot_file.make_room(file)
    assert [path.name for path in tmp_path.iterdir()] == ["s"]
    world = reborn(simulation, file)
    assert packed(world.save()) == packed(simulation.world.save())


# --- files that are refused ---


def whole() -> bytes:
    simulation = Simulation.of(scenario_of(), 2, 1)
    simulation.step()
    packed = snapshot_file.ENCODER.encode(snapshot_of(simulation.world, simulation.scenario, simulation.seed))
    return snapshot_file.HEAD + snapshot_file.checksum(packed) + packed


def signed(packed: bytes) -> bytes:
    return snapshot_file.HEAD + snapshot_file.checksum(packed) + packed


def with_field(content: bytes, **fields: object) -> bytes:
    raw = msgspec.msgpack.decode(content[len(snapshot_file.HEAD) + snapshot_file.CHECK :])
    return signed(msgspec.msgpack.encode(raw | fields))


# fmt: off
BAD: dict[str, tuple[Callable[[bytes], bytes], str]] = {  # what becomes of a good file: the reason
    "empty":            (lambda good: b"",                              "got another file"),
    "text":             (lambda good: b"hello\n",                       "got another file"),
    "pickle":           (lambda good: b"\x80\x04\x95",                  "got another file"),
    "another version":  (lambda good: good.replace(b"snapshot 7", b"snapshot 9", 1), "got one of version b'9"),
    "only a head":      (lambda good: good[:len(snapshot_file.HEAD)],        "cut or changed"),
    "cut":              (lambda good: good[:-1],                        "cut or changed"),
    "longer":           (lambda good: good + b"\0",                     "cut or changed"),
    "one bit":          (lambda good: good[:-9] + bytes([good[-9] ^ 1]) + good[-8:], "cut or changed"),
    "not a map":        (lambda good: signed(b"\x93\1\2\3"),            "expected a snapshot, got one with"),
    "no MessagePack":   (lambda good: signed(b"\xc1"),                  "expected a snapshot, got one with"),
    "a field too many": (lambda good: with_field(good, extra=1),        "unknown field `extra`"),
    "a wrong type":     (lambda good: with_field(good, run="one"),      "Expected `int`, got `str`"),
    "another seed":     (lambda good: with_field(good, seed=7),         "seed: expected 1, got 7"),
    "another fleet":    (lambda good: with_field(good, robots=9),       "robots: expected 2, got 9"),
    "another scenario": (lambda good: with_field(good, scenario="x"),   "scenario: expected"),
}
# fmt: on


@pytest.mark.parametrize("name", BAD)
def test_of_a_spoilt_file_the_one_before_is_taken_and_that_is_said(name: str, tmp_path: Path) -> None:
    simulation, file, said = Simulation.of(scenario_of(), 2, 1), tmp_path / "s", list[str]()
    for _ in range(3):
        simulation.step()
        snapshot_file.write(snapshot_of(simulation.world, simulation.scenario, simulation.seed), file)
    spoil, reason = BAD[name]
    file.write_bytes(spoil(whole()))
    found = snapshot_file.newest(file, simulation.scenario, 2, 1, said.append)
    assert found is not None
    assert found.state.tick == 2
    assert found.identity == "abc"
    (line,) = said
    assert reason in line
    assert line.endswith("; went on from the snapshot before")
    snapshot_file.earlier_file(file).write_bytes(spoil(whole()))
    with pytest.raises(ConfigError) as fault:
        snapshot_file.newest(file, simulation.scenario, 2, 1, said.append)
    assert reason in str(fault.value)
    assert str(fault.value).startswith(f"snapshot {file}: ")


@pytest.mark.parametrize("step", ["pathlib.Path.unlink", "os.link", "os.replace"])
def test_a_world_killed_at_any_step_of_writing_leaves_a_whole_one_although_the_file_is_spoilt(
    step: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The file is spoilt where it is, so that every other name of it is spoilt too."""
    simulation, file, said = Simulation.of(scenario_of(), 2, 1), tmp_path / "s", list[str]()

    def save() -> None:
        simulation.step()
        snapshot_file.write(snapshot_of(simulation.world, simulation.scenario, simulation.seed), file)

    def killed(*arguments: object, **more: object) -> None:
        raise KeyboardInterrupt

    save()
    save()
    with monkeypatch.context() as patched:
        patched.setattr(step, killed)
        with pytest.raises(KeyboardInterrupt):
            save()
    assert snapshot_file.read(file, simulation.scenario, 2, 1).state.tick == 2
    os.truncate(file, file.stat().st_size // 2)
    found = snapshot_file.newest(file, simulation.scenario, 2, 1, said.append)
    assert found is not None
    assert found.state.tick == 3
    assert said[0].endswith("; went on from the snapshot that was being written")


def test_robots_that_may_know_later_orders_have_to_join_the_world_of_the_one_before(tmp_path: Path) -> None:
    simulation, file = Simulation.of(scenario_of(), 2, 1), tmp_path / "s"
    simulation.world.request("r1", Order(id="a", targets=[(2.5, 2.5)]))
    for _ in range(2):
        snapshot_file.write(snapshot_of(simulation.world, simulation.scenario, simulation.seed), file)
    file.write_bytes(b"")
    found = snapshot_file.newest(file, simulation.scenario, 2, 1, print)
    assert found is not None
    assert found.identity != "abc"


def test_without_a_file_a_new_run_begins_whatever_was_before(tmp_path: Path) -> None:
    simulation, file = Simulation.of(scenario_of(), 2, 1), tmp_path / "s"
    for _ in range(2):
        snapshot_file.write(snapshot_of(simulation.world, simulation.scenario, simulation.seed), file)
    file.unlink()
    assert snapshot_file.newest(file, simulation.scenario, 2, 1, print) is None
    snapshot_file.write(snapshot_of(simulation.world, simulation.scenario, simulation.seed), file)
    assert not snapshot_file.earlier_file(file).exists()


def test_a_missing_file_and_a_state_of_another_size_are_refused(tmp_path: Path) -> None:
    scenario = scenario_of()
    with pytest.raises(ConfigError, match="No such file"):
        snapshot_file.read(tmp_path / "none", scenario, 2, 1)
    state = Simulation.of(scenario, 3, 1).world.save()
    with pytest.raises(ConfigError, match="expected 2 robots, got 3"):
        Simulation.of(scenario, 2, 1).world.restore(state)


def test_the_snapshot_of_a_changed_scenario_is_refused(tmp_path: Path) -> None:
    file, scenario = tmp_path / "s", Simulation.of(scenario_of(), 2, 1).scenario
    file.write_bytes(whole())
    with pytest.raises(ConfigError, match="scenario: expected"):
        snapshot_file.read(file, with_settings(scenario, reach=0.37), 2, 1)


# --- nothing is forgotten ---

CACHES = {"_shown", "_places", "_controllers", "told", "due", "_tree", "_block"}  # attributes that are computed anew
PLAIN = (bool, int, float, str, bytes, set, frozenset, type(None))


def differences(one: Any, other: Any, where: str = "world") -> Iterator[str]:  # noqa: ANN401
    """Yield where two values differ; of the world's own objects, in any attribute."""
    if isinstance(one, Physics):
        yield from differences(one.state, other.state, where)  # the rest is pymunk's, or read from it
    elif type(one).__module__.startswith("world.") and hasattr(one, "__dict__"):
        assert vars(one).keys() == vars(other).keys()
        for name in vars(one).keys() - CACHES:
            yield from differences(vars(one)[name], vars(other)[name], f"{where}.{name}")
    elif isinstance(one, np.random.Generator):
        if one.bit_generator.state != other.bit_generator.state:
            yield where
    elif isinstance(one, msgspec.Struct):
        for name in one.__struct_fields__:
            yield from differences(getattr(one, name), getattr(other, name), f"{where}.{name}")
    elif isinstance(one, dict):
        assert one.keys() == other.keys(), where
        yield from (line for key in one for line in differences(one[key], other[key], f"{where}[{key}]"))
    elif isinstance(one, list | tuple):
        pairs = enumerate(zip(one, other, strict=True))
        yield from (line for number, pair in pairs for line in differences(*pair, f"{where}[{number}]"))
    elif isinstance(one, PLAIN) and one != other:
        yield f"{where}: {one!r}, {other!r}"


def test_a_world_from_a_file_has_every_attribute_of_the_one_that_was_saved(tmp_path: Path) -> None:
    """A new attribute is part of a state, or it is computed again and has a word in ``CACHES``."""
    for fields in (NOISE | {"movers": FAST, "edits": EDITS, "orders": ORDERS}, NOISE | {"pool": POOL, "targets": []}):
        simulation = Simulation.of(scenario_of(**fields), 4, 1, Faults(held_up=6.0, suspended=9.0))
        for tick in range(round(LENGTH / simulation.world.dt)):
            simulation.step()
            if tick % 40 == 0:
                again = reborn(simulation, tmp_path / "s")
                assert list(differences(simulation.world, again)) == [], tick


# --- bodies that press against each other ---


def pressed(file: Path | None) -> tuple[str, list[int]]:
    """Return the digest of robots that push each other and a wall, and the ticks with contacts; perhaps restored."""
    scenario = scenario_of(movers=MOVERS)
    starts = [Pose(7.0, 3.4, 0.0), Pose(8.0, 3.6, 3.0), Pose(7.5, 2.6, 1.6), Pose(8.4, 4.5, 1.0)]
    world, touching = World(scenario, starts, 1), []
    for tick in range(130):
        speed = 0.5 if tick % 50 < 40 else -0.2
        world.step({
            name: command(speed, speed + 0.05 * number, tick=tick)
            for number, name in enumerate(world.robots)
        })  # fmt: skip
        touching += [tick] * bool(world.bodies.physics.touching)
        if file is not None and world.due:
            world = through_file(world, scenario, 1, file)
    return world.measures.recorder.digest, touching


def test_what_the_physics_engine_remembers_of_contacts_makes_no_difference(tmp_path: Path) -> None:
    undisturbed, touching = pressed(None)
    assert {39, 59, 79} <= set(touching), "they press when the state is saved"
    assert pressed(tmp_path / "s") == (undisturbed, touching)
