"""Rerun, imported so that it logs errors only: its warnings are for those who write programs with it.

It reads the level once, in the variable that Zenoh reads too, so the variable is as it was afterwards.
"""

import os
from typing import Final

VARIABLE: Final = "RUST_LOG"

if VARIABLE in os.environ:
    import rerun
else:
    os.environ[VARIABLE] = "error"
    import rerun  # noqa: F401

    del os.environ[VARIABLE]
