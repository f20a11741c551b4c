"""The picture in Rerun. Nothing outside this package imports rerun."""

from dashboard.rerun import lines  # noqa: F401, before all that imports Rerun
from dashboard.rerun.recorder import Recordings
from dashboard.rerun.run_picture import Picture

__all__ = ["Picture", "Recordings"]
