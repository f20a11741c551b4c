"""Without the extra `ros2`, the files of this folder are skipped before they are imported."""

from tests.bridge.ros2.conftest import pytest_pycollect_makemodule

__all__ = ["pytest_pycollect_makemodule"]
