"""Feeds damaged map files to every loader: ``python -m benchmarks.fuzz_maps [INPUTS [SEED]]``.

A loader may return a map or raise a ``ConfigError`` of one sentence. Anything else is printed with the input that
reproduces it, and the exit status is 1. The files and the damage are those of ``tests/maps/test_fuzz.py``.
"""

import random
import sys
import traceback
import warnings
from collections import Counter
from time import perf_counter

from tests.maps.drawings import FILES, read
from tests.maps.test_fuzz import damaged


def main(inputs: int = 120_000, seed: int = 1) -> int:
    """Try ``inputs`` damaged files; return the exit status."""
    warnings.simplefilter("error")
    draw = random.Random(seed)
    kinds = sorted(FILES)
    outcomes: Counter[tuple[str, str]] = Counter()
    surprises: dict[str, bytes] = {}
    began = slowest = perf_counter()
    slowest = 0.0
    for number in range(inputs):
        kind = kinds[number % len(kinds)]
        content = damaged(draw.choice(FILES[kind]), draw)
        start = perf_counter()
        try:
            outcomes[kind, "read" if read(kind, content) else "refused"] += 1
        except BaseException as error:  # any other error is a finding
            if isinstance(error, KeyboardInterrupt):
                raise
            outcomes[kind, "SURPRISE"] += 1
            place = traceback.extract_tb(error.__traceback__)[-1]
            surprises.setdefault(f"{kind}: {error!r:.120} at {place.filename}:{place.lineno}", content)
        slowest = max(slowest, perf_counter() - start)
    print(f"{inputs} inputs, seed {seed}, {perf_counter() - began:.0f} s, slowest {slowest * 1e3:.1f} ms")
    for kind in kinds:
        print(
            f"  {kind:<9}", ", ".join(f"{count} {said}" for (of, said), count in sorted(outcomes.items()) if of == kind)
        )
    for surprise, content in surprises.items():
        print(f"\n{surprise}\n  {content!r:.400}")
    return 1 if surprises else 0


if __name__ == "__main__":
    sys.exit(main(*(int(argument) for argument in sys.argv[1:3])))
