"""The file of a report: whole or not there, and JSON that everybody can read."""

import json
import resource
from pathlib import Path

import pytest

from swarm.errors import ConfigError
from world.views.report_file import write

SUMMARY = {"gap": float("inf"), "rows": [1.5, float("nan"), {"least": -float("inf")}], "none": None, "text": "é"}


def test_a_report_is_written_as_json_without_numbers_that_json_lacks(tmp_path: Path) -> None:
    write(SUMMARY, tmp_path / "report.json")
    text = (tmp_path / "report.json").read_text(encoding="utf-8")
    assert json.loads(text) == {"gap": None, "rows": [1.5, None, {"least": None}], "none": None, "text": "é"}
    assert text.endswith("}\n")


def test_a_report_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "r.json"
    write({"complete": True}, path)
    with pytest.raises(ConfigError, match=r"--report /dev/full: expected to write the report, got: No space left"):
        write(SUMMARY, Path("/dev/full"))
    with pytest.raises(ConfigError, match="expected to write the report, got: Is a directory"):
        write(SUMMARY, tmp_path)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10, limits[1]))
    try:
        with pytest.raises(ConfigError, match="expected to write the report, got: File too large"):
            write(SUMMARY, path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert json.loads(path.read_text()) == {"complete": True}, "the report of the last run is kept"
    assert list(tmp_path.iterdir()) == [path]
