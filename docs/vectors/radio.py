"""The test vectors of the radio and the rays: when and where a robot sends, and what its rays mean."""

from collections.abc import Callable
from dataclasses import replace
from math import cos, sin
from typing import Final

import msgspec
import numpy as np

from docs.vectors.floors import paper, squares
from docs.vectors.writing import Json, metres
from swarm.bus.losses import Gaps, Numbers
from swarm.geometry import Pose
from swarm.messages import RADIO
from swarm.robot.host.radio import zone_of, zones_around
from swarm.robot.sectors import sectors
from swarm.settings import SensorSettings
from swarm.traffic.lattice.placement import traffic_settings
from swarm.traffic.outputs import RecordWriter
from world.bodies.rays import cast_all


def radio() -> Json:
    """Return the vector of phases, zones and attachments."""
    _, settings = squares()
    constants, reach = traffic_settings(settings), settings.radio.range
    phases = []
    for number, every, listening in (
        (1, 4, False),
        (2, 4, False),
        (4, 4, False),
        (7, 4, False),
        (3, 3, False),
        (2, 4, True),
    ):
        telling = RecordWriter(f"r{number}", replace(constants, every=every), number - 1, 1.2)
        ticks = [tick for tick in range(100, 125) if telling.is_due(tick, often=listening)]
        phases.append({"robot": f"r{number}", "every": every, "somebody_listens": listening, "sends_at": ticks})
    zones = []
    for x, y in ((1.0, 1.0), (7.99, 8.01), (8.0, 0.0), (-0.01, 3.0), (-8.0, -8.01), (100.0, 55.9)):
        here = zone_of(x, y, reach)
        key = RADIO.key.format(zx=here[0], zy=here[1], robot="r2")
        zones.append({"at": [x, y], "key": key, "hears": [[*one] for one in sorted(zones_around(here))]})
    numbers, gaps, attached = Numbers(), Gaps(), []
    numbers.sender = 3141592653
    sent = [(key, numbers.attachment(key)) for key in ("robot/r2/cmd", "radio/0/0/r2", *["robot/r2/cmd"] * 4)]
    numbers = Numbers()
    numbers.sender = 200
    sent += [("robot/r2/cmd", numbers.attachment("robot/r2/cmd")) for _ in range(2)]
    for at, (key, data) in enumerate(sent):
        came = at not in {3, 4}
        lost = gaps.count_lost(key, data) if came else None
        attached.append({"key": key, "attachment": data.hex(), "array": [*msgspec.msgpack.decode(data)], "lost": lost})
    return {
        "description": "When and on which key a robot sends its broadcasts, and what it attaches to each message.",
        "phases_description": "Of the ticks 100 to 124, those at which a robot broadcasts. With `somebody_listens`, "
        "`often` is in the place of `every`.",
        "phases": phases,
        "zones_description": f"Keys below the fleet's, and the zones (zx, zy) to listen to; the range is {reach:g} m.",
        "zones": zones,
        "attachments_description": "MessagePack as hex, of messages in the order of sending: of a sender, and of the "
        "same one after it has started again. `lost`: how many are missing right before this one, as a receiver "
        "counts them; null: this one is lost itself.",
        "attachments": attached,
    }


def rays() -> Json:
    """Return the vector of the rays' angles, and of what they measure on the paper's floor."""
    floor, settings = paper()
    fans = []
    for sensors in (
        settings.sensors,
        SensorSettings(rays=1),
        SensorSettings(rays=4, side_deg=90.0, side_half_width_deg=45.0),
    ):
        names = ("rays", "side_deg", "side_half_width_deg", "front_half_width_deg")
        angles = {side: metres(*found) for side, found in sectors(sensors)._asdict().items()}
        fans.append({"sensors": {name: getattr(sensors, name) for name in names}, "angles": angles})
    scans, sensors, radius = [], settings.sensors, settings.robot.radius
    every = [angle for sector in sectors(sensors) for angle in sector]
    solid, nothing = np.ascontiguousarray(floor.cells != 0).astype(np.uint8), np.zeros((0, 5))
    for pose in (Pose(1.0, 1.2, 3.0), Pose(6.0, 5.0, 0.0), Pose(9.2, 6.3, 1.0), Pose(3.0, 3.0, -2.0)):
        yaws, discs = np.array([pose.yaw]), np.array([[pose.x, pose.y, radius]])
        me = np.zeros(1, np.int64)
        measured = cast_all(
            solid, floor.resolution, *floor.origin, me, yaws, discs, nothing, np.array(every), sensors.range
        )
        lengths = measured[0].tolist()
        ends = [
            [round(at + (radius + length) * along(pose.yaw + angle), 6) for at, along in ((pose.x, cos), (pose.y, sin))]
            for length, angle in zip(lengths, every, strict=True)
        ]
        scans.append({"pose": [*pose], "rays": metres(*lengths), "ends": ends})
    return {
        "description": "The angles of the rays of each sector [rad, from the heading, left positive], and their ends.",
        "fans": fans,
        "scans_description": "What a sense says in `rays` for a robot at a pose, alone on the floor of "
        "lattice-paper.json, with the first of the sensors above, and the point where each ray ends. A ray as long as "
        "`range` has hit nothing.",
        "radius": radius,
        "range": sensors.range,
        "scans": scans,
    }


VECTORS: Final[dict[str, Callable[[], Json]]] = {"radio": radio, "rays": rays}
