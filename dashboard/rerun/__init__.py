"""The picture in Rerun. Nothing outside this package imports rerun."""

from dashboard.rerun import lines  # noqa: F401, before all that imports Rerun
from dashboard.rerun.drawing import View
from dashboard.rerun.recorder import Recorder

__all__ = ["Recorder", "View"]
