"""The fuzzy controller beside plain C and the fuzzy libraries, one inference a call: ``python -m benchmarks.fuzzy``.

All are timed in turn within each round, over the same random inputs; each library runs in an environment of its own
(.venv-peers-*), made at the first run.
"""

import json
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import numpy as np
from cffi import FFI

from benchmarks.measure import interleave, machine, table
from swarm.fuzzy import Controller, load_profile

ROOT = Path(__file__).parents[1]
YARDSTICK = ROOT.parent / "shared" / "yardsticks" / "fuzzy.c"
PEERS = {
    "scikit-fuzzy": ["scikit-fuzzy==0.5.0", "numpy", "scipy", "networkx", "packaging"],
    "simpful": ["simpful==2.12.0"],
    "pyfuzzylite": ["pyfuzzylite==8.0.6"],  # wants numpy < 2, hence the environments
}
INPUTS, PEER_INPUTS, ROUNDS = 1000, 4, 15  # inferences a round: ours and C, a peer's
REQUIRED_OF_PEERS, ALLOWED_OF_C = 1000, 10  # times slower than ours, times slower than C

Speeds = list[tuple[float, float]]


def yardstick(folder: Path) -> tuple[Callable[[float, float, float, float], tuple[float, float]], object]:
    """Compile the yardstick, to be called by cffi once an inference; the second is the library, to be kept open."""
    library = folder / "fuzzy.so"
    subprocess.run(["cc", "-O3", "-march=native", "-shared", "-fPIC", YARDSTICK, "-o", library], check=True)
    ffi = FFI()
    ffi.cdef("void fuzzy_init(void); void wheel_speeds(double, double, double, double, double *);")
    compiled = ffi.dlopen(str(library))
    compiled.fuzzy_init()
    out, infer = ffi.new("double[2]"), compiled.wheel_speeds

    def wheel_speeds(left: float, front: float, right: float, heading: float) -> tuple[float, float]:
        infer(left, front, right, heading, out)
        return out[0], out[1]

    return wheel_speeds, compiled


class Peer:
    """A peer library in an environment and process of its own."""

    def __init__(self, name: str, document: dict[str, object]) -> None:
        python = ROOT / f".venv-peers-{name}" / "bin" / "python"
        if not python.exists():
            print(f"installing {name} ...", file=sys.stderr)
            subprocess.run([sys.executable, "-m", "venv", python.parents[1]], check=True)
        pip = [python, "-m", "pip", "--disable-pip-version-check"]
        subprocess.run([*pip, "install", "--quiet", *PEERS[name]], check=True, stderr=subprocess.DEVNULL)
        frozen = subprocess.run([*pip, "freeze"], check=True, capture_output=True, text=True).stdout
        versions = dict(line.split("==") for line in frozen.splitlines() if "==" in line)
        self.version = f"{versions[name]}, numpy {versions['numpy']}"
        self.process = subprocess.Popen(
            [python, Path(__file__).with_name("fuzzy_peer.py"), name],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip
        self._send(document)

    def _send(self, message: object) -> None:
        assert self.process.stdin is not None
        print(json.dumps(message), file=self.process.stdin, flush=True)

    def wheel_speeds(self, rows: list[list[float]]) -> Speeds:
        """Have it infer row by row."""
        self._send(rows)
        assert self.process.stdout is not None
        return [(left, right) for left, right in json.loads(self.process.stdout.readline())]

    def close(self) -> None:
        """End its process."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait()


def each(wheel_speeds: Callable[..., tuple[float, float]], rows: list[list[float]]) -> Speeds:
    return [wheel_speeds(left, front, right, heading) for left, front, right, heading in rows]


def main() -> None:
    profile = load_profile("paper")
    controller = Controller(profile)
    rows = np.random.default_rng(1).uniform([0.3, 0.3, 0.3, -90], [1.6, 1.6, 1.6, 90], (INPUTS, 4)).tolist()
    ours = each(controller.wheel_speeds, rows)
    slices = {name: iter(range(0, INPUTS, PEER_INPUTS)) for name in PEERS}  # inputs no cache has seen
    print(machine())

    with TemporaryDirectory() as folder:
        cases: dict[str, Callable[[], object]] = {"this project": lambda: each(controller.wheel_speeds, rows)}
        notes = {"this project": f"exact centroid, numba {version('numba')}"}
        apart = {"this project": 0.0}
        if YARDSTICK.exists():
            infer, _library = yardstick(Path(folder))
            cases["C"] = lambda: each(infer, rows)
            notes["C"] = f"200 samples, cc -O3 by cffi {version('cffi')}"
            apart["C"] = float(np.abs(np.array(each(infer, rows)) - ours).max())
        else:
            print(f"{YARDSTICK} is not here: C is left out.")
        peers = {name: Peer(name, profile.to_builtins()) for name in PEERS}

        def turn(name: str) -> None:
            start = next(slices[name])
            speeds = peers[name].wheel_speeds(rows[start : start + PEER_INPUTS])
            apart[name] = max(apart.get(name, 0.0), float(np.abs(np.array(speeds) - ours[start:][:PEER_INPUTS]).max()))

        for name, peer in peers.items():
            cases[name] = lambda name=name: turn(name)
            notes[name] = peer.version
        seconds = interleave(cases, ROUNDS)
        for peer in peers.values():
            peer.close()

    each_seconds = {
        name: np.array(times) / (PEER_INPUTS if name in PEERS else INPUTS) for name, times in seconds.items()
    }
    ratio = {name: median(times / each_seconds["this project"]) for name, times in each_seconds.items()}
    rows_of_table = [("one inference a call", "us", "x ours", "at most apart [m/s]", "version")]
    rows_of_table += [
        (name, f"{median(times) * 1e6:,.2f}", f"{ratio[name]:,.2f}", f"{apart[name]:.1e}", notes[name])
        for name, times in each_seconds.items()
    ]
    print(table(rows_of_table))
    many = np.array(rows * 10)
    batch = interleave({"batch": lambda: controller.wheel_speeds_many(many)}, ROUNDS)["batch"]
    explain = interleave({"explain": lambda: [controller.explain(*row) for row in rows]}, ROUNDS)["explain"]
    print(f"wheel_speeds_many, {len(many):,} rows: {median(batch) / len(many) * 1e6:.2f} us a row")
    print(f"explain: {median(explain) / INPUTS * 1e6:.0f} us")

    missed = [name for name in PEERS if ratio[name] < REQUIRED_OF_PEERS]
    if "C" in ratio:
        print(f"ours takes {1 / ratio['C']:.2f} times C's time (at most {ALLOWED_OF_C} allowed)")
        missed += ["C"] if 1 / ratio["C"] > ALLOWED_OF_C else []
    if missed:
        sys.exit(f"missed against {', '.join(missed)}")


if __name__ == "__main__":
    main()
