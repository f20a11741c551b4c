"""The picture in Rerun. Nothing outside this package imports rerun."""

from dashboard.rerun import lines  # noqa: F401, before all that imports Rerun
from dashboard.rerun.drawing import Picture
from dashboard.rerun.recorder import Recordings

__all__ = ["Picture", "Recordings"]
