"""Planted faults that no test can see, for they change nothing that anybody relies on; each with the reason."""

from typing import Final

# fmt: off
_FAR: Final = "any number that no way is as long as will do"
_MOVER: Final = "a scenario gives every mover a radius or a size"
HARMLESS: Final[dict[tuple[str, str, str], str]] = {  # file, line of code, how the change begins: why
    ("world/physics.py", "shape = pymunk.Circle(body, radius) if radius is not None else "
     "pymunk.Poly.create_box(body, size or (1.0, 1.0))", "1.0 becomes"): _MOVER,
    ("swarm/traffic/cells.py", "FAR: Final = 1 << 30  # steps; no way leads there", "1 becomes"): _FAR,
    ("swarm/traffic/cells.py", "FAR: Final = 1 << 30  # steps; no way leads there", "30 becomes"): _FAR,
    ("world/physics.py", "length, width = size or (1.0, 1.0)", "1.0 becomes"): _MOVER,
}
# fmt: on
