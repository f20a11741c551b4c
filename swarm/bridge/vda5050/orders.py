"""Whether a vehicle takes an order or an update, and what is ahead of it then: section 6.6 of VDA 5050 2.1. Pure.

The numbers in comments are those of the standard's figure of order updates.
"""

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

from swarm.bridge.vda5050 import messages as vda
from swarm.geometry import Pose, distance
from swarm.robot.mission import TURNED

VALIDATION: Final = "validationError"  # the standard's names of errors
ORDER: Final = "orderError"
UPDATE: Final = "orderUpdateError"


class OrderNode(NamedTuple):
    """A node of an order."""

    node_id: str
    sequence_id: int


NOWHERE: Final = OrderNode("", 0)  # the standard's words for no node


class VehicleOrder(NamedTuple):
    """The order that a vehicle has or had last, and what is ahead of it."""

    order_id: str = ""
    update: int = 0
    last: OrderNode = NOWHERE  # the last node that it has traversed
    nodes: tuple[vda.Node, ...] = ()
    edges: tuple[vda.Edge, ...] = ()
    ignored: tuple[str, ...] = ()  # fields of the order that the vehicle does not heed

    @property
    def base(self) -> tuple[vda.Node, ...]:
        """The nodes that it may drive to."""
        return tuple(node for node in self.nodes if node.released)

    def ahead_after(self, node: vda.Node) -> "VehicleOrder":
        """Return what is ahead when a node was traversed."""
        return self._replace(
            last=to_order_node(node),
            nodes=tuple(one for one in self.nodes if one.sequence_id > node.sequence_id),
            edges=tuple(one for one in self.edges if one.sequence_id > node.sequence_id),
        )

    def without_nodes(self) -> "VehicleOrder":
        """Return the same order with nothing ahead."""
        return self._replace(nodes=(), edges=())


class VehiclePosition(NamedTuple):
    """Where a vehicle is and how it drives."""

    pose: Pose
    map_id: str
    reach: float  # m; a node counts as reached within this distance


def judge_order(order: vda.Order, now: VehicleOrder, floor: VehiclePosition) -> VehicleOrder | vda.Error | None:
    """Return what is ahead if the vehicle takes the order, why it does not, or None for an update that it has."""
    for kind, faults in ((VALIDATION, _find_malformed(order)), (ORDER, _find_unsupported(order, floor.map_id))):  # 1
        if (fault := next(faults, None)) is not None:
            return make_order_error(kind, order, *fault)
    first = order.nodes[0]
    if order.order_id != now.order_id:  # 2
        if now.nodes:  # 3
            text = f"expected no new order before order {now.order_id} is done, got {order.order_id}; cancel that one"
            return make_order_error(ORDER, order, text)
        return _ahead_of_new_order(order, first, now, floor)
    if order.order_update_id < now.update:  # 5
        text = f"orderUpdateId: expected more than {now.update}, got {order.order_update_id}; this update is void"
        return make_order_error(UPDATE, order, text)
    if order.order_update_id == now.update:  # 6
        return None
    end = to_order_node(now.base[-1]) if now.base else now.last
    if to_order_node(first) != end:  # 7, 8
        got = _format_node(to_order_node(first))
        text = f"nodes[0]: expected {_format_node(end)}, where the base of order {now.order_id} ends, got {got}"
        return make_order_error(UPDATE, order, text, ("nodeId", first.node_id))
    return now._replace(
        update=order.order_update_id,
        nodes=(*now.base, *order.nodes[1:]),
        edges=(*(edge for edge in now.edges if edge.released), *order.edges),
        ignored=_ignored_fields(order, floor.reach),
    )


def _ahead_of_new_order(
    order: vda.Order, first: vda.Node, now: VehicleOrder, floor: VehiclePosition
) -> VehicleOrder | vda.Error:
    """Return what is ahead of a vehicle that begins a new order: it has to begin where the vehicle stands."""
    at = first.node_position
    assert at is not None, "checked before"
    taken = VehicleOrder(
        order_id=order.order_id,
        update=order.order_update_id,
        last=now.last,
        nodes=tuple(order.nodes),
        edges=tuple(order.edges),
        ignored=_ignored_fields(order, floor.reach),
    )
    away = distance(floor.pose, (at.x, at.y))
    within = max(at.allowed_deviation or 0.0, floor.reach)
    if away <= within:
        return taken.ahead_after(first)
    if first.node_id == now.last.node_id:  # it left that node, in an order that was cancelled: it drives back
        return taken
    text = (  # 4
        f"nodes[0] {first.node_id} at ({at.x:g}, {at.y:g}): expected within {within:g} m of the vehicle, which is "
        f"{away:.2f} m away at ({floor.pose.x:.2f}, {floor.pose.y:.2f}), or its last node; begin where it stands"
    )
    return make_order_error(ORDER, order, text, ("nodeId", first.node_id))


def make_order_error(kind: str, order: vda.Order, text: str, *about: tuple[str, object]) -> vda.Error:
    """Return the error that says why an order is not taken, or is not carried out any more."""
    named = (("headerId", order.header_id), ("orderId", order.order_id), ("orderUpdateId", order.order_update_id))
    return vda.Error(
        error_type=kind,
        error_level="WARNING",
        error_references=tuple(vda.make_reference(key, value) for key, value in (*named, *about)),
        error_description=text,
    )


def to_order_node(node: vda.Node) -> OrderNode:
    """Return a node's name and number."""
    return OrderNode(node.node_id, node.sequence_id)


def _format_node(place: OrderNode) -> str:
    return f"{place.node_id!r} with sequenceId {place.sequence_id}"


Fault = tuple[str, *tuple[tuple[str, object], ...]]  # a sentence, and what it is about


def _find_malformed(order: vda.Order) -> Iterator[Fault]:
    """Yield what no order of the standard may have: nodes and edges in turn, the base before the horizon."""
    nodes, edges = order.nodes, order.edges
    if len(edges) != len(nodes) - 1:
        yield (f"edges: expected one between each two of {len(nodes)} nodes, got {len(edges)}",)
        return
    if not nodes[0].released:
        yield "nodes[0]: expected a released node, got one of the horizon", ("nodeId", nodes[0].node_id)
    for index, (edge, start, end) in enumerate(zip(edges, nodes, nodes[1:], strict=False)):
        about = "edgeId", edge.edge_id
        if (edge.start_node_id, edge.end_node_id) != (start.node_id, end.node_id):
            ends = f"from {edge.start_node_id!r} to {edge.end_node_id!r}"
            yield f"edges[{index}]: expected from {start.node_id!r} to {end.node_id!r}, got {ends}", about
        if not start.sequence_id < edge.sequence_id < end.sequence_id:
            numbers = f"{start.sequence_id}, {edge.sequence_id}, {end.sequence_id}"
            yield f"edges[{index}]: expected sequenceIds that rise from node to edge to node, got {numbers}", about
        if edge.released != end.released or end.released > start.released:
            yield f"edges[{index}]: expected all of the base before all of the horizon", about


def _find_unsupported(order: vda.Order, map_id: str) -> Iterator[Fault]:
    """Yield what a robot of this fleet cannot do."""
    if order.zone_set_id:
        yield (
            f"zoneSetId: expected none, got {order.zone_set_id!r}; this vehicle has no zones",
            ("zoneSetId", order.zone_set_id),
        )
    parts: Sequence[vda.OrderPart]
    for kind, parts in (("nodes", order.nodes), ("edges", order.edges)):
        for index, part in enumerate(parts):
            for action in part.actions:
                about = ("actionId", action.action_id), ("actionType", action.action_type)
                yield (
                    f"{kind}[{index}].actions: expected none, got {action.action_type!r}; this vehicle only drives",
                    *about,
                )
    for index, node in enumerate(order.nodes):
        if node.node_position is None:
            yield f"nodes[{index}].nodePosition: expected one, got none", ("nodeId", node.node_id)
        elif node.node_position.map_id != map_id:
            said = f"nodes[{index}].nodePosition.mapId: expected {map_id!r}, got {node.node_position.map_id!r}"
            yield said, ("nodeId", node.node_id), ("mapId", node.node_position.map_id)


def _ignored_fields(order: vda.Order, reach: float) -> tuple[str, ...]:
    """Return the fields of an order that a robot does not heed: it plans its own way, at its own speed."""
    positions = [node.node_position for node in order.nodes[1:] if node.node_position is not None]
    found = {
        f"nodePosition.allowedDeviationTheta below {TURNED:g} rad": any(
            at.theta is not None and 0.0 < (at.allowed_deviation_theta or 0.0) < TURNED for at in positions
        ),
        f"nodePosition.allowedDeviationXY below {reach:g} m": any(
            at.allowed_deviation is not None and 0.0 < at.allowed_deviation < reach for at in positions
        ),
        "edge.maxSpeed": any(edge.max_speed is not None for edge in order.edges),
        "edge.maxRotationSpeed": any(edge.max_rotation_speed is not None for edge in order.edges),
        "edge.orientation": any(edge.orientation is not None for edge in order.edges),
        "edge.direction": any(edge.direction for edge in order.edges),
        "edge.rotationAllowed": any(edge.rotation_allowed is False for edge in order.edges),
        "edge.trajectory": any(edge.trajectory is not None for edge in order.edges),
        "edge.corridor": any(edge.corridor is not None for edge in order.edges),
    }
    return tuple(name for name, there in found.items() if there)
