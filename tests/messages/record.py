"""Records the example of every message whose newest record is not of this version: ``python -m tests.messages.record``.

A record is never changed: what was recorded once must be readable for as long as the wire has this version.
"""

from pathlib import Path
from typing import Final

from swarm.bus.codec import encode
from swarm.messages import VERSION
from tests.messages.examples import KINDS, example_of

FOLDER: Final = Path(__file__).parent / "recorded" / f"v{VERSION}"


def records(name: str) -> list[Path]:
    """Return the records of a message, oldest first."""
    return sorted(FOLDER.glob(f"{name}.*.msgpack"), key=lambda path: int(path.suffixes[0][1:]))


def main() -> None:
    """Write what is missing."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, kind in KINDS.items():
        present, payload = records(name), encode(example_of(kind))
        if not present or present[-1].read_bytes() != payload:
            path = FOLDER / f"{name}.{len(present) + 1}.msgpack"
            path.write_bytes(payload)
            print(f"{path.name} written")


if __name__ == "__main__":
    main()
