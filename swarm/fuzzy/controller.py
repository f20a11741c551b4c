"""The controller: a profile, ready to be asked."""

from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm.errors import SwarmError
from swarm.fuzzy.explanation import Explainer, Explanation
from swarm.fuzzy.kernel import infer, infer_rows
from swarm.fuzzy.profile import Profile
from swarm.fuzzy.tables import tables
from swarm.fuzzy.vocabulary import INPUTS


class ControlInputError(SwarmError, ValueError):
    """A distance or bearing no sensor can mean: not a number, infinite, or a negative distance."""


class Controller:
    """Mamdani min-max inference with the exact centroid (Mamdani and Assilian 1975), over any `Profile`.

    It has no state: equal inputs give equal speeds, bit for bit, in any process.
    """

    def __init__(self, profile: Profile) -> None:
        self.profile = profile
        self.tables = tables(profile)
        self._explainer = Explainer(profile)

    def __reduce__(self) -> tuple[type["Controller"], tuple[Profile]]:
        return Controller, (self.profile,)

    def wheel_speeds(self, left: float, front: float, right: float, heading_deg: float) -> tuple[float, float]:
        """Infer the rim speeds of the left and right wheel [m/s].

        ``left``, ``front`` and ``right`` are free distances from the robot's edge [m], clipped to the profile's
        universe; ``heading_deg`` is the bearing of the target [degrees], positive when it is to the RIGHT (the paper's
        sign, the opposite of REP-103), taken into -180..180.

        Raises:
            ControlInputError: an input is NaN or infinite, or a distance is negative.
        """
        left_v, right_v, _ = infer(left, front, right, heading_deg, *self.tables)
        if left_v != left_v:
            raise refusal(left, front, right, heading_deg)
        return left_v, right_v

    def explain(self, left: float, front: float, right: float, heading_deg: float) -> Explanation:
        """Infer as `wheel_speeds` does, and say why: memberships, the behaviours' weights, the rules that fired.

        Raises:
            ControlInputError: as `wheel_speeds`.
        """
        left_v, right_v, w = infer(left, front, right, heading_deg, *self.tables)
        if left_v != left_v:
            raise refusal(left, front, right, heading_deg)
        return self._explainer.explain((left, front, right, heading_deg), left_v, right_v, w)

    def wheel_speeds_many(self, inputs: ArrayLike) -> NDArray[np.float64]:
        """Infer for rows of left, front, right [m], heading [degrees], shape (n, 4): left_v, right_v [m/s], (n, 2).

        Raises:
            ControlInputError: as `wheel_speeds`, naming the first such row.
        """
        rows = np.ascontiguousarray(inputs, dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != len(INPUTS):
            raise ControlInputError(f"expected an array of shape (n, {len(INPUTS)}), got {rows.shape}")
        speeds = np.empty((len(rows), 2))
        infer_rows(rows, speeds, *self.tables)
        refused = np.isnan(speeds[:, 0])
        if refused.any():
            first = int(np.argmax(refused))
            raise ControlInputError(f"row {first}: {refusal(*rows[first].tolist())}")
        return speeds


def refusal(left: float, front: float, right: float, heading_deg: float) -> ControlInputError:
    """Return a sentence on the input that cannot be."""
    named = zip(INPUTS, (left, front, right, heading_deg), strict=True)
    for name, value in named:
        if not isfinite(value):
            return ControlInputError(f"{name}: expected a finite number, got {value!r}; is the sensor alive?")
        if name != "head_ang" and value < 0:
            return ControlInputError(f"{name}: expected a distance >= 0 m, got {value!r}")
    raise AssertionError("every input is sound")
