"""The test vectors of ``schemas/vectors/``: what a robot of another make is to compute, made by our own code."""

from collections.abc import Callable
from functools import partial
from typing import Final

from docs.vectors import floors, plan, radio, records
from docs.vectors.writing import text

TABLES: Final = (floors.VECTORS, radio.VECTORS, records.VECTORS, plan.VECTORS)
FILES: Final[dict[str, Callable[[], str]]] = {  # relative to docs/
    f"../schemas/vectors/{name}.json": partial(text, make) for table in TABLES for name, make in table.items()
}
