"""What a master may know of a robot before it gives orders: the factsheet of VDA 5050, from the scenario. Pure."""

from typing import Any, Final

from swarm.bridge.vda5050 import messages as vda
from swarm.bridge.vda5050.vehicle import ASKS, TELLS
from swarm.kinds import PLAIN
from swarm.robot.mission import TURNED
from swarm.settings import Settings

MOST_TARGETS: Final = 100  # the world's limit of an order
WHEEL_WIDTH: Final = 0.1  # share of the track width: the world's wheels have no width
UNKNOWN_HEIGHT: Final = 0.0  # m; the world is flat
SERIES: Final = "zenoh-swarm"
DESCRIPTION: Final = (
    "a robot with differential drive in a fleet that coordinates itself: it plans its own way from node to node, waits "
    "for others where it has to, and follows no edge"
)


def build_factsheet(settings: Settings, every: float, shown_every: float | None, kind: str = PLAIN) -> dict[str, Any]:
    """Return the body of a factsheet of a vehicle of a kind, from the settings as they are for that kind.

    States are sent at least each ``every`` [s], visualizations as often as given. A kind has a series of its own.
    """
    robot = settings.robot
    return {
        "typeSpecification": {
            "seriesName": f"{SERIES}-{kind}" if kind else SERIES,
            "seriesDescription": DESCRIPTION,
            "agvKinematic": "DIFF",
            "agvClass": "CARRIER",
            "maxLoadMass": 0.0,
            "localizationTypes": ["NATURAL"],
            "navigationTypes": ["AUTONOMOUS"],
        },
        "physicalParameters": {
            "speedMin": 0.0,
            "speedMax": robot.top_speed,
            "accelerationMax": robot.wheel_acceleration,
            "decelerationMax": robot.wheel_acceleration,
            "heightMax": UNKNOWN_HEIGHT,
            "width": 2 * robot.radius,
            "length": 2 * robot.radius,
        },
        "protocolLimits": {
            "maxStringLens": {"msgLen": vda.LIMIT, "idLen": vda.MOST_ID},
            "maxArrayLens": {
                "order.nodes": MOST_TARGETS,
                "order.edges": MOST_TARGETS,
                "instantActions": vda.MOST_ACTIONS,
            },
            "timing": {
                "minOrderInterval": 0.1,
                "minStateInterval": 0.2,
                "defaultStateInterval": every,
                **({} if shown_every is None else {"visualizationInterval": shown_every}),
            },
        },
        "protocolFeatures": {
            "optionalParameters": [
                {"parameter": "order.nodes.nodePosition", "support": "REQUIRED"},
                {
                    "parameter": "order.nodes.nodePosition.allowedDeviationXY",
                    "support": "SUPPORTED",
                    "description": f"of the first node; all others are reached within {settings.reach:g} m",
                },
                {
                    "parameter": "order.nodes.nodePosition.theta",
                    "support": "SUPPORTED",
                    "description": f"of all nodes but the first: the vehicle turns to it there, within {TURNED:g} rad",
                },
            ],
            "agvActions": [{"actionType": kind, "actionScopes": ["INSTANT"]} for kind in (*ASKS, *TELLS)],
        },
        "agvGeometry": {
            "wheelDefinitions": [
                {
                    "type": "DRIVE",
                    "isActiveDriven": True,
                    "isActiveSteered": False,
                    "position": {"x": 0.0, "y": side * robot.track_width / 2},
                    "diameter": robot.radius,
                    "width": WHEEL_WIDTH * robot.track_width,
                }
                for side in (1, -1)
            ]
        },
        "loadSpecification": {"loadPositions": [], "loadSets": []},
    }
