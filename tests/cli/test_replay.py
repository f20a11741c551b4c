"""`swarm replay`: what it says of a tape, and its exit status."""

import random
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Final

import msgpack
import pytest

from swarm.cli import main
from swarm.fingerprint import fingerprint
from swarm.tape.reader import TapeFile
from tests.tape.made import made

TICKS: Final = 20
SAME: Final = f"{2 * TICKS} answers, all as they were; digest "
MOST: Final = 256_000  # kB that a bad file may cost
MEASURED: Final = """
import re, sys
from pathlib import Path
from swarm.cli import main
status = main(["replay", sys.argv[1]])
print(status, *re.findall("VmHWM: *\t*(.*) kB", Path("/proc/self/status").read_text()))
"""


@pytest.fixture
def tape(tmp_path: Path) -> Path:
    return made(tmp_path / "run.swarm", ticks=TICKS)


def test_a_good_tape_is_the_run(tape: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(tape), "--laws"]) == 0
    first, last = capsys.readouterr().out.splitlines()
    assert SAME in first
    assert last == "13 laws kept"


def test_a_tape_that_is_cut_is_replayed_as_far_as_it_goes(tape: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tape.write_bytes(tape.read_bytes()[:-1])
    assert main(["replay", str(tape)]) == 0
    first, last = capsys.readouterr().out.splitlines()
    assert first.startswith("the file ends within a row: ")
    assert f"{2 * TICKS - 2} answers, all as they were" in last


def test_a_tape_that_is_cut_is_analyzed_too(tape: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tape.write_bytes(tape.read_bytes()[:-1])
    assert main(["analyze", str(tape)]) == 0
    told = capsys.readouterr().out.splitlines()
    assert "not complete after 1.0 s: the tape ends here; not reached: r1 target 1" in told[0]
    assert told[-2].startswith("note: the file ends within a row: ")
    assert told[-1].startswith("contacts: ")


def test_a_tape_of_other_code_is_named_and_replayed_to_its_first_difference(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tape = made(tmp_path / "other.swarm", ticks=TICKS, version="0.0.9", code="0123")
    assert main(["replay", str(tape)]) == 0
    named, same = capsys.readouterr().out.splitlines()
    assert named == f"made by other code: version 0.0.9, fingerprint 0123; this is {fingerprint()}"
    assert SAME in same

    whole = bytearray(tape.read_bytes())
    whole[-1] ^= 1
    tape.write_bytes(whole)
    assert main(["replay", str(tape)]) == 1
    assert capsys.readouterr().out.splitlines()[0] == named
    assert main(["replay", str(tape)]) == 1
    assert f"first difference at tick {TICKS - 1}, 0.95 s: " in capsys.readouterr().out


def behind_a_head(rows: bytes) -> Callable[[Path], bytes]:
    """Return what makes a file with a good head and other rows."""
    return lambda tape: tape.read_bytes()[: TapeFile(tape).size] + rows


BAD: Final[dict[str, Callable[[Path], bytes]]] = {
    "random bytes": lambda tape: random.Random(1).randbytes(3_000_000),
    "nested lists": lambda tape: b"\x91" * 3_000_000,
    "a long list": lambda tape: b"\xdd\x00\x01\x00\x00" + b"\x90" * 3_000_000,
    "random rows": behind_a_head(random.Random(1).randbytes(3_000_000)),
    "rows of empty lists": behind_a_head(msgpack.packb([[[[]] * 1000] * 400, b""])),
    "a large row": behind_a_head(msgpack.packb([[bytes(30_000_000)], b""])),
}


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="tells a process's memory on Linux only")
@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_costs_one_sentence_and_little_memory(name: str, tape: Path) -> None:
    tape.write_bytes(BAD[name](tape))
    run = subprocess.run(
        [sys.executable, "-c", MEASURED, str(tape)], capture_output=True, text=True, check=True, timeout=100
    )
    status, used = map(int, run.stdout.split())
    assert status == 2
    assert used <= MOST
    (sentence,) = run.stderr.splitlines()
    assert sentence.startswith(f"swarm: tape {tape}: ")
    assert "got ;" not in sentence
