"""The words that one must know to read the code, each with the class that it is: for architecture.md."""

import ast
from pathlib import Path
from typing import Final

from docs.markdown import rows

ROOT: Final = Path(__file__).parents[1]
WORDS: Final = {  # word: where its class is
    "aim": "swarm/robot/driving/aim.py Aiming",
    "broadcast": "swarm/messages/robot.py Broadcast",
    "cell map": "swarm/traffic/lattice/cell_map.py CellMap",
    "claim": "swarm/messages/traffic.py Claim",
    "clock": "swarm/messages/world.py Clock",
    "command": "swarm/messages/robot.py Command",
    "detour": "swarm/robot/driving/tables.py Detour",
    "epoch": "swarm/messages/traffic.py Epoch",
    "event": "swarm/messages/world.py Event",
    "evasion": "swarm/robot/driving/evasion.py Evasion",
    "footprint": "swarm/traffic/reservations/route.py Footprint",
    "ground": "swarm/robot/ground.py Ground",
    "joint plan": "swarm/messages/traffic.py JointPlan",
    "lateness": "swarm/robot/driving/lateness.py Lateness",
    "membership": "world/fleet/membership.py Membership",
    "mission": "swarm/robot/mission.py Mission",
    "mover": "swarm/settings.py MoverSettings",
    "obstacle detector": "swarm/traffic/obstacles/detector.py ObstacleDetector",
    "order": "swarm/messages/world.py Order",
    "peer records": "swarm/traffic/peers/records.py PeerRecords",
    "pilot": "swarm/robot/driving/cell_pilot.py CellPilot",
    "pool": "world/tasks/task_pool.py TaskPool",
    "radio model": "world/bodies/radio_model.py RadioModel",
    "record": "swarm/messages/traffic.py Record",
    "replay": "swarm/blackbox/replay/replay.py Replay",
    "reservations": "swarm/traffic/reservations/rules.py Reservations",
    "robot": "swarm/robot/brain.py Robot",
    "rollout": "swarm/robot/driving/tables.py Rollout",
    "route": "swarm/traffic/reservations/route.py RouteProgress",
    "safety filter": "swarm/robot/driving/safety.py SafetyFilter",
    "scan": "swarm/traffic/obstacles/scan.py Scan",
    "seat": "swarm/robot/host/seat.py Seat",
    "sense": "swarm/messages/robot.py Sense",
    "sighting": "swarm/messages/traffic.py Sighting",
    "situation": "swarm/traffic/peers/situation.py Situation",
    "storm plan": "swarm/storm/plans/plan.py StormPlan",
    "tape": "swarm/tape/writer.py Tape",
    "truth": "swarm/messages/world.py Truth",
    "turn": "swarm/messages/traffic.py Entry",
    "welcome": "swarm/messages/world.py Welcome",
    "world": "world/world.py World",
}


def table() -> str:
    """Return the table of words: what each means, by the first sentence of its class, and where it is."""
    return rows(("word", "what it is", "class"), *(_row(word, *place.split()) for word, place in WORDS.items()))


def _row(word: str, file: str, name: str) -> tuple[str, str, str]:
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    found = next(node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == name)
    meaning = (ast.get_docstring(found) or "").split("\n")[0].replace("``", "`")
    return word, meaning, f"`{name}` in `{file}`"
