"""Orders and messages of a master as plain values, as its own program would make them."""

import json
from itertools import pairwise
from typing import Any

from swarm.bridge.vda5050 import messages as vda

MAKER = "zenoh-swarm"


def header(robot: str = "r1", number: int = 0, version: str = "2.1.0") -> dict[str, Any]:
    return {
        "headerId": number, "timestamp": "2026-01-02T03:04:05.678Z", "version": version, "manufacturer": MAKER,
        "serialNumber": robot,
    }  # fmt: skip


def order_of(
    *places: tuple[str, float, float],
    order_id: str = "o1",
    update: int = 0,
    first: int = 0,
    released: int | None = None,
    robot: str = "r1",
) -> dict[str, Any]:
    """Return an order over some places; the ``released`` first ones are its base, all by default."""
    base = len(places) if released is None else released
    nodes: list[dict[str, Any]] = [
        {
            "nodeId": name, "sequenceId": first + 2 * index, "released": index < base, "actions": [],
            "nodePosition": {"x": x, "y": y, "mapId": "map", "allowedDeviationXY": 0.5},
        }
        for index, (name, x, y) in enumerate(places)
    ]  # fmt: skip
    edges = [
        {
            "edgeId": f"{start['nodeId']}-{end['nodeId']}", "sequenceId": end["sequenceId"] - 1,
            "released": end["released"], "startNodeId": start["nodeId"], "endNodeId": end["nodeId"], "actions": [],
        }
        for start, end in pairwise(nodes)
    ]  # fmt: skip
    return header(robot) | {"orderId": order_id, "orderUpdateId": update, "nodes": nodes, "edges": edges}


def actions_of(*kinds: str, robot: str = "r1") -> dict[str, Any]:
    """Return instant actions; the id of each is its kind, or what stands behind a ``#``."""
    listed = [
        {"actionType": kind.split("#")[0], "actionId": kind.split("#")[-1], "blockingType": "HARD"} for kind in kinds
    ]
    return header(robot) | {"actions": listed}


def taken(order: dict[str, Any]) -> vda.Order:
    return vda.decode_message(json.dumps(order).encode(), vda.Order)


def heard(actions: dict[str, Any]) -> list[vda.Action]:
    return vda.decode_message(json.dumps(actions).encode(), vda.InstantActions).actions
