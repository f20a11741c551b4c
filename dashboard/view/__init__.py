"""The picture in Rerun. Nothing outside this package imports rerun."""

from dashboard.view.drawing import View
from dashboard.view.recorder import Recorder

__all__ = ["Recorder", "View"]
