"""The types of fields with their bounds, and the base of all messages."""

from math import pi
from typing import Annotated, Final

from msgspec import Meta, Struct

VERSION: Final = 1  # of the wire: `v` in every payload

ID_PATTERN: Final = r"^[A-Za-z0-9_.:-]{1,64}\Z"
Id = Annotated[str, Meta(pattern=ID_PATTERN)]
OptionalId = Annotated[str, Meta(pattern=r"^[A-Za-z0-9_.:-]{0,64}\Z")]
Metres = Annotated[float, Meta(ge=-1e6, le=1e6)]
Length = Annotated[float, Meta(ge=0, le=1e6)]
Angle = Annotated[float, Meta(ge=-pi - 1e-9, le=pi + 1e-9)]
Travel = Annotated[float, Meta(ge=0, le=1e12)]
Speed = Annotated[float, Meta(ge=-20, le=20)]
Seconds = Annotated[float, Meta(ge=0, le=1e9)]
Scale = Annotated[float, Meta(ge=0.01, le=1)]
Sender = Annotated[int, Meta(ge=0, lt=2**32)]  # a random number; see `Sequence`
Count = Annotated[int, Meta(ge=0, le=2**53)]
Text = Annotated[str, Meta(max_length=2000)]
DRAWING_LIMIT: Final = 200_000  # characters
Drawing = Annotated[str, Meta(max_length=DRAWING_LIMIT)]
Point = tuple[Metres, Metres]
Headings = list[Angle | None]  # for each of some targets; shorter: none for the rest


def doc(text: str) -> Meta:
    """Return a field's description, unit first; the documentation and the JSON Schema show it."""
    return Meta(description=text)


class Message(Struct, frozen=True, kw_only=True, tag_field="v", tag=VERSION):
    """Base of all messages; each payload begins with ``v``, the version of the wire."""
