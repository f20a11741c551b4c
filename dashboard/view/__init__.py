"""The picture in Rerun. Nothing outside this package imports rerun."""

from dashboard.view.drawing import View
from dashboard.view.recorder import Recorder, serve_page

__all__ = ["Recorder", "View", "serve_page"]
