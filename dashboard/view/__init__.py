"""The only place that touches Rerun."""

from dashboard.view.drawing import View
from dashboard.view.recorder import Recorder, serve_page

__all__ = ["Recorder", "View", "serve_page"]
