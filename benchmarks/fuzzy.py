"""The fuzzy controller beside plain C, one inference a call: ``python -m benchmarks.fuzzy``.

Each round times both in turn, with the same random inputs.
"""

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
INPUTS, ROUNDS = 1000, 15  # inferences per round; rounds
ALLOWED_OF_C = 10  # times slower than C

Speeds = list[tuple[float, float]]


def yardstick(folder: Path) -> tuple[Callable[[float, float, float, float], tuple[float, float]], object]:
    """Compile the yardstick in C; return a function of one inference (cffi), and the library, which must stay open."""
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


def each(wheel_speeds: Callable[..., tuple[float, float]], rows: list[list[float]]) -> Speeds:
    return [wheel_speeds(left, front, right, heading) for left, front, right, heading in rows]


def main() -> None:
    profile = load_profile("paper")
    controller = Controller(profile)
    rows = np.random.default_rng(1).uniform([0.3, 0.3, 0.3, -90], [1.6, 1.6, 1.6, 90], (INPUTS, 4)).tolist()
    ours = each(controller.wheel_speeds, rows)
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
        seconds = interleave(cases, ROUNDS)

    each_seconds = {name: np.array(times) / INPUTS for name, times in seconds.items()}
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

    if "C" in ratio:
        print(f"ours takes {1 / ratio['C']:.2f} times C's time (at most {ALLOWED_OF_C} allowed)")
        if 1 / ratio["C"] > ALLOWED_OF_C:
            sys.exit("missed against C")


if __name__ == "__main__":
    main()
