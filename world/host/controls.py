"""The paper's buttons and a few more: what each button does in each phase of a run."""

from collections.abc import Sequence
from typing import Final

from swarm.errors import PeerError
from swarm.messages import Do, Phase

# fmt: off
# phase of the run -> {button that may be pressed: next phase}
BUTTONS: Final = {
    Phase.WAITING: {Do.GO: Phase.RUNNING, Do.RESTART: Phase.WAITING, Do.STOP: Phase.OVER},
    Phase.RUNNING: {Do.PAUSE: Phase.PAUSED, Do.RESTART: Phase.RUNNING, Do.STOP: Phase.OVER},
    Phase.PAUSED:  {Do.RESUME: Phase.RUNNING, Do.GO: Phase.RUNNING, Do.RESTART: Phase.PAUSED, Do.STOP: Phase.OVER},
    Phase.OVER:    {},
}
# fmt: on
# buttons whose phase has been reached: an answer may be lost, so pressing again is no error
ALREADY: Final = {Phase.RUNNING: (Do.GO, Do.RESUME), Phase.PAUSED: (Do.PAUSE,), Phase.OVER: (Do.STOP,)}


def already(phase: Phase, do: Do) -> bool:
    """Return True if a button has nothing to do, because the run is as it says."""
    return do in ALREADY.get(phase, ())


def pressed(phase: Phase, do: Do, absent: Sequence[str]) -> Phase:
    """Return the phase that a button leads to; ``absent`` are the robots whose process is not present.

    Raises:
        PeerError: the button may not be pressed in this phase, or the run cannot begin yet.
    """
    then = BUTTONS[phase].get(do)
    if then is None:
        can = ", ".join(BUTTONS[phase]) or "nothing"
        raise PeerError(f"the run is {phase.value}: expected one of ({can}), got {do.value}")
    if do is Do.GO and absent:
        raise PeerError(f"expected all robots to be present, {', '.join(absent)} missing; wait for them")
    return then
