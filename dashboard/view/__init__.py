"""The picture in Rerun. Nothing outside this package imports rerun."""

import dashboard.view.lines  # noqa: F401, before all that imports Rerun
from dashboard.view.drawing import View
from dashboard.view.recorder import Recorder

__all__ = ["Recorder", "View"]
