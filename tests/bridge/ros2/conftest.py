"""Without the extra `ros2`, the files of this folder are skipped before they are imported."""

from tests.bridge.skipping import skipped_without

pytest_pycollect_makemodule = skipped_without("ros2")
