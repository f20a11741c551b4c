"""The same swap over a circle in ir-sim, a simulator whose robots avoid each other by reciprocal velocity obstacles.

All robots change places with the one opposite, on a free floor. ir-sim runs in an environment of its own
(.venv-peers-ir-sim), which the first run creates: rvo, 9 rays, steps of 0.1 s. Ours steps twice as often.
"""

import json
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from benchmarks.measure import load
from benchmarks.scaling.alone import in_one_process
from swarm.messages import SENSE
from swarm.scenario.load import load as load_scenario

ROOT: Final = Path(__file__).parents[2]
ENVIRONMENT: Final = ROOT / ".venv-peers-ir-sim"
REQUIREMENT: Final = "ir-sim==2.12.0"
ROBOTS: Final = (16, 32, 64)
STEP: Final = 0.1  # s, ir-sim's
SPACE: Final = 1.5  # m of the circle for each robot
SPEED: Final = 0.6  # m/s: ours cruise at it
HEAD: Final = (
    "circle, CPU s of a simulated s", "ir-sim, 10 Hz", "ours, 20 Hz", "ir-sim over ours", "bar", "ir-sim", "load",
)  # fmt: skip


def diameter(robots: int) -> float:
    """Return the diameter of the circle [m]: whole metres, at least that of the scenario `circle`."""
    return float(max(14, round(robots * SPACE / 3)))


def scenario(robots: int) -> dict[str, Any]:
    """Return our scenario: `circle` on a floor as large as this circle needs."""
    side = int(diameter(robots)) + 4
    ours = load_scenario(ROOT / "scenarios" / "circle.yaml").settings
    rows = ["#" * side, *["#" + "." * (side - 2) + "#"] * (side - 2), "#" * side]
    return {
        "name": "circle",
        "map": {"cell": 1.0, "text": "\n".join(rows)},
        "start": {"circle": [side / 2, side / 2, diameter(robots)]},
        "return_home": False,
        "reach": ours.reach,
        "robot": {"speed_scale": ours.robot.speed_scale, "distance_scale": ours.robot.distance_scale},
        "sensors": {"side_deg": 30.0, "side_half_width_deg": 10.0, "front_half_width_deg": 10.0},
    }


def world(robots: int) -> dict[str, Any]:
    """Return ir-sim's world of the same circle."""
    side = diameter(robots) + 4
    lidar = {"name": "lidar2d", "range_min": 0.0, "range_max": 1.6, "angle_range": 1.9, "number": 9}
    group = {
        "number": robots,
        "distribution": {"name": "circle", "radius": diameter(robots) / 2, "center": [side / 2, side / 2, 0.0]},
        "kinematics": {"name": "diff"},
        "shape": {"name": "circle", "radius": 0.2},
        "vel_min": [-SPEED, -2.0],
        "vel_max": [SPEED, 2.0],
        "goal_threshold": 0.3,
        "behavior": {"name": "rvo"},
        "sensors": [lidar],
    }
    about = {"height": side, "width": side, "step_time": STEP, "sample_time": STEP, "collision_mode": "unobstructed"}
    return {"world": about, "robot": [group]}


def installed() -> bool:
    """Install ir-sim if it is not there; print a sentence and return False if that fails."""
    if (ENVIRONMENT / ".ready").exists():
        return True
    print(f"installing {REQUIREMENT} ...", file=sys.stderr)
    subprocess.run([sys.executable, "-m", "venv", ENVIRONMENT], check=True)
    pip = [str(ENVIRONMENT / "bin" / "python"), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    if subprocess.run([*pip, REQUIREMENT], stderr=subprocess.DEVNULL, check=False).returncode:
        print(f"left out: {REQUIREMENT} cannot be installed here\n")
        return False
    (ENVIRONMENT / ".ready").touch()
    return True


def theirs(robots: int, seconds: float, folder: Path) -> dict[str, Any]:
    """Run ir-sim's circle; return its CPU time of a simulated second and its version."""
    file = folder / "world.yaml"
    file.write_text(json.dumps(world(robots)), encoding="utf-8")
    peer = Path(__file__).with_name("beside_peer.py")
    command = [str(ENVIRONMENT / "bin" / "python"), str(peer), str(file), f"{seconds:g}"]
    done = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, text=True, check=True)
    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer


def line(robots: int, seconds: float, python: str) -> tuple[str, ...]:
    """Return a row of the table: first theirs, then ours."""
    with TemporaryDirectory() as folder:
        other = theirs(robots, seconds, Path(folder))
        file = Path(folder) / "circle.yaml"
        file.write_text(json.dumps(scenario(robots)), encoding="utf-8")  # JSON is YAML
        ours = in_one_process((str(file),), robots, seconds, python)["robot_tick"] * robots * SENSE.rate
    ratio = f"{other['cpu'] / ours:.2f}"
    return f"{other['cpu']:.3f}", f"{ours:.3f}", ratio, "1", other["version"], load()
