"""A slow network between robots and router: missions, times, overlaps: ``python -m benchmarks.slow_network``.

Each run is `swarm run SCENARIO --robots 8 --delay MS` in real time: robots in processes of their own reach the router
through a proxy that hands on every byte so much later, each way. So an answer is there two delays after its sense. The
first delays are those that the reservations bear; beyond, the wheels refuse answers that are older than 0.25 s.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from benchmarks.measure import load, machine, printed

ROBOTS: Final = 8
SCENARIOS: Final = ("crossing", "paper", "doorway")
BORNE: Final = ("0", "10", "28", "60", "30,20")  # ms each way; after the comma: give or take
BEYOND: Final = ("100", "150", "300")
CUT: Final = 30.0  # s after which a run beyond is cut: it may never be complete
SLOWER: Final = 1.2  # most times the mission time without delay, at 28 ms
JUDGED: Final = "28"  # ms, for which that holds
HEAD: Final = (
    "scenario, ms each way", "complete", "time [s]", "times that at 0", "needed", "answers late", "overlaps", "outside",
    "contacts", "load",
)  # fmt: skip


def ran(scenario: str, delay: str, limit: float | None) -> dict[str, Any]:
    """Return the report of a run with a delay [ms] each way; ``limit`` [simulated s] cuts it."""
    with TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        words = ["run", scenario, "--robots", str(ROBOTS), "--delay", delay, "--dashboard", "off"]
        words += ["--quiet", "--report", str(report), *(("--limit", f"{limit:g}") if limit else ())]
        subprocess.run([sys.executable, "-m", "swarm.cli", *words], stdout=subprocess.DEVNULL, check=False)
        summary: dict[str, Any] = json.loads(report.read_text(encoding="utf-8"))
    return summary


def main() -> int:
    """Print the table; return 1 if robots came too near each other, or a mission within the bars was not complete."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenario", action="append", choices=SCENARIOS, help="only this one; may be repeated")
    parser.add_argument("--delay", action="append", choices=(*BORNE, *BEYOND), help="only this one; may be repeated")
    given = parser.parse_args()
    times: dict[str, float] = {}  # s, of each scenario without delay
    wrong: list[str] = []

    def measured(scenario: str, delay: str) -> list[str]:
        report = ran(scenario, delay, None if delay in BORNE else CUT)
        traffic, contacts = report["traffic"], sum(report["contacts"].values())
        time, ratio = report["sim_time"], 0.0
        if delay == "0" and report["complete"]:
            times[scenario] = time
        if scenario in times and report["complete"]:
            ratio = time / times[scenario]
        bad = traffic["overlaps"] + traffic["outside"] + contacts > 0 or (delay in BORNE and not report["complete"])
        wrong.extend([f"{scenario}, {delay}"] * (bad or (delay == JUDGED and ratio > SLOWER)))
        return [
            "yes" if report["complete"] else "no", f"{time:.1f}", f"{ratio:.2f}" if ratio else "",
            f"<= {SLOWER:g}" if delay == JUDGED else "", f"{report['late_commands'] / report['ticks'] / ROBOTS:.0%}",
            str(traffic["overlaps"]), str(traffic["outside"]), str(contacts), load(),
        ]  # fmt: skip

    print(machine())
    cases = [(one, delay) for one in given.scenario or SCENARIOS for delay in given.delay or (*BORNE, *BEYOND)]
    printed(HEAD, [(f"{one}, {delay}", lambda one=one, delay=delay: measured(one, delay)) for one, delay in cases])
    print("\n".join(f"missed: {case}" for case in wrong) or "all bars are kept")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
