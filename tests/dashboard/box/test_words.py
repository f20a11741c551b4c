"""The sentences of the page, as Node makes them: their module imports nothing of the browser's."""

import json
import subprocess
from pathlib import Path
from shlex import quote
from shutil import which
from typing import Any, Final

import pytest

from dashboard.box.server import assets

NODE: Final = which("node")
ABOUT: Final = {"seen": {"waits": ["r1"]}, "waiting": False, "home": True}
ROW: Final[dict[str, Any]] = {
    "robot": "r2", "heard": "alive", "doing": "to 1", "activity": "drive", "target": 0, "stops": 4, "reached": 0,
    "left": 3.21, "waits": 0.0, "unreachable": [], "assignment": 0, "turn": 0, "queue": 0,
}  # fmt: skip
SAYS: Final = """
import { doing, nth, quoted } from "./words.mjs";
const [rows, about, numbers, files] = JSON.parse(process.argv[2]);
console.log(JSON.stringify([rows.map((row) => doing(row, about)), numbers.map(nth), files.map(quoted)]));
"""
# fmt: off
SENTENCES: Final[dict[str, dict[str, Any]]] = {
    "drives to target 1, 3.2 m left; 0 of 4 targets reached": {},
    "drives to target 1, 3.2 m left, 2nd of 4 there; 0 of 4 targets reached": {"turn": 2, "queue": 4},
    "gives way to r1 for 3 s, before target 1, 3rd of 4 there; 0 of 4 targets reached":
        {"activity": "give_way", "waits": 3.0, "turn": 3, "queue": 4},
    "is blocked: something unexpected is in its way to home, 1st of 2 there; 3 of 4 targets reached":
        {"activity": "blocked", "target": 3, "reached": 3, "turn": 1, "queue": 2},
    "is done: 4 of 4 targets reached": {"activity": "done", "target": 4, "reached": 4},
}
NUMBERS: Final = {1: "1st", 2: "2nd", 3: "3rd", 4: "4th", 11: "11th", 12: "12th", 13: "13th", 21: "21st", 102: "102nd", 112: "112th"}
# fmt: on
FILES: Final = ["/run/user/0/anna-paper.swarm", "/home/anna/my runs/it's.swarm", "/tmp/$(x).swarm", ""]


@pytest.mark.skipif(NODE is None, reason="no Node on this machine: apt-get install nodejs")
def test_a_row_becomes_a_sentence_and_a_path_a_word_of_a_shell(tmp_path: Path) -> None:
    (tmp_path / "words.mjs").write_bytes(assets()["words.js"][0])
    (tmp_path / "says.mjs").write_text(SAYS)
    asked = [[ROW | changed for changed in SENTENCES.values()], ABOUT, list(NUMBERS), FILES]
    told = subprocess.run(
        [str(NODE), str(tmp_path / "says.mjs"), json.dumps(asked)], capture_output=True, text=True, check=True
    )
    assert json.loads(told.stdout) == [list(SENTENCES), list(NUMBERS.values()), list(map(quote, FILES))]
