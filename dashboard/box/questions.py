"""What may be asked about the past of a run, and the answers: between a page, the box, and its child with the tape."""

from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta, Struct

from swarm.messages import Id
from swarm.messages.fields import doc

TRAILS: Final = "box/trails"
What = Literal["why", "past"]
Frame = Annotated[msgspec.Raw, Meta(extra_json_schema={"type": "object"})]  # JSON, as `frames.make_frame` writes it
QUESTIONS: Final[tuple[What, ...]] = ("why", "past")  # each is a path


class Question(Struct, frozen=True, kw_only=True):
    """A question about a moment of the run."""

    at: Annotated[
        Annotated[float, Meta(ge=0.0, le=1e6)] | None,
        doc("s; time of the run; null: 5 ticks before the tape ends, which robots may still answer"),
    ] = None
    run: Annotated[Annotated[int, Meta(ge=0, le=2**53)] | None, doc("its number; null: the last one")] = None


class MomentAnswer(Struct, frozen=True, kw_only=True):
    """What holds at a moment of the run, by its tape."""

    run: Annotated[int, doc("its number")]
    at: Annotated[float, doc("s; time of the run")]
    doubt: Annotated[str | None, doc("what is wrong with the tape up to then; null: nothing")]
    text: Annotated[str | None, doc("why the robot does what it does, a cause a line")] = None
    frames: Annotated[list[Frame], doc("`key` and `message`, as on `/live`, of that moment; and `box/trails`")] = []


class QuestionRefusal(Struct, frozen=True):
    """A sentence that says why there is no answer."""

    refused: str


Line = tuple[What, Id | None, Question]  # one that the child reads; with the robot asked about, or selected
