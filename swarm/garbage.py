"""Python's search for reference cycles, in processes that step robots."""

import gc
from typing import Final

SELDOM: Final = 20_000  # objects more than at the last search, instead of 700; at most a few MB


def collect_seldom() -> None:
    """Leave out what is loaded, and look for reference cycles more rarely: a step makes hardly any.

    Searching takes a tenth of the CPU time of a tick with 8 robots in one process, and a sixth with 128.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(SELDOM)
